"""Legs that stand where they are told: angles from the pelvis to a foot, in closed form.

Closed form keeps a planted foot still to rounding while the pelvis moves over it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from human.model import HumanModel
from human.rotations import matrix_to_xyz, xyz_to_matrix
from human.shapes import Box
from human.simulate.errors import SimulationError
from human.simulate.paths import PoseSamples

Array = NDArray[np.float64]

#: Share of the stretched leg that is used; a straight knee has no closed-form rate.
USABLE_LEG = 0.9995


@dataclass(frozen=True, slots=True)
class Leg:
    """One leg's lengths and where its angles stand among the model's.

    Attributes:
        side: ``Right`` or ``Left``.
        hip: hip joint from the pelvis, ``3`` [m], pelvis axes.
        thigh: knee from the hip, ``3`` [m], thigh axes.
        shank: ankle from the knee, ``3`` [m], shank axes.
        sole: height of the ankle over the sole [m].
        heel: rear end of the sole, forward of the ankle [m] (negative).
        toe: front end of the sole, forward of the ankle [m].
        half_width: half the width of the sole [m].
        dof: indices of hip, knee and ankle angles among the model's degrees of freedom, ``9``.
    """

    side: str
    hip: Array
    thigh: Array
    shank: Array
    sole: float
    heel: float
    toe: float
    half_width: float
    dof: NDArray[np.intp]

    @property
    def reach(self) -> float:
        """Longest distance from hip to ankle that is used [m]."""
        return USABLE_LEG * float(np.linalg.norm(self.thigh) + np.linalg.norm(self.shank))

    def angles(self, pelvis: PoseSamples, ankle: PoseSamples) -> Array:
        """Returns hip, knee and ankle angles that put the foot at a pose.

        Args:
            pelvis: pelvis poses, world axes, ``T``.
            ankle: foot poses (origin at the ankle), world axes, ``T``.

        Returns:
            ``T x 9`` [rad], x, y, z of hip, knee and ankle; the knee bends about y alone, and the
            thigh turns about its length as far as the foot is turned against the pelvis.

        Raises:
            SimulationError: the foot is further from the hip than the leg is long.

        Derived here: the knee from the triangle hip-knee-ankle; the hip from ``Rx(a) Ry(b) w = d``
        with ``w`` the leg turned about z; the ankle is what is left.
        """
        seen = ankle.seen_from(pelvis)
        d = seen.position - self.hip
        distance = np.linalg.norm(d, axis=-1)
        if np.any(distance > self.reach):
            i = int(np.argmax(distance))
            raise SimulationError(
                f"{self.side} foot: sample {i} is {distance[i]:.3f} m from the hip, the leg "
                f"reaches {self.reach:.3f} m; lower the pelvis or shorten the step"
            )
        k, s = self.thigh, self.shank
        along = k[0] * s[0] + k[2] * s[2]
        across = k[0] * s[2] - k[2] * s[0]
        wanted = 0.5 * (distance**2 - k @ k - s @ s) - k[1] * s[1]
        knee = np.arctan2(across, along) + np.arccos(
            np.clip(wanted / np.hypot(along, across), -1.0, 1.0)
        )
        zero = np.zeros_like(knee)
        K = xyz_to_matrix(np.stack((zero, knee, zero), axis=-1))
        turn = np.arctan2(seen.rotation[:, 1, 0], seen.rotation[:, 0, 0])
        leg = k + K @ s
        cos, sin = np.cos(turn), np.sin(turn)
        wx, wy = cos * leg[:, 0] - sin * leg[:, 1], sin * leg[:, 0] + cos * leg[:, 1]
        wz = leg[:, 2]
        # Of the two b with Ry(b) w at the x of d, the one that leaves the leg pointing down.
        b = np.arctan2(wz, wx) + np.arccos(np.clip(d[:, 0] / np.hypot(wx, wz), -1.0, 1.0))
        down = -wx * np.sin(b) + wz * np.cos(b)
        a = np.arctan2(d[:, 2], d[:, 1]) - np.arctan2(down, wy)
        a = np.arctan2(np.sin(a), np.cos(a))
        hip = np.stack((a, b, turn), axis=-1)
        held = xyz_to_matrix(hip) @ K
        foot = matrix_to_xyz(np.swapaxes(held, -1, -2) @ seen.rotation)
        return np.concatenate((hip, zero[:, None], knee[:, None], zero[:, None], foot), axis=-1)


def legs_of(model: HumanModel) -> tuple[Leg, Leg]:
    """Returns the right and the left leg of a model.

    Raises:
        SimulationError: the model lacks a leg, or a leg joint has not three degrees of freedom.
    """
    return _leg(model, "Right"), _leg(model, "Left")


def _leg(model: HumanModel, side: str) -> Leg:
    names = [f"j{side}{part}" for part in ("Hip", "Knee", "Ankle")]
    offset = dict(zip(model.joint_names, model.offsets, strict=True))
    try:
        dof = np.array(
            [model.dof_names.index(f"{name}_rot{axis}") for name in names for axis in "xyz"],
            dtype=np.intp,
        )
        hip, thigh, shank = (offset[name] for name in names)
        ball = offset[f"j{side}BallFoot"]
    except (KeyError, ValueError) as error:
        raise SimulationError(
            f"model {model.name!r} has no full {side} leg ({error}); "
            "use one of 66 degrees of freedom"
        ) from error
    foot, toe = model.shapes.get(f"{side}Foot"), model.shapes.get(f"{side}Toe")
    if isinstance(foot, Box) and isinstance(toe, Box):
        return Leg(
            side,
            hip,
            thigh,
            shank,
            sole=0.5 * foot.size[2] - foot.center[2],
            heel=foot.center[0] - 0.5 * foot.size[0],
            toe=float(ball[0]) + toe.center[0] + 0.5 * toe.size[0],
            half_width=0.5 * foot.size[1],
            dof=dof,
        )
    # Without solids the sole is taken flat, a finger below the ball of the foot.
    length = float(ball[0])
    return Leg(
        side, hip, thigh, shank, 0.01 - float(ball[2]), -0.35 * length, 1.5 * length, 0.04, dof
    )
