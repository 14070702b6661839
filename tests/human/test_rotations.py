import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from human.errors import RotationError
from human.rotations import (
    matrix_to_quaternion,
    matrix_to_rotation_vector,
    matrix_to_xyz,
    quaternion_conjugate,
    quaternion_continuous,
    quaternion_multiply,
    quaternion_normalized,
    quaternion_rotate,
    quaternion_to_matrix,
    quaternion_to_rotation_vector,
    rotation_vector_to_matrix,
    rotation_vector_to_quaternion,
    skew,
    xyz_to_matrix,
)


@pytest.fixture
def quats() -> np.ndarray:
    rng = np.random.default_rng(1)
    random = Rotation.random(200, random_state=rng).as_quat()
    # Half turns about every axis: where a badly chosen divisor vanishes.
    return np.concatenate([random, np.eye(4), [[1, 1, 0, 0], [0, 1, -1, 0]] / np.sqrt(2)])


def test_matrix_against_scipy(quats):
    np.testing.assert_allclose(
        quaternion_to_matrix(quats), Rotation.from_quat(quats).as_matrix(), atol=1e-15
    )


def test_quaternion_round_trip(quats):
    back = matrix_to_quaternion(quaternion_to_matrix(quats))
    np.testing.assert_allclose(np.abs(np.sum(back * quats, axis=1)), 1.0, atol=1e-14)
    assert np.all(back[:, 3] >= 0.0)


def test_product_is_composition(quats):
    a, b = quats[:100], quats[100:200]
    np.testing.assert_allclose(
        quaternion_to_matrix(quaternion_multiply(a, b)),
        quaternion_to_matrix(a) @ quaternion_to_matrix(b),
        atol=1e-14,
    )


def test_conjugate_is_inverse(quats):
    one = quaternion_multiply(quats, quaternion_conjugate(quats))
    np.testing.assert_allclose(one, np.broadcast_to([0, 0, 0, 1], one.shape), atol=1e-15)


def test_rotate_broadcasts(quats):
    vectors = np.random.default_rng(2).normal(size=(5, 1, 3))
    rotated = quaternion_rotate(quats, vectors)
    assert rotated.shape == (5, len(quats), 3)
    expected = np.einsum("qij,nj->nqi", quaternion_to_matrix(quats), vectors[:, 0])
    np.testing.assert_allclose(rotated, expected, atol=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-7, 1e-5, 1e-3, 1.0, 3.0, np.pi - 1e-9])
def test_logarithm_undoes_exponential(angle):
    axis = np.array([0.6, -0.48, 0.64])
    vector = angle * axis
    np.testing.assert_allclose(
        quaternion_to_rotation_vector(rotation_vector_to_quaternion(vector)), vector, atol=1e-14
    )
    np.testing.assert_allclose(rotation_vector_to_matrix(vector), pin.exp3(vector), atol=1e-14)
    if angle < 3.0:
        back = matrix_to_rotation_vector(pin.exp3(vector))
        np.testing.assert_allclose(back, vector, atol=1e-14 if angle > 1e-6 else 1e-16)


def test_logarithm_ignores_the_sign():
    quat = rotation_vector_to_quaternion([0.3, -0.2, 0.1])
    np.testing.assert_allclose(quaternion_to_rotation_vector(-quat), [0.3, -0.2, 0.1], atol=1e-15)


def test_xyz_is_three_turns_in_order():
    a, b, c = 0.4, -0.7, 1.9
    by_hand = (
        pin.exp3(np.array([a, 0, 0]))
        @ pin.exp3(np.array([0, b, 0]))
        @ pin.exp3(np.array([0, 0, c]))
    )
    np.testing.assert_allclose(xyz_to_matrix([a, b, c]), by_hand, atol=1e-15)


def test_xyz_round_trip_and_twin():
    rng = np.random.default_rng(3)
    angles = rng.uniform([-np.pi, -np.pi / 2, -np.pi], [np.pi, np.pi / 2, np.pi], (500, 3))
    np.testing.assert_allclose(matrix_to_xyz(xyz_to_matrix(angles)), angles, atol=1e-9)
    twin = np.stack([angles[:, 0] + np.pi, np.pi - angles[:, 1], angles[:, 2] + np.pi], axis=1)
    np.testing.assert_allclose(xyz_to_matrix(twin), xyz_to_matrix(angles), atol=1e-14)


@pytest.mark.parametrize("middle", [np.pi / 2, -np.pi / 2])
def test_xyz_at_the_singularity_is_the_same_rotation(middle):
    rotation = xyz_to_matrix([0.5, middle, -1.1])
    angles = matrix_to_xyz(rotation)
    assert angles[2] == 0.0
    np.testing.assert_allclose(xyz_to_matrix(angles), rotation, atol=1e-14)


def test_continuous_keeps_rotations_and_hemisphere():
    rng = np.random.default_rng(4)
    steps = rotation_vector_to_quaternion(np.linspace([0, 0, 0], [7.0, 3.0, -2.0], 60))
    shaken = steps * rng.choice([-1.0, 1.0], (60, 1))
    smooth = quaternion_continuous(shaken)
    np.testing.assert_array_equal(np.abs(smooth), np.abs(shaken))
    assert np.all(np.sum(smooth[1:] * smooth[:-1], axis=1) > 0.0)
    np.testing.assert_array_equal(smooth[0], shaken[0])


def test_skew_is_the_cross_product():
    v, w = np.array([1.0, 2.0, -3.0]), np.array([0.5, -1.0, 4.0])
    np.testing.assert_allclose(skew(v) @ w, np.cross(v, w))


@pytest.mark.parametrize("bad", [[0.0, 0, 0, 0], [np.nan, 0, 0, 1], [np.inf, 0, 0, 1]])
def test_refuses_what_is_no_quaternion(bad):
    with pytest.raises(RotationError, match="finite and non-zero"):
        quaternion_normalized(bad)


def test_refuses_wrong_shapes():
    with pytest.raises(RotationError, match="expected shape"):
        quaternion_to_matrix([1.0, 0.0, 0.0])
