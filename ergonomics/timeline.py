"""Sums over time that weigh each frame by the time it stands for.

A dropped frame must not make a bad posture shorter, so nothing here counts frames: every value
is weighed by half the time to its neighbours (the trapezoidal rule). One frame alone stands for
itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import PostureError

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TimeSummary:
    """A quantity or an ordinal score over time.

    Attributes:
        mean: Mean by time; of an ordinal score, read it beside the shares and never alone.
        median: By time.
        p90: 90th percentile by time.
        max: Greatest value.
        time_of_max_s: When it is first reached.
        time_at_or_above: Share of the time at each level or above it, 0 to 1.
        longest_at_or_above_s: Longest stretch at each level or above it, seconds.
    """

    mean: float
    median: float
    p90: float
    max: float
    time_of_max_s: float
    time_at_or_above: Mapping[float, float]
    longest_at_or_above_s: Mapping[float, float]


def time_weights(time_s: ArrayLike) -> Floats:
    """Returns the share of the whole duration that each frame stands for, ``(frames,)``.

    Args:
        time_s: ``(frames,)`` seconds.

    Raises:
        PostureError: If times are not finite and strictly increasing.
    """
    time = np.asarray(time_s, dtype=np.float64)
    if time.ndim != 1 or not len(time):
        raise PostureError("time_s", f"expected (frames,) with a frame or more, got {time.shape}")
    if not np.isfinite(time).all():
        raise PostureError("time_s", "expected finite seconds")
    step = np.diff(time)
    if not (step > 0.0).all():
        index = int(np.argmin(step > 0.0)) + 1
        raise PostureError("time_s", "expected strictly increasing seconds", (index,))
    if len(time) == 1:
        return np.ones(1)
    half = np.zeros(len(time))
    half[:-1] += step
    half[1:] += step
    weights: Floats = half / half.sum()
    return weights


def time_mean(values: ArrayLike, time_s: ArrayLike) -> Floats:
    """Returns the mean over time of ``(..., frames)`` values: ``(...)``."""
    array, weights = _fitting(values, time_s)
    mean: Floats = array @ weights
    return mean


def dose(values: ArrayLike, time_s: ArrayLike) -> Floats:
    """Returns the integral over time of ``(..., frames)`` values: ``(...)`` unit seconds."""
    time = np.asarray(time_s, dtype=np.float64)
    total: Floats = time_mean(values, time_s) * (time[-1] - time[0])
    return total


def time_share(condition: ArrayLike, time_s: ArrayLike) -> Floats:
    """Returns the share of the time in which a condition ``(..., frames)`` holds: ``(...)``."""
    return time_mean(np.asarray(condition, dtype=np.float64), time_s)


def time_quantile(values: ArrayLike, time_s: ArrayLike, probability: float) -> Floats:
    """Returns the value not exceeded during this share of the time.

    Args:
        values: ``(..., frames)``.
        time_s: ``(frames,)`` seconds.
        probability: Inside 0 and 1.
    """
    array, weights = _fitting(values, time_s)
    if not 0.0 < probability < 1.0:
        raise PostureError("probability", f"expected between 0 and 1, got {probability}")
    order = np.argsort(array, axis=-1, kind="stable")
    reached = np.cumsum(weights[order], axis=-1) >= probability - 1e-12
    first = np.take_along_axis(order, reached.argmax(axis=-1, keepdims=True), axis=-1)
    quantile: Floats = np.take_along_axis(array, first, axis=-1)[..., 0]
    return quantile


def summarise(
    values: ArrayLike, time_s: ArrayLike, levels: Sequence[float] = (3, 5, 7)
) -> TimeSummary:
    """Sums one quantity up over time.

    Args:
        values: ``(frames,)`` a score or an angle.
        time_s: ``(frames,)`` seconds.
        levels: For the shares and the longest stretches.

    Raises:
        PostureError: If the two do not fit together.
    """
    array, weights = _fitting(values, time_s)
    if array.ndim != 1:
        raise PostureError("values", f"expected (frames,), got {array.shape}")
    time = np.asarray(time_s, dtype=np.float64)
    worst = int(array.argmax())
    return TimeSummary(
        mean=float(array @ weights),
        median=float(time_quantile(array, time_s, 0.5)),
        p90=float(time_quantile(array, time_s, 0.9)),
        max=float(array[worst]),
        time_of_max_s=float(time[worst]),
        time_at_or_above={level: float(weights[array >= level].sum()) for level in levels},
        longest_at_or_above_s={level: _longest(array >= level, time) for level in levels},
    )


def _longest(holds: NDArray[np.bool_], time: Floats) -> float:
    """Longest run of frames, from its first frame to its last."""
    padded = np.concatenate([[False], holds, [False]]).astype(np.int8)
    starts, ends = np.flatnonzero(np.diff(padded) == 1), np.flatnonzero(np.diff(padded) == -1)
    if not len(starts):
        return 0.0
    return float((time[ends - 1] - time[starts]).max())


def _fitting(values: ArrayLike, time_s: ArrayLike) -> tuple[Floats, Floats]:
    weights = time_weights(time_s)
    array = np.asarray(values, dtype=np.float64)
    if array.ndim < 1 or array.shape[-1] != len(weights):
        raise PostureError("values", f"expected (..., {len(weights)}) frames, got {array.shape}")
    if not np.isfinite(array).all():
        bad = tuple(map(int, np.argwhere(~np.isfinite(array))[0]))
        raise PostureError("values", "expected a finite value", bad)
    return array, weights
