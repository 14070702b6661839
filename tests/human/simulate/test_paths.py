import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from human.simulate import SimulationError, minimum_jerk, minimum_jerk_path, spline_path
from human.simulate.paths import RidingPath

_RNG = np.random.default_rng(0)
_POINTS = _RNG.normal(size=(4, 3))
_TURNS = Rotation.from_rotvec(0.4 * _RNG.normal(size=(4, 3)))
_TIMES = [0.0, 1.0, 2.5, 3.0]
_BOWED = minimum_jerk_path(_TIMES, _POINTS, _TURNS.as_matrix(), _RNG.normal(size=(3, 3)))
_SPLINE = spline_path(_TIMES, _POINTS, _TURNS.as_quat())
_RIDING = RidingPath(_SPLINE, _BOWED)


@pytest.mark.parametrize("path", [_BOWED, _SPLINE, _RIDING])
def test_twist_is_the_derivative_of_the_pose(path):
    t, h = np.linspace(0.01, 2.99, 40), 1e-6
    before, now, after = (path.sample(t + k * h) for k in (-1, 0, 1))
    np.testing.assert_allclose((after.position - before.position) / (2 * h), now.linear, atol=1e-7)
    turned = Rotation.from_matrix(after.rotation @ np.swapaxes(before.rotation, -1, -2))
    np.testing.assert_allclose(turned.as_rotvec() / (2 * h), now.angular, atol=1e-7)


@pytest.mark.parametrize("path", [_BOWED, _SPLINE])
def test_path_meets_its_poses_and_rests_at_and_beyond_its_ends(path):
    at = path.sample(_TIMES)
    np.testing.assert_allclose(at.position, _POINTS, atol=1e-12)
    np.testing.assert_allclose(at.rotation, _TURNS.as_matrix(), atol=1e-12)
    ends = path.sample([-1.0, 0.0, 3.0, 4.0])
    np.testing.assert_allclose(ends.twist, 0.0, atol=1e-12)
    np.testing.assert_allclose(ends.position, _POINTS[[0, 0, 3, 3]], atol=1e-12)


def test_minimum_jerk_is_the_quintic_between_rests():
    # An independent route: the quintic spline with velocity and acceleration zero at both ends.
    t = np.linspace(0.0, 2.0, 21)
    quintic = spline_path([0.0, 2.0], [[0, 0, 0], [1, 0, 0]], [0, 0, 0, 1]).sample(t)
    share, slope = minimum_jerk(t / 2.0)
    np.testing.assert_allclose(share, quintic.position[:, 0], atol=1e-12)
    np.testing.assert_allclose(slope / 2.0, quintic.linear[:, 0], atol=1e-12)


def test_bow_is_the_deviation_at_half_way():
    bow = [[0.0, 0.1, 0.2]]
    path = minimum_jerk_path([0, 1], [[0, 0, 0], [1, 0, 0]], np.eye(3), bow)
    np.testing.assert_allclose(path.sample(0.5).position[0], [0.5, 0.1, 0.2])


def test_seen_from_undoes_carried_by():
    t = np.linspace(0.1, 2.9, 7)
    frame, local = _SPLINE.sample(t), _BOWED.sample(t)
    back = local.carried_by(frame).seen_from(frame)
    np.testing.assert_allclose(back.position, local.position, atol=1e-12)
    np.testing.assert_allclose(back.rotation, local.rotation, atol=1e-12)
    np.testing.assert_allclose(back.twist, local.twist, atol=1e-12)


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: minimum_jerk_path([0.0], [[0, 0, 0]], np.eye(3)), "increasing"),
        (lambda: minimum_jerk_path([0, 0], np.zeros((2, 3)), np.eye(3)), "increasing"),
        (lambda: minimum_jerk_path([0, 1], np.full((2, 3), np.nan), np.eye(3)), "finite"),
        (lambda: minimum_jerk_path([0, 1], np.zeros((2, 3)), np.eye(3), [[0, 0]]), "bow"),
        (lambda: spline_path([1, 0], np.zeros((2, 3)), [0, 0, 0, 1]), "increasing"),
        (
            lambda: spline_path([0, 1], np.zeros((2, 3)), [[0, 0, 0, 1], [0, 0, 1, 0]]),
            "180 degrees",
        ),
    ],
)
def test_impossible_paths_are_refused(make, word):
    with pytest.raises(SimulationError, match=word):
        make()
