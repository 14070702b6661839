"""The experiments by name, in the papers' order."""

from collections.abc import Callable, Mapping

from benchmarks.estimation.papers import (
    contact_phases,
    fixed_floating,
    gait_torques,
    measured_estimated,
)
from benchmarks.estimation.papers.reports import Report
from benchmarks.estimation.papers.scenes import Scenes

EXPERIMENTS: Mapping[str, Callable[[Scenes], Report]] = {
    "contacts": contact_phases.experiment,
    "measured": measured_estimated.experiment,
    "gait": gait_torques.experiment,
    "fixed": fixed_floating.experiment,
}
__all__ = ["EXPERIMENTS", "Scenes"]
