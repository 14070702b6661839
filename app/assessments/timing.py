"""The time grid on which a candidate is predicted."""

from dataclasses import dataclass, replace

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
    return replace(path, time_s=grid.time_s, pose=Pose(rotation, position))
