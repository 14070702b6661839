"""What another program found: net joint moments over time, in house axes."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Joints of the model that are compared.
LEGS = ("jRightAnkle", "jRightKnee", "jRightHip", "jLeftAnkle", "jLeftKnee", "jLeftHip")
LOW_BACK = "jL5S1"


@dataclass(frozen=True, slots=True)
class Reference:
    """Moments of another program.

    Attributes:
        program: its name.
        trial: name of the recording.
        mass_kg: of the person there; moments are compared per kilogram of it.
        time_s: ``(frames,)``.
        moment: ``(frames, 3)`` by joint, parent on child, N m, world axes.
        axis: ``(frames, 3)`` by joint, unit vector that moments are projected on, world axes:
            from the right hip to the left one.
        valid: ``(frames,)`` by joint, where the reference can be believed: its own residual force
            is below a tenth of body weight, or the foot stands on a plate.
        notes: checks of the reference itself.
    """

    program: str
    trial: str
    mass_kg: float
    time_s: Array
    moment: Mapping[str, Array]
    axis: Mapping[str, Array]
    valid: Mapping[str, Mask]
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Estimated:
    """Moments of ours.

    Attributes:
        driver: how they came about.
        time_s: ``(frames,)``.
        moment: ``(frames, 3)`` by joint, parent on child, N m, world axes.
        known: ``(frames,)`` by joint, where the estimate claims to know.
        notes: what it said about itself.
    """

    driver: str
    time_s: Array
    moment: Mapping[str, Array]
    known: Mapping[str, Mask]
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Banded:
    """Our torque about one axis of a joint, with its standard deviation.

    Attributes:
        axis: ``(frames, 3)`` unit, world axes.
        torque: ``(frames,)`` N m.
        sd: ``(frames,)`` N m.
    """

    axis: Array
    torque: Array
    sd: Array
