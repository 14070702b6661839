"""The experiments by name, in the papers' order."""

from collections.abc import Callable, Mapping

from benchmarks.estimation.papers import (
    arm_torques,
    carrying,
    compute_times,
    contact_phases,
    feet_covariance,
    fixed_floating,
    gait_torques,
    hand_covariance,
    measured_estimated,
    tpose_effort,
    walking_instants,
)
from benchmarks.estimation.papers.reports import Report
from benchmarks.estimation.papers.scenes import Scenes

EXPERIMENTS: Mapping[str, Callable[[Scenes], Report]] = {
    "contacts": contact_phases.experiment,
    "measured": measured_estimated.experiment,
    "gait": gait_torques.experiment,
    "fixed": fixed_floating.experiment,
    "effort": tpose_effort.experiment,
    "feet": feet_covariance.experiment,
    "arm": arm_torques.experiment,
    "hand": hand_covariance.experiment,
    "carrying": carrying.experiment,
    "moments": walking_instants.experiment,
    "times": compute_times.experiment,
}
__all__ = ["EXPERIMENTS", "Scenes"]
