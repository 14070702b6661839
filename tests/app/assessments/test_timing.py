"""The prediction's time grid."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.assessments.candidates import HandPath
from app.assessments.poses import IDENTITY, Pose, rotation_angle
from app.assessments.timing import (
    LONGEST_STEP_S,
    SHORTEST_STEP_S,
    prediction_grid,
    resample,
)


def test_times_in_range_are_taken_as_they_are() -> None:
    time = np.array([0.0, 0.05, 0.08, 0.15])
    grid = prediction_grid(time)
    assert not grid.resampled
    assert grid.time_s is time


@pytest.mark.parametrize(
    "time", [np.linspace(3, 5, 3), np.linspace(0, 1, 1001), np.array([0.0, 0.001, 1.0])]
)
def test_other_times_are_divided_evenly_over_the_same_duration(time: np.ndarray) -> None:
    grid = prediction_grid(time)
    step = np.diff(grid.time_s)
    assert grid.resampled
    assert (grid.time_s[0], grid.time_s[-1]) == (time[0], time[-1])
    assert step.max() - step.min() < 1e-12
    assert SHORTEST_STEP_S * 0.9 < step[0] < LONGEST_STEP_S * 1.001


def test_resampling_is_straight_and_takes_the_shortest_turn() -> None:
    rotation = Rotation.from_rotvec([[0, 0, 0], [0, 0, np.pi / 2]]).as_matrix()
    path = HandPath(
        np.array([0.0, 1.0]), Pose(rotation, np.array([[0.0, 0, 1], [1, 0, 1]])), False, (IDENTITY,)
    )
    fine = resample(path, prediction_grid(path.time_s))
    share = fine.time_s
    np.testing.assert_allclose(fine.pose.position[:, 0], share, atol=1e-12)
    turned = rotation_angle(fine.pose.rotation, np.eye(3))
    np.testing.assert_allclose(turned, share * np.pi / 2, atol=1e-9)


def test_small_rotation_angles_keep_their_digits() -> None:
    tiny = Rotation.from_rotvec([0, 1e-9, 0]).as_matrix()
    assert rotation_angle(tiny, np.eye(3)) == pytest.approx(1e-9, rel=1e-6)
    half = Rotation.from_rotvec([np.pi, 0, 0]).as_matrix()
    assert rotation_angle(half, np.eye(3)) == pytest.approx(np.pi)
