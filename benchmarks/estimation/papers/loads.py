"""The 2021 paper's two methods and ours, on a task with something in one hand or in both."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from benchmarks.estimation.papers.bases import UNTOUCHED
from benchmarks.estimation.papers.measuring import (
    Measured,
    as_in_the_paper,
    without_accelerations,
)
from estimation import (
    Estimate,
    FreeWrench,
    TwoStepCovariances,
    estimate,
    hinge_tree,
    real_tree,
)

RIGHT = ("RightHandCOM",)
BOTH = ("RightHandCOM", "LeftHandCOM")
G = 9.81


def without_ncwe(
    task: Measured,
    preset: TwoStepCovariances,
    sites: Sequence[str] = RIGHT,
    *,
    accelerations: bool = True,
) -> Estimate:
    """Estimates in one step with the paper's covariances, the hands' as in its first step.

    Args:
        task: the readings.
        preset: the covariances.
        sites: hands whose wrench is to be found; others bear nothing.
        accelerations: as measured; False puts zeros in their place, as the published software did.
    """
    q, v, a = task.state()
    sensors = as_in_the_paper(task.sensors, preset)
    if not accelerations:
        sensors = without_accelerations(sensors)
    force, moment = preset.hand_force**0.5, preset.hand_moment**0.5
    sensors += [FreeWrench(site, force, moment) for site in sites]
    return estimate(hinge_tree(task.model), q, v, a, sensors, covariances=preset.covariances)


def with_ncwe(
    task: Measured,
    preset: TwoStepCovariances,
    sites: Sequence[str] = RIGHT,
    *,
    accelerations: bool = True,
) -> Estimate:
    """Estimates in the paper's two steps; without accelerations from weight alone, and at rest."""
    q, v, a = task.state()
    sensors = [*task.sensors, *(FreeWrench(site) for site in sites)]
    if not accelerations:
        sensors = without_accelerations(sensors)
        v, a = np.zeros_like(v), np.zeros_like(a)
    return estimate(hinge_tree(task.model), q, v, a, sensors, method="two_step", preset=preset)


def ours(task: Measured, sites: Sequence[str] = RIGHT) -> Estimate:
    """Estimates in one step with the noise as covariance, on real links."""
    q, v, a = task.state()
    sensors = [*task.sensors, *(FreeWrench(site) for site in sites)]
    return estimate(real_tree(task.model), q, v, a, sensors, covariances=UNTOUCHED)


def swept(preset: TwoStepCovariances, hand_force: float) -> TwoStepCovariances:
    """Returns the covariances with another one for the hands' forces."""
    return replace(preset, hand_force=hand_force)


def mass_kg(found: Estimate, sites: Sequence[str]) -> np.ndarray:
    """Returns the paper's object mass: norm of the hands' forces together over g, ``T`` kg."""
    return np.linalg.norm(hand_forces(found, sites).sum(axis=0), axis=1) / G


def hand_forces(found: Estimate, sites: Sequence[str]) -> np.ndarray:
    """Returns the forces on the hands in world axes, ``hands x T x 3`` N."""
    return hand_wrenches(found, sites)[..., :3]


def hand_wrenches(found: Estimate, sites: Sequence[str]) -> np.ndarray:
    """Returns the wrenches on the hands in world axes at the hands, ``hands x T x 6``."""
    out = []
    for site in sites:
        link = found.link(site)
        wrench = found.external_wrench[:, link].reshape(-1, 2, 3)
        turned = np.einsum("tij,tkj->tki", found.link_rotation[:, link], wrench)
        out.append(turned.reshape(-1, 6))
    return np.array(out)
