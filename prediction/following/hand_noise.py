"""The robot's repeatability: how far from the path the hand may be led."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prediction.errors import TrajectoryError

Array = NDArray[np.float64]

#: Time over which the robot's own error is coherent, s.
COHERENT_S = 0.5


@dataclass(frozen=True, slots=True)
class HandNoise:
    """The robot's repeatability: standard deviations of where it leads the hand.

    Attributes:
        position_m: Per axis, m.
        orientation_rad: About each axis, rad.
    """

    position_m: float = 0.0
    orientation_rad: float = 0.0

    def __post_init__(self) -> None:
        """Refuses what is no deviation."""
        for name in ("position_m", "orientation_rad"):
            value = getattr(self, name)
            if not 0.0 <= value < np.inf:
                raise TrajectoryError(f"the robot's {name} is {value}, expected 0 or more, finite")

    @property
    def deviation(self) -> Array:
        """The six standard deviations, m and rad."""
        return np.array([self.position_m] * 3 + [self.orientation_rad] * 3)
