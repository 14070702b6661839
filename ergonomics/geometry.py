"""Angles between body axes over many frames, written on components so that numpy streams them.

Arrays here are component-first: a vector is ``(3, n)``, a rotation ``(3, 3, n)``.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def relative(parent: Floats, child: Floats) -> Floats:
    """Returns ``parent^T child``: the child's axes in the parent's coordinates.

    Args:
        parent: ``(3, 3, n)``.
        child: ``(3, 3, n)``.
    """
    # Three multiply-adds of whole (3, 3, n) blocks; einsum takes a slower path at this shape.
    product: Floats = parent[0][:, None] * child[0][None]
    product += parent[1][:, None] * child[1][None]
    product += parent[2][:, None] * child[2][None]
    return product


def in_frame(frame: Floats, vector: Floats) -> Floats:
    """Returns a world vector ``(3, n)`` in the coordinates of a frame ``(3, 3, n)``."""
    seen: Floats = frame[0] * vector[0] + frame[1] * vector[1] + frame[2] * vector[2]
    return seen


def twist(rotation: Floats, axis: int) -> Floats:
    """Returns the twist of a rotation about one axis, swing taken off first, radians in (-pi, pi].

    The twist of the unit quaternion (w, v) about axis k is 2 atan2(v_k, w). Multiplying both by
    4 w gives entries of the matrix, with no square root and no branch. Undefined only where the
    swing alone is half a turn; zero is returned there.

    Args:
        rotation: ``(3, 3, n)``.
        axis: 0, 1 or 2.

    Derived here: swing-twist decomposition R = Swing Twist, swing axis perpendicular to k.
    """
    i, j = (axis + 1) % 3, (axis + 2) % 3
    twice_sine = rotation[j, i] - rotation[i, j]
    twice_cosine = 1.0 + rotation[0, 0] + rotation[1, 1] + rotation[2, 2]
    angle: Floats = 2.0 * np.arctan2(twice_sine, twice_cosine)
    return angle


def angle_between(a: Floats, b: Floats) -> Floats:
    """Returns the angle between two vectors ``(3, n)``, radians in [0, pi].

    By arctan2 of sine and cosine: accurate near 0 and pi, where the arc cosine is not.
    """
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    angle: Floats = np.arctan2(
        np.sqrt(x * x + y * y + z * z), a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    )
    return angle


def length(vector: Floats) -> Floats:
    """Returns the length of vectors ``(3, n)``."""
    norm: Floats = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    return norm


def arcsine(sine: Floats) -> Floats:
    """Returns the arc sine; rounding may have carried the sine past one."""
    angle: Floats = np.arcsin(np.clip(sine, -1.0, 1.0))
    return angle


def heading_axes(pelvis: Floats) -> tuple[Floats, Floats]:
    """Returns the horizontal forward direction of a pelvis, as two world components.

    The pelvis' left axis gives it: a forward bend, however deep, leaves that axis level. Lying
    on the side it stands upright instead, and then the forward axis is level and is used.

    Args:
        pelvis: ``(3, 3, n)``, axes x forward, y left, z up.
    """
    x, y = pelvis[1, 1], -pelvis[0, 1]
    upright = np.hypot(x, y) < 0.1
    if upright.any():
        x = np.where(upright, pelvis[0, 0], x)
        y = np.where(upright, pelvis[1, 0], y)
    norm = np.hypot(x, y)
    return x / norm, y / norm
