"""Bony points over time, as the markers of a recording show them; NaN where one is not seen.

Inside the measuring of a person only: nothing here leaves `human.markers` with a NaN in it.
"""

from collections.abc import Iterable

import numpy as np

from human.marker_recording import MarkerRecording
from human.markers.recognise import RecognisedMarkers
from human.model import Array, IntArray
from human.rotations import (
    matrix_to_rotation_vector,
    rotation_vector_to_matrix,
)

SIDES = ("Right", "Left")
#: Direction of each side along the body's y axis.
OUTWARD = {"Right": -1.0, "Left": 1.0}
#: Shortest vector (m) whose direction means anything.
_LEAST_M = 1e-4


class Landmarks:
    """The bony points of some frames of a recording."""

    def __init__(
        self, recording: MarkerRecording, matched: RecognisedMarkers, frames: IntArray
    ) -> None:
        """Picks the frames.

        Args:
            recording: the markers.
            matched: which of them show what.
            frames: ``(n,)`` indices.
        """
        self.count = len(frames)
        self._points: dict[str, Array] = {}
        for column, name in enumerate(recording.marker_names):
            place = matched.place_of.get(name)
            if place is not None and place.role is not None:
                seen = recording.valid[frames, column]
                points = np.where(seen[:, None], recording.position[frames, column], np.nan)
                if np.any(seen):
                    self._points[place.role] = points

    def has(self, *roles: str) -> bool:
        """Tells whether all of these points are seen together in some frame."""
        seen = np.ones(self.count, dtype=np.bool_)
        for role in roles:
            seen &= np.isfinite(self.of(role)[:, 0])
        return bool(np.any(seen))

    def of(self, role: str) -> Array:
        """Returns ``(n, 3)`` world, m; NaN where the point is not seen, or not in the set."""
        points = self._points.get(role)
        return np.full((self.count, 3), np.nan) if points is None else points

    def middle(self, *roles: str) -> Array:
        """Returns the mean of several points, NaN where one of them is not seen."""
        return np.asarray(np.mean([self.of(role) for role in roles], axis=0))

    def first(self, *choices: str | tuple[str, ...]) -> tuple[Array, str | tuple[str, ...] | None]:
        """Returns the first choice that is ever seen, and which; a tuple stands for its middle."""
        for choice in choices:
            roles = (choice,) if isinstance(choice, str) else choice
            if self.has(*roles):
                return self.middle(*roles), choice
        return np.full((self.count, 3), np.nan), None


def frames_with(recording: MarkerRecording, names: Iterable[str], most: int) -> IntArray:
    """Returns at most ``most`` frames, spread evenly, in which all the named markers are seen."""
    columns = [recording.marker_names.index(name) for name in names]
    seen = np.flatnonzero(np.all(recording.valid[:, columns], axis=1))
    if len(seen) <= most:
        return seen
    return seen[np.linspace(0, len(seen) - 1, most).round().astype(np.intp)]


def unit(vector: Array) -> Array:
    """Returns directions of ``(..., 3)``; NaN where a vector is too short to have one."""
    norm = np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.where(norm > _LEAST_M, vector, np.nan) / np.where(norm > _LEAST_M, norm, 1.0)


def axes_along(main: Array, axis: int, hint: Array, hint_axis: int) -> Array:
    """Returns axes of which one points along a vector and another as near a second as it can.

    Args:
        main: ``(n, 3)`` direction of ``axis``.
        axis: 0, 1 or 2.
        hint: ``(n, 3)`` what ``hint_axis`` shall point along but for its part along ``main``.
        hint_axis: another of 0, 1, 2.

    Returns:
        ``(n, 3, 3)`` right-handed, columns the axes in world; NaN where the two are parallel.
    """
    first = unit(main)
    second = unit(hint - np.sum(hint * first, axis=-1, keepdims=True) * first)
    third = 3 - axis - hint_axis
    out = np.empty((*first.shape, 3))
    out[..., axis], out[..., hint_axis] = first, second
    cyclic = (hint_axis - axis) % 3 == 1
    out[..., third] = np.cross(first, second) if cyclic else np.cross(second, first)
    return out


def in_axes(axes: Array, vector: Array) -> Array:
    """Returns world vectors ``(n, 3)`` in the axes ``(n, 3, 3)``."""
    return np.asarray((np.swapaxes(axes, -1, -2) @ vector[..., None])[..., 0])


def from_axes(axes: Array, vector: Array) -> Array:
    """Returns a vector ``(3,)`` of the axes ``(n, 3, 3)`` in world, ``(n, 3)``."""
    return np.asarray(axes @ vector)


def median(values: Array) -> Array:
    """Returns the median over frames of ``(n, ...)`` without NaN; NaN where nothing is left."""
    flat = values.reshape(len(values), int(np.prod(values.shape[1:])))
    out = np.full(flat.shape[1], np.nan)
    some = np.any(np.isfinite(flat), axis=0)
    out[some] = np.nanmedian(flat[:, some], axis=0)
    return out.reshape(values.shape[1:])


def share_turn(start: Array, end: Array, part: float) -> Array:
    """Returns axes a part of the way from ``start`` to ``end`` ``(n, 3, 3)``, the shortest way."""
    ok = np.all(np.isfinite(start) & np.isfinite(end), axis=(1, 2))
    out = np.full_like(start, np.nan)
    turn = matrix_to_rotation_vector(np.swapaxes(start[ok], 1, 2) @ end[ok])
    out[ok] = start[ok] @ rotation_vector_to_matrix(part * turn)
    return out


def mean_turn(start: Array, end: Array, frames: IntArray) -> Array:
    """Returns the typical rotation ``(3, 3)`` from ``start`` to ``end`` over some frames.

    Derived here: the median over frames of each entry, brought back to a rotation by its polar
    factor; identity where no frame is left.
    """
    entries = median(np.swapaxes(start, 1, 2)[frames] @ end[frames])
    if not np.all(np.isfinite(entries)):
        return np.eye(3)
    left, _, right = np.linalg.svd(entries)
    keep = np.diag([1.0, 1.0, np.linalg.det(left @ right)])
    return np.asarray(left @ keep @ right)
