"""Where a person stands: feet side by side on the floor, the pelvis above them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from human.rotations import xyz_to_matrix
from human.simulate.legs import Leg

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Stance:
    """A place to stand.

    Attributes:
        x: of the point between the ankles, world [m].
        y: of the point between the ankles, world [m].
        heading: where the person looks, about world z from x [rad].
    """

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0

    @property
    def rotation(self) -> Array:
        """Axes of who stands here, in world axes, ``3 x 3``."""
        return xyz_to_matrix(np.array([0.0, 0.0, self.heading]))

    @property
    def origin(self) -> Array:
        """The point between the ankles, on the floor, ``3`` [m]."""
        return np.array([self.x, self.y, 0.0])

    def ankle(self, leg: Leg) -> Array:
        """Returns where the ankle of a leg is, ``3`` [m], world, the foot below the hip."""
        return np.asarray(self.origin + self.rotation @ np.array([0.0, leg.hip[1], leg.sole]))

    def pelvis(self, legs: tuple[Leg, Leg]) -> Array:
        """Returns where the pelvis is when standing upright, ``3`` [m], world."""
        return np.asarray(self.origin + np.array([0.0, 0.0, standing_height(legs)]))


def standing_height(legs: tuple[Leg, Leg]) -> float:
    """Returns the height of the pelvis frame above the floor of who stands upright [m].

    The knees stay bent by some nine degrees, so that the pelvis can move.
    """
    return float(min(leg.sole + 0.997 * leg.reach - leg.hip[2] for leg in legs))


def sole_center(leg: Leg, ankle: Array, rotation: Array) -> Array:
    """Returns the middle of a flat foot's sole, ``... x 2`` [m], world, from its ankle pose."""
    ahead = np.array([0.5 * (leg.heel + leg.toe), 0.0, 0.0])
    return np.asarray((ankle + rotation @ ahead)[..., :2])
