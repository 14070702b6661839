"""The time grid on which a candidate is predicted, and derivatives on it."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from app.assessments.candidates import HandPath
from app.assessments.poses import Array, Pose

#: Steps of the prediction, s. Longer steps make the hand's closed loop coarse, shorter ones cost
#: time and add nothing: the operators are trained on motions sampled in this range.
LONGEST_STEP_S = 0.08
SHORTEST_STEP_S = 0.02


@dataclass(frozen=True, slots=True)
class Grid:
    """Times of the prediction, and whether they differ from those sent.

    Attributes:
        time_s: ``(T,)`` s.
        resampled: Whether these are not the candidate's own times.
    """

    time_s: Array
    resampled: bool


def prediction_grid(time_s: Array) -> Grid:
    """Returns the times on which a trajectory sent at ``time_s`` is predicted.

    Times that are already between the shortest and the longest step are taken as they are. Else
    the same duration is divided evenly by the nearest step inside the range.
    """
    if _in_range(time_s):
        return Grid(time_s, False)
    return Grid(np.linspace(time_s[0], time_s[-1], grid_size(time_s)), True)


def grid_size(time_s: Array) -> int:
    """Returns how many times the prediction's grid has, before any of them is laid out."""
    if _in_range(time_s):
        return len(time_s)
    wanted = float(np.clip(np.median(np.diff(time_s)), SHORTEST_STEP_S, LONGEST_STEP_S))
    duration = float(time_s[-1] - time_s[0])
    return max(2, int(np.ceil(duration / wanted - 1e-9)) + 1)


def _in_range(time_s: Array) -> bool:
    step = np.diff(time_s)
    low, high = SHORTEST_STEP_S * (1 - 1e-9), LONGEST_STEP_S * (1 + 1e-9)
    return bool(step.max() <= high and step.min() >= low)


def resample(path: HandPath, grid: Grid) -> HandPath:
    """Returns the path at the grid's times: straight between points, shortest turn."""
    if not grid.resampled:
        return path
    position = np.stack(
        [np.interp(grid.time_s, path.time_s, path.pose.position[:, k]) for k in range(3)], axis=1
    )
    if path.position_only:
        rotation = np.broadcast_to(path.pose.rotation[0], (len(grid.time_s), 3, 3))
    else:
        turn = Slerp(path.time_s, Rotation.from_matrix(path.pose.rotation))
        rotation = turn(np.clip(grid.time_s, path.time_s[0], path.time_s[-1])).as_matrix()
    return HandPath(grid.time_s, Pose(rotation, position), path.position_only, path.grasp)


def cubic_operators(time_s: Array, half_width_s: float) -> tuple[Array, Array, Array]:
    """As `local_cubics`, remembered: candidates of one planner mostly share their times."""
    return _remembered(time_s.tobytes(), half_width_s)


@lru_cache(maxsize=4)
def _remembered(time_s: bytes, half_width_s: float) -> tuple[Array, Array, Array]:
    operators = local_cubics(np.frombuffer(time_s), half_width_s)
    for operator in operators:
        operator.setflags(write=False)
    return operators


def local_cubics(time_s: Array, half_width_s: float) -> tuple[Array, Array, Array]:
    """Returns matrices that smooth samples and differentiate them once and twice.

    At each instant a cubic is fitted by least squares to the samples within ``half_width_s``
    (at least five, else all there are, with the degree lowered to match).

    Args:
        time_s: ``(T,)`` strictly increasing, s.
        half_width_s: Half the window, s.

    Returns:
        ``(T, T)`` each: value, first and second derivative, to be applied from the left.

    Exact for cubics where the window is whole. Within half a window of an end the second derivative
    is that of the parabola through a whole window at that end, exact for parabolas: a cubic that
    sees one side only would multiply the roughness of a roll-out there, and with it the effort.

    Derived here: row i is row k of the pseudo-inverse of the local Vandermonde matrix, times k!.
    """
    count = len(time_s)
    operators = np.zeros((3, count, count))
    for i, now in enumerate(time_s):
        near = np.flatnonzero(np.abs(time_s - now) <= half_width_s)
        if len(near) < 5:
            first = int(np.clip(i - 2, 0, max(0, count - 5)))
            near = np.arange(first, min(count, first + 5))
        degree = min(3, len(near) - 1)
        scale = max(np.abs(time_s[near] - now).max(), 1e-12)
        vandermonde = np.vander((time_s[near] - now) / scale, degree + 1, increasing=True)
        rows = np.linalg.pinv(vandermonde)
        operators[0, i, near] = rows[0]
        if degree >= 1:
            operators[1, i, near] = rows[1] / scale
        if degree >= 2:
            operators[2, i, near] = 2 * rows[2] / scale**2
    _calm_ends(operators[2], time_s, half_width_s)
    return operators[0], operators[1], operators[2]


def _calm_ends(second: Array, time_s: Array, half_width_s: float) -> None:
    """Replaces the rows of instants whose window is cut off by those of a parabola at that end."""
    for at_start in (True, False):
        inward = np.abs(time_s - time_s[0 if at_start else -1])
        near = np.flatnonzero(inward <= 2 * half_width_s)
        if len(near) < 5:
            near = np.sort(np.argsort(inward, kind="stable")[: min(5, len(time_s))])
        cut = inward < half_width_s * (1 - 1e-9)
        if len(near) < 3:
            continue
        middle, scale = time_s[near].mean(), np.ptp(time_s[near])
        parabola = np.linalg.pinv(np.vander((time_s[near] - middle) / scale, 3, increasing=True))
        second[cut] = 0.0
        second[np.ix_(cut, near)] = 2 * parabola[2] / scale**2
