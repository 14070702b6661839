"""Angles of one joint: exact within limits, the true optimum outside, continuous through 90 deg."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from human.pairwise_ik import distance, nearest_in_box, solve_pair

FREE = (np.full(3, -np.inf), np.full(3, np.inf))
SHOULDER = np.deg2rad([[-108.0, -120.7, -81.3], [135.0, 78.0, 176.1]])
ELBOW = np.deg2rad([[-20.0, -89.7, -6.8], [20.0, 86.0, 154.1]])
NARROW = np.deg2rad([[10.0, -5.0, 100.0], [12.0, 5.0, 170.0]])
BOXES = {"shoulder": SHOULDER, "elbow": ELBOW, "narrow": NARROW}


def quaternions(angles: np.ndarray) -> np.ndarray:
    """By scipy, so that a wrong order of axes here cannot hide."""
    return Rotation.from_euler("XYZ", angles).as_quat()


def brute_force(quat: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> float:
    """Least distance (rad) over the box: a grid, its best points refined by a general solver."""
    target = Rotation.from_quat(quat)

    def error(angles: np.ndarray) -> np.ndarray:
        return (target.inv() * Rotation.from_euler("XYZ", angles)).magnitude()

    axes = [np.linspace(lo, hi, 11) for lo, hi in zip(lower, upper, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    starts = grid[np.argsort(error(grid))[:3]]
    bounds = list(zip(lower, upper, strict=True))
    # One minus the cosine is smooth where the angle itself has a kink.
    found = [
        minimize(lambda s: 1.0 - np.cos(error(s)), start, bounds=bounds, method="L-BFGS-B").x
        for start in starts
    ]
    return float(min(error(np.array(found))))


def test_inside_the_limits_the_angles_come_back() -> None:
    rng = np.random.default_rng(0)
    for lower, upper in BOXES.values():
        inside = rng.uniform(lower, upper, size=(100, 3))
        # Each frame by itself: neighbours here are unrelated.
        for angles in inside:
            solved = solve_pair(quaternions(angles[None]), lower, upper)
            if solved.frozen[0]:
                continue
            assert not solved.limited[0]
            assert solved.error_rad[0] < np.deg2rad(1e-6)
            assert np.all((solved.angles >= lower) & (solved.angles <= upper))


@pytest.mark.parametrize("box", list(BOXES))
def test_outside_the_limits_no_posture_in_the_box_is_nearer(box: str) -> None:
    lower, upper = BOXES[box]
    quat = Rotation.random(12, random_state=np.random.default_rng(1)).as_quat()
    angles = nearest_in_box(quat, lower, upper)
    assert np.all((angles >= lower) & (angles <= upper))
    reached = distance(quat, angles)
    for k in range(len(quat)):
        best = brute_force(quat[k], lower, upper)
        if best > 1e-3:  # inside the box nothing is asked of it
            assert reached[k] <= best + 1e-6


def test_the_optimum_is_not_the_clipped_angles() -> None:
    lower, upper = ELBOW
    quat = quaternions(np.deg2rad([[50.0, 60.0, 100.0]]))
    solved = solve_pair(quat, lower, upper)
    clipped = np.clip(np.deg2rad([[50.0, 60.0, 100.0]]), lower, upper)
    assert solved.limited[0]
    assert solved.error_rad[0] < distance(quat, clipped)[0] - np.deg2rad(5.0)


def test_a_half_open_box_is_respected() -> None:
    lower, upper = np.array([-np.inf, -0.2, -np.inf]), np.array([np.inf, 0.2, np.inf])
    quat = quaternions(np.array([[0.5, 1.0, -0.4], [2.0, -1.2, 3.0]]))
    angles = nearest_in_box(quat, lower, upper)
    np.testing.assert_allclose(np.abs(angles[:, 1]), 0.2)
    # With the outer angles free the nearest rotation keeps them and loses the middle one's excess.
    np.testing.assert_allclose(distance(quat, angles), [0.8, 1.0], atol=1e-9)


def test_beyond_ninety_degrees_the_second_branch_is_followed() -> None:
    b = np.deg2rad(np.linspace(60.5, 115.5, 56))
    path = np.stack([np.full(56, 0.3), b, np.full(56, -0.7)], axis=-1)
    solved = solve_pair(quaternions(path), *FREE)
    np.testing.assert_allclose(solved.angles, path, atol=1e-6)
    np.testing.assert_array_equal(solved.near_singular, np.abs(b - np.pi / 2) < np.deg2rad(5.0))


def test_rounding_noise_at_ninety_degrees_does_not_make_angles_jump() -> None:
    rng = np.random.default_rng(2)
    time = np.linspace(0.0, 1.0, 121)
    path = np.stack([0.3 + 0.2 * time, np.pi / 2 + 0.4 * (time - 0.5), 0.5 - 0.3 * time], axis=-1)
    path[40:80, 1] = np.pi / 2  # rests on the singularity
    quat = quaternions(path) + rng.normal(scale=1e-6, size=(121, 4))
    quat /= np.linalg.norm(quat, axis=-1, keepdims=True)
    solved = solve_pair(quat, *FREE)
    assert np.all(solved.frozen[40:80])
    assert np.max(np.abs(np.diff(solved.angles, axis=0))) < np.deg2rad(6.0)
    assert np.max(solved.error_rad) < 2e-5


def test_a_recording_wholly_at_the_singularity_still_has_angles() -> None:
    path = np.tile([0.2, np.pi / 2, 0.3], (5, 1))
    solved = solve_pair(quaternions(path), *np.deg2rad([[-180.0] * 3, [180.0] * 3]))
    assert np.all(solved.frozen)
    assert np.max(solved.error_rad) < np.deg2rad(1e-5)
    np.testing.assert_allclose(np.diff(solved.angles, axis=0), 0.0, atol=1e-9)


def test_whole_turns_are_followed_where_there_are_no_limits() -> None:
    c = np.linspace(0.0, 9.0, 200)
    path = np.stack([np.full(200, 0.1), np.full(200, 0.2), c], axis=-1)
    solved = solve_pair(quaternions(path), *FREE)
    np.testing.assert_allclose(solved.angles, path, atol=1e-9)


def test_of_two_allowed_branches_the_smoother_path_is_taken() -> None:
    lower, upper = SHOULDER
    rng = np.random.default_rng(3)
    steps = np.cumsum(rng.normal(scale=0.01, size=(400, 3)), axis=0)
    path = np.clip(np.array([0.2, -1.9, 0.4]) + steps, lower, upper)  # middle beyond -90 deg
    solved = solve_pair(quaternions(path), lower, upper)
    assert np.max(np.abs(np.diff(solved.angles, axis=0))) < 0.2
    assert np.max(solved.error_rad[~solved.frozen]) < np.deg2rad(1e-6)
    assert np.count_nonzero(solved.frozen) < 20
