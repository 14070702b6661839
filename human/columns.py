"""The steps of batched kinematics, in place: shift by an offset, turn about an axis.

Rotations are stored as ``(column, row, batch)``: turning about a segment's own axis mixes two
columns and leaves the third where it is.
"""

import numpy as np

from human.model import Array


def cosine_sine(angles: Array) -> tuple[Array, Array]:
    """Returns cosine and sine, rad; by the half angle's tangent, which numpy computes far faster.

    Derived here: with ``t = tan(x / 2)``, ``cos x = (1 - t^2) / (1 + t^2)`` and ``sin x = 2 t / (1
    + t^2)``, within a few roundings of the exact values for every angle, and their squares sum to
    one whatever error ``t`` has, so that rotations stay rotations.
    """
    half = np.tan(0.5 * np.ascontiguousarray(angles))
    square = half * half
    scale = 1.0 / (1.0 + square)
    return (1.0 - square) * scale, 2.0 * half * scale


def shift_along(columns: Array, origin: Array, offset: Array, out: Array, scratch: Array) -> None:
    """Writes ``origin + R @ offset`` to ``out`` ``(3, batch)``, ``columns`` ``(3, 3, batch)``."""
    out[...] = origin
    # As Python numbers, which leave arrays of half the size in their own precision.
    for column, length in zip(columns, offset.tolist(), strict=True):
        if length != 0.0:
            np.multiply(column, length, out=scratch)
            out += scratch


def turn(columns: Array, axis: int, cosine: Array, sine: Array, scratch: Array) -> None:
    """Turns a segment about its own axis in place: ``R <- R R_axis(angle)``.

    Args:
        columns: ``(3, 3, batch)`` [column, row].
        axis: 0, 1 or 2.
        cosine: ``(batch,)``.
        sine: ``(batch,)``.
        scratch: ``(3, 3, batch)`` work space.
    """
    first, second = columns[(axis + 1) % 3], columns[(axis + 2) % 3]
    np.multiply(first, sine, out=scratch[0])
    np.multiply(second, sine, out=scratch[1])
    first *= cosine
    first += scratch[1]
    second *= cosine
    second -= scratch[0]
