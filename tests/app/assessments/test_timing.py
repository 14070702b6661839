"""The prediction's time grid, and derivatives that are exact for cubics on uneven samples."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.assessments.candidates import HandPath
from app.assessments.poses import IDENTITY, Pose, rotation_angle
from app.assessments.timing import (
    LONGEST_STEP_S,
    SHORTEST_STEP_S,
    cubic_operators,
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
        np.array([0.0, 1.0]), Pose(rotation, np.array([[0.0, 0, 1], [1, 0, 1]])), False, IDENTITY
    )
    fine = resample(path, prediction_grid(path.time_s))
    share = fine.time_s
    np.testing.assert_allclose(fine.pose.position[:, 0], share, atol=1e-12)
    turned = rotation_angle(fine.pose.rotation, np.eye(3))
    np.testing.assert_allclose(turned, share * np.pi / 2, atol=1e-9)


def test_operators_are_exact_for_cubics_on_uneven_samples() -> None:
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.uniform(0.02, 0.08, 40))
    value, first, second = cubic_operators(time, 0.2)
    cubic = np.polynomial.Polynomial([1.0, -2.0, 3.0, -0.5])
    np.testing.assert_allclose(value @ cubic(time), cubic(time), atol=1e-9)
    np.testing.assert_allclose(first @ cubic(time), cubic.deriv()(time), atol=1e-8)
    whole = (time - time[0] >= 0.2) & (time[-1] - time >= 0.2)
    assert whole.sum() > 20
    np.testing.assert_allclose(
        (second @ cubic(time))[whole], cubic.deriv(2)(time)[whole], atol=1e-6
    )
    parabola = np.polynomial.Polynomial([1.0, -2.0, 3.0])
    np.testing.assert_allclose(second @ parabola(time), 6.0, atol=1e-6)


def test_roughness_is_not_multiplied_at_the_ends() -> None:
    _, _, second = cubic_operators(np.linspace(0.0, 2.0, 41), 0.25)
    gain = np.linalg.norm(second, axis=1)
    assert gain.max() < 1.5 * gain[20]


@pytest.mark.parametrize("count", [2, 3, 4])
def test_operators_of_few_samples_lower_the_degree(count: int) -> None:
    time = np.linspace(0, 0.1, count)
    value, first, second = cubic_operators(time, 0.2)
    line = 3.0 * time + 1.0
    np.testing.assert_allclose(value @ line, line, atol=1e-12)
    np.testing.assert_allclose(first @ line, 3.0, atol=1e-9)
    np.testing.assert_allclose(second @ line, 0.0, atol=1e-7)


def test_small_rotation_angles_keep_their_digits() -> None:
    tiny = Rotation.from_rotvec([0, 1e-9, 0]).as_matrix()
    assert rotation_angle(tiny, np.eye(3)) == pytest.approx(1e-9, rel=1e-6)
    half = Rotation.from_rotvec([np.pi, 0, 0]).as_matrix()
    assert rotation_angle(half, np.eye(3)) == pytest.approx(np.pi)
