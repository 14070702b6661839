"""Floating and fixed base by one elimination, with the 2019 paper's covariances or the noise's."""

from dataclasses import replace

import numpy as np

from benchmarks.estimation.papers.measuring import Measured, as_in_the_paper
from benchmarks.estimation.papers.scenes import Scenes
from estimation import (
    Accelerometer,
    AngularAcceleration,
    Estimate,
    ForceTorque,
    Measurement,
    ModelCovariances,
    TwoStepCovariances,
    estimate,
    hinge_tree,
    real_tree,
    with_mass,
)
from human import forward_kinematics

#: The paper says "from 1e-6 to 1e-4" for the sensors, "low" for the model and "high" for the prior.
#: Of that range these lead to errors nearest to those of its Table 2.
PRESET_2019 = TwoStepCovariances(
    "2019",
    first_step=False,
    feet=1e-4,
    untouched=1e-4,
    accelerometer=1e-6,
    joint_acceleration=1e-6,
    model=1e-6,
)
#: Newton holds for a simulated person, and nothing touches the other links; bands should say so.
UNTOUCHED = ModelCovariances(
    dynamics=1e-8, kinematics=1e-8, untouched_force_sd=1e-4, untouched_moment_sd=1e-4
)
#: How many times too heavy a body is believed to be, to see what a wrong model does.
HEAVIER = 1.03
#: A base that is fixed: its acceleration is known, and nothing is known of what the ground does.
KNOWN, UNKNOWN = 1e-10, 1e8


def floating(scenes: Scenes, task: Measured, believed: str) -> Estimate:
    """Estimates a task with the pelvis as base.

    Args:
        scenes: keeps the estimate for other figures.
        task: the readings.
        believed: ``paper`` for its 67 links and covariances, ``heavier`` for the same with a body
            that is believed to be heavier than it is, ``noise`` for real links and the sensors'
            noise.
    """
    return scenes.estimate_once(
        task.name,
        f"floating {believed}",
        lambda: _solved(task, believed, _believed(task, believed)),
    )


def fixed(scenes: Scenes, task: Measured, believed: str, foot: str) -> Estimate:
    """Estimates a task with a foot as base, as the papers' earlier work did.

    The foot's acceleration is known to be gravity's alone, and its force is not measured: Newton
    and Euler of the base are no equations of a fixed-base problem. Where the tree is rooted changes
    nothing else, so the tree stays as it is.
    """
    return scenes.estimate_once(
        task.name,
        f"fixed {believed}",
        lambda: _solved(task, believed, _held(task, _believed(task, believed), foot)),
    )


def _believed(task: Measured, believed: str) -> list[Measurement]:
    return [*task.sensors] if believed == "noise" else as_in_the_paper(task.sensors, PRESET_2019)


def _solved(task: Measured, believed: str, sensors: list[Measurement]) -> Estimate:
    q, v, a = task.state()
    if believed == "noise":
        return estimate(real_tree(task.model), q, v, a, sensors, covariances=UNTOUCHED)
    tree = hinge_tree(task.model)
    if believed == "heavier":
        tree = with_mass(tree, HEAVIER * tree.mass_kg)
    return estimate(tree, q, v, a, sensors, covariances=PRESET_2019.covariances)


def _held(task: Measured, sensors: list[Measurement], foot: str) -> list[Measurement]:
    R, _ = forward_kinematics(task.model, task.simulated.motion.q).of(foot)
    frames = len(R)
    upward = np.broadcast_to(np.array([0.0, 0.0, 9.81]), (frames, 3))
    out: list[Measurement] = [
        Accelerometer(foot, np.einsum("tji,tj->ti", R, upward), KNOWN),
        AngularAcceleration(foot, np.zeros((frames, 3)), KNOWN),
    ]
    free = False
    for sensor in sensors:
        if isinstance(sensor, ForceTorque) and sensor.link == foot:
            if not free:
                out.append(replace(sensor, covariance=UNKNOWN))
            free = True
        else:
            out.append(sensor)
    return out
