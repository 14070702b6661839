"""Makes body mass and force sensors agree, from a stretch in which the person stands unloaded.

A kilogram too little in the model is a kilogram of phantom payload in the hands.
"""

from dataclasses import dataclass, replace

import numpy as np

from estimation.errors import MeasurementError, TreeError
from estimation.estimate_record import Estimate
from estimation.spatial import GRAVITY_MS2, Array, times
from estimation.tree import EstimationTree

#: Standing still: the residual may vary so much from frame to frame, N.
STILL_N = 30.0


@dataclass(frozen=True, slots=True)
class StanceCalibration:
    """What an unloaded stance says of the body's mass.

    Attributes:
        mass_kg: the mass with which the feet's forces balance.
        error_kg: how much that is above the model's.
        sd_kg: standard deviation of the mean, from how the frames vary.
        sideways_n: ``(2,)`` N, mean horizontal force that nothing explains, world x and y: offsets
            of the sensors.
        frames: how many there were.
    """

    mass_kg: float
    error_kg: float
    sd_kg: float
    sideways_n: Array
    frames: int


def calibrate_stance(estimate: Estimate) -> StanceCalibration:
    """Finds the body mass that the force sensors ask for.

    Args:
        estimate: ``deterministic``, of a person who stands and bears nothing but their feet.

    Raises:
        MeasurementError: another method, or the person does not stand still.

    Derived here: standing, what the base's equation leaves over is the weight that the model has
    and the plates do not feel.
    """
    if estimate.method != "deterministic":
        raise MeasurementError(f"stance: expected method 'deterministic', got {estimate.method!r}")
    world = times(estimate.link_rotation[:, 0], estimate.residual[:, :3])
    varies = float(np.max(np.std(world, axis=0)))
    if varies > STILL_N:
        raise MeasurementError(
            "stance: "
            f"expected a person standing still, got a residual that varies by {varies:.0f} N; "
            "choose another stretch",
        )
    error = -world[:, 2] / GRAVITY_MS2
    return StanceCalibration(
        mass_kg=estimate.tree.mass_kg + float(np.mean(error)),
        error_kg=float(np.mean(error)),
        sd_kg=float(np.std(error) / np.sqrt(len(error))),
        sideways_n=np.mean(world[:, :2], axis=0),
        frames=len(error),
    )


def with_mass(tree: EstimationTree, mass_kg: float) -> EstimationTree:
    """Returns the tree with every link's mass and inertia scaled to a body mass in kg.

    Raises:
        TreeError: the mass is not positive.
    """
    if not (np.isfinite(mass_kg) and mass_kg > 0.0):
        raise TreeError(f"body mass: expected more than zero kg, got {mass_kg}")
    return replace(tree, inertias=tree.inertias * (mass_kg / tree.mass_kg))
