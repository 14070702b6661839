import numpy as np
import pytest

from human.rotations import rotation_vector_to_matrix
from prediction import DiscontinuousTrajectoryError, HandPath, TrajectoryError
from prediction.following.hand_path import orientation_error


def circle(points=30):
    time_s = 0.05 * np.arange(points)
    position = 0.3 * np.stack([np.cos(time_s), np.sin(time_s), 0 * time_s], axis=1)
    rotation = rotation_vector_to_matrix(np.stack([0 * time_s, time_s, 0.3 * time_s], axis=1))
    return time_s, position, rotation


BROKEN = {
    "one point": (lambda t, p, r: (t[:1], p[:1], r[:1]), "at least two points"),
    "lengths": (lambda t, p, r: (t, p[:-1], r), "positions have shape"),
    "rotation shape": (lambda t, p, r: (t, p, r[:, 0]), "rotations have shape"),
    "nan position": (lambda t, p, r: (t, np.where(np.arange(30)[:, None] == 4, np.nan, p), r), "4"),
    "nan time": (lambda t, p, r: (np.where(np.arange(30) == 6, np.inf, t), p, r), "point 6"),
    "repeated time": (lambda t, p, r: (np.minimum(t, t[9]), p, r), "point 10"),
    "not a rotation": (lambda t, p, r: (t, p, r * 1.01), "not a rotation"),
    "mirror": (lambda t, p, r: (t, p, r * np.array([1, 1, -1])), "not a rotation"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_malformed_paths_are_refused_with_the_place(case):
    change, words = BROKEN[case]
    with pytest.raises(TrajectoryError, match=words):
        HandPath.checked(*change(*circle()))


def test_jumps_are_refused_with_place_distance_and_speed():
    time_s, position, rotation = circle()
    jumped = position.copy()
    jumped[12:] += np.array([0.0, 0.0, 0.5])
    with pytest.raises(DiscontinuousTrajectoryError) as caught:
        HandPath.checked(time_s, jumped, rotation)
    error = caught.value
    assert error.index == 12 and not error.angular
    assert error.distance == pytest.approx(0.5, abs=0.01)
    assert error.speed == pytest.approx(error.distance / 0.05)
    turned = rotation.copy()
    turned[20:] = turned[20:] @ rotation_vector_to_matrix(np.array([1.5, 0.0, 0.0]))
    with pytest.raises(DiscontinuousTrajectoryError) as caught:
        HandPath.checked(time_s, position, turned)
    assert caught.value.index == 20 and caught.value.angular
    assert "rad/s" in str(caught.value)


def test_refining_keeps_the_points_and_halves_the_way():
    path = HandPath.checked(*circle())
    fine = path.refined(4)
    np.testing.assert_allclose(fine.position[::4], path.position, atol=1e-15)
    np.testing.assert_allclose(fine.rotation[::4], path.rotation, atol=1e-12)
    np.testing.assert_allclose(fine.time_s[::4], path.time_s, atol=1e-12)
    whole = orientation_error(path.rotation[1], path.rotation[0])
    part = orientation_error(fine.rotation[1], fine.rotation[0])
    np.testing.assert_allclose(part, whole / 4, atol=1e-12)
    assert path.refined(1) is path


def test_long_steps_are_cut():
    time_s, position, _ = circle()
    slow = HandPath.checked(time_s, position, None)
    assert slow.substeps() == 1
    assert HandPath.checked(4 * time_s, position, None).substeps() == 4
    assert HandPath.checked(time_s, 3 * position, None).substeps() == 2


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 1.0, 2.9, 3.1])
def test_orientation_error_is_the_rotation_vector(angle, rng):
    axis = rng.normal(size=3)
    vector = angle * axis / np.linalg.norm(axis)
    start = rotation_vector_to_matrix(rng.normal(size=3))
    target = rotation_vector_to_matrix(vector) @ start
    np.testing.assert_allclose(orientation_error(target, start), vector, atol=1e-9)
