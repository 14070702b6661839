"""Rigid poses at the service's edge: checked, then rotation matrix and position."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from human.rotations import quaternion_to_matrix

Array = NDArray[np.float64]

#: How far a quaternion's norm may be from 1, or a rotation matrix from orthonormal.
UNIT_TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class Pose:
    """``T_a_b``: maps coordinates in b to a.

    Attributes:
        rotation: ``(..., 3, 3)`` axes of b in a.
        position: ``(..., 3)`` origin of b in a, m.
    """

    rotation: Array
    position: Array

    def __matmul__(self, other: "Pose") -> "Pose":
        """Returns ``T_a_c`` of ``T_a_b`` and ``T_b_c``, broadcast over leading dimensions."""
        return Pose(
            self.rotation @ other.rotation,
            (self.rotation @ other.position[..., None])[..., 0] + self.position,
        )

    def inverse(self) -> "Pose":
        """Returns ``T_b_a``."""
        back = np.swapaxes(self.rotation, -1, -2)
        return Pose(back, -(back @ self.position[..., None])[..., 0])

    def __getitem__(self, index: int | slice) -> "Pose":
        """Returns the poses at ``index`` of the first dimension."""
        return Pose(self.rotation[index], self.position[index])


IDENTITY = Pose(np.eye(3), np.zeros(3))


def rotation_of_quaternion(xyzw: ArrayLike) -> Array:
    """Returns rotation matrices of quaternions that are unit to 1e-3; they are normalised.

    Args:
        xyzw: ``(..., 4)``, scalar last.

    Raises:
        ValueError: A quaternion's norm is off by more than 1e-3.
    """
    q = np.asarray(xyzw, dtype=float)
    norm = np.linalg.norm(q, axis=-1, keepdims=True)
    worst = np.abs(norm - 1.0).max(initial=0.0)
    if not worst <= UNIT_TOLERANCE:
        raise ValueError(f"a unit quaternion, xyzw (its norm is off by {worst:.4g})")
    return quaternion_to_matrix(q / norm)


def quaternion_pose(position: Sequence[float], xyzw: Sequence[float]) -> Pose:
    """Returns the pose of a position and a quaternion.

    Raises:
        ValueError: The quaternion is not unit.
    """
    return Pose(rotation_of_quaternion(xyzw), np.asarray(position, dtype=float))


def matrix_pose(matrix: ArrayLike) -> Pose:
    """Returns the pose of a homogeneous matrix, its rotation made exactly orthonormal.

    Raises:
        ValueError: It is no rigid transform, to 1e-3.
    """
    m = np.asarray(matrix, dtype=float)
    if np.abs(m[3] - [0, 0, 0, 1]).max() > UNIT_TOLERANCE:
        raise ValueError("a rigid transform with last row 0 0 0 1")
    r = m[:3, :3]
    off = np.abs(r.T @ r - np.eye(3)).max()
    if off > 2 * UNIT_TOLERANCE or np.linalg.det(r) < 0:
        raise ValueError(f"a right-handed rotation in the upper left (R'R - I is {off:.3g})")
    u, _, vt = np.linalg.svd(r)
    return Pose(u @ vt, m[:3, 3].copy())


def rotation_angle(a: Array, b: Array) -> Array:
    """Returns the angle between rotations, rad, accurate also where it is small.

    Args:
        a: ``(..., 3, 3)``.
        b: ``(..., 3, 3)``.
    """
    # |A - B| (Frobenius) = 2 sqrt(2) sin(angle / 2); no loss near 0, unlike arccos of the trace.
    chord = np.linalg.norm(a - b, axis=(-2, -1)) / (2 * np.sqrt(2))
    return np.asarray(2 * np.arcsin(np.clip(chord, 0.0, 1.0)))
