"""Solids of homogeneous density that stand for body segments: box, cylinder, sphere.

Source: Latella et al. 2019, section 2.3 (links as parallelepiped, cylinder and sphere); the moments
of inertia are the textbook ones.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangular block: full edge lengths along x, y, z in metres, centred at ``center``."""

    size: Vector
    center: Vector

    def volume(self) -> float:
        """Returns the volume in cubic metres."""
        return float(np.prod(self.size))

    def inertia(self, mass: float) -> Array:
        """Returns the ``(3, 3)`` inertia about the centre for a mass in kg, in kg m^2."""
        x, y, z = (edge * edge for edge in self.size)
        return np.diag([y + z, x + z, x + y]) * (mass / 12.0)


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A round cylinder along one segment axis (0 x, 1 y, 2 z), centred at ``center``; metres."""

    radius: float
    length: float
    axis: int
    center: Vector

    def volume(self) -> float:
        """Returns the volume in cubic metres."""
        return float(np.pi * self.radius**2 * self.length)

    def inertia(self, mass: float) -> Array:
        """Returns the ``(3, 3)`` inertia about the centre for a mass in kg, in kg m^2."""
        across = mass * (3.0 * self.radius**2 + self.length**2) / 12.0
        moments = np.full(3, across)
        moments[self.axis] = mass * self.radius**2 / 2.0
        return np.diag(moments)


@dataclass(frozen=True, slots=True)
class Sphere:
    """A ball of the given radius, centred at ``center``; metres."""

    radius: float
    center: Vector
    axis: ClassVar[int] = 2

    def volume(self) -> float:
        """Returns the volume in cubic metres."""
        return float(4.0 / 3.0 * np.pi * self.radius**3)

    def inertia(self, mass: float) -> Array:
        """Returns the ``(3, 3)`` inertia about the centre for a mass in kg, in kg m^2."""
        return np.eye(3) * (0.4 * mass * self.radius**2)


Shape = Box | Cylinder | Sphere
