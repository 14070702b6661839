import numpy as np
import pinocchio as pin
import pytest

from human import ConfigurationError, UnknownNameError, forward_kinematics, frame_poses
from human.kinematics import CHUNK


def pinocchio_poses(model, q):
    """Returns Pinocchio's pose of every named frame at one configuration."""
    peer = model.pinocchio()
    data = peer.createData()
    pin.framesForwardKinematics(peer, data, q)
    return {frame.name: data.oMf[index] for index, frame in enumerate(peer.frames)}


def test_equals_pinocchio(model, configurations):
    q = configurations(model, 40)
    poses = forward_kinematics(model, q)
    for row in range(len(q)):
        expected = pinocchio_poses(model, q[row])
        rotation = np.stack([expected[name].rotation for name in model.segment_names])
        position = np.stack([expected[name].translation for name in model.segment_names])
        np.testing.assert_allclose(poses.rotation[row], rotation, atol=1e-12)
        np.testing.assert_allclose(poses.position[row], position, atol=1e-12)


@pytest.mark.parametrize("name", ["RightHandCOM", "LeftHandCOM", "Head"])
def test_frames_equal_pinocchio(model, configurations, name):
    q = configurations(model, 10)
    rotation, position = frame_poses(model, forward_kinematics(model, q), name)
    for row in range(len(q)):
        expected = pinocchio_poses(model, q[row])[name]
        np.testing.assert_allclose(rotation[row], expected.rotation, atol=1e-12)
        np.testing.assert_allclose(position[row], expected.translation, atol=1e-12)


def test_any_leading_dimensions(model, configurations):
    q = configurations(model, 3, 2, 4)
    poses = forward_kinematics(model, q)
    assert poses.rotation.shape == (3, 2, 4, 23, 3, 3)
    assert poses.position.shape == (3, 2, 4, 23, 3)
    one = forward_kinematics(model, q[1, 1, 3])
    np.testing.assert_array_equal(one.rotation, poses.rotation[1, 1, 3])
    np.testing.assert_array_equal(one.position, poses.position[1, 1, 3])


def test_chunks_do_not_show(model, configurations):
    q = configurations(model, 5)
    many = np.tile(q, ((CHUNK + 7) // 5 + 1, 1))
    poses = forward_kinematics(model, many)
    for row in (0, CHUNK - 1, CHUNK, len(many) - 1):
        np.testing.assert_array_equal(
            poses.rotation[row], forward_kinematics(model, many[row]).rotation
        )


def test_no_configurations_give_no_poses(model):
    assert forward_kinematics(model, np.empty((0, model.nq))).position.shape == (0, 23, 3)


def test_t_pose(model):
    poses = forward_kinematics(model, model.neutral())
    np.testing.assert_array_equal(poses.rotation, np.broadcast_to(np.eye(3), (23, 3, 3)))
    right, left = poses.of("RightHand")[1], poses.of("LeftHand")[1]
    assert right[1] < -0.5 and left[1] > 0.5
    np.testing.assert_allclose(right * [1, -1, 1], left, atol=1e-15)
    assert poses.of("Head")[1][2] > 0.4
    assert poses.of("RightFoot")[1][2] < -0.7


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda q: q[:-1], "expected shape"),
        (lambda q: np.r_[q[:8], np.nan, q[9:]], "finite"),
        (lambda q: np.r_[q[:3], 2 * q[3:7], q[7:]], "norm 2"),
        (lambda q: np.r_[q[:3], 0 * q[3:7], q[7:]], "norm 0"),
    ],
)
def test_malformed_configurations_are_refused(model, change, message):
    with pytest.raises(ConfigurationError, match=message):
        forward_kinematics(model, change(model.neutral()))


def test_unknown_frame_is_refused(model):
    poses = forward_kinematics(model, model.neutral())
    with pytest.raises(UnknownNameError, match=r"'Tail'.*RightHandCOM"):
        frame_poses(model, poses, "Tail")
