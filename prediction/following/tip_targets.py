"""Where the tips of a chain must be, and how far they are off."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prediction.following.hand_path import orientation_error

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TipTargets:
    """Where all tips must be: the held ones where they start, the led ones along the paths.

    Attributes:
        position: ``(C, T, p)`` m.
        rotation: ``(C, T, t, 3, 3)`` of the tips whose orientation is the task's.
        held: How many tips are held.
    """

    position: Array
    rotation: Array
    held: int

    def at(self, index: int) -> "TipTargets":
        """Returns the targets at one point, as ``(C, p)`` and ``(C, t, 3, 3)``."""
        return TipTargets(self.position[:, index], self.rotation[:, index], self.held)

    def moved(self, offset: Array) -> "TipTargets":
        """Returns the led tips' targets, ``(..., p)``, moved by the robot's error ``(..., 6)``.

        One robot leads them, so several are moved as one body, turning about their middle.
        """
        # A planar arm has two coordinates and one tip.
        size = min(3, self.position.shape[-1])
        position = self.position.reshape(*self.position.shape[:-1], -1, size)
        turn = small_rotation(offset[..., 3:])[..., None, :, :]
        led = position[..., self.held :, :]
        if led.shape[-2] > 1:
            middle = led.mean(axis=-2, keepdims=True)
            led = middle + (turn @ (led - middle)[..., None])[..., 0]
        led = led + offset[..., None, :size]
        rotation = self.rotation
        if rotation.shape[-3] > self.held:
            kept = rotation[..., : self.held, :, :]
            rotation = np.concatenate([kept, turn @ rotation[..., self.held :, :, :]], axis=-3)
        position = np.concatenate([position[..., : self.held, :], led], axis=-2)
        return TipTargets(position.reshape(self.position.shape), rotation, self.held)


def with_turn(error: Array, target: Array, rotation: Array) -> Array:
    """Adds what orientations ``(B, t, 3, 3)`` lack to position errors, as ``(B, p + 3 t)``."""
    if target.shape[1] == 0:
        return error
    turn = orientation_error(target, rotation)
    return np.concatenate([error, turn.reshape(len(error), -1)], axis=1)


def furthest(error: Array) -> Array:
    """Returns the length of the longest of the tips' errors, ``(B,)``."""
    if error.shape[1] == 0:
        return np.zeros(len(error))
    tips = error.reshape(len(error), -1, min(3, error.shape[1]))
    return np.asarray(np.linalg.norm(tips, axis=2).max(axis=1))


def small_rotation(vector: Array) -> Array:
    """Rotation matrices of small rotation vectors, by the Cayley map: exactly orthonormal."""
    x, y, z = np.moveaxis(0.5 * vector, -1, 0)
    zero = np.zeros_like(x)
    skew = np.stack(
        [np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2
    )
    return np.asarray(np.linalg.solve(np.eye(3) - skew, np.eye(3) + skew))
