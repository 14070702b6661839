import numpy as np
import pytest

from ergonomics import (
    REFERENCE_MOMENT_NM,
    PostureError,
    effort_l2,
    effort_quantiles,
    effort_share,
    moment_norm,
)
from human import (
    JOINTS,
    Subject,
    Wrench,
    forward_kinematics,
    frame_poses,
    generate_model,
    inverse_dynamics,
    joint_moments,
)


@pytest.fixture(scope="module")
def model():
    return generate_model(Subject(1.75, 72.0, "male"))


def _still(model, **angles):
    q = np.zeros(model.nq)
    q[6] = 1.0
    for name, value in angles.items():
        q[7 + model.dof_names.index(name)] = value
    return q


def test_norm_does_not_depend_on_the_axes():
    rng = np.random.default_rng(0)
    moments = rng.normal(size=(5, 22, 3))
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    np.testing.assert_allclose(moment_norm(moments), moment_norm(moments @ turn))
    np.testing.assert_allclose(moment_norm(moments), np.linalg.norm(moments, axis=-1))


def test_both_efforts_agree_in_the_t_pose_and_part_when_the_joint_is_turned(model):
    right = JOINTS.index("jRightShoulder")
    for pose, same in (
        ({}, True),
        (
            {"jRightShoulder_rotx": 0.6, "jRightShoulder_roty": 0.9, "jRightShoulder_rotz": 0.5},
            False,
        ),
    ):
        q, still = _still(model, **pose), np.zeros(model.nv)
        moment = moment_norm(joint_moments(model, q, still, still))[right]
        torque = effort_l2(inverse_dynamics(model, q, still, still)[6:])[right]
        assert moment > 1.0
        assert (abs(torque - moment) < 1e-9 * moment) == same


def test_load_in_the_hand_adds_its_lever_at_the_shoulder(model):
    q, still = _still(model), np.zeros(model.nv)
    weight = Wrench("RightHandCOM", (0.0, 0.0, -5.0 * 9.81))
    at = [JOINTS.index(name) for name in ("jRightShoulder", "jRightElbow", "jLeftShoulder")]
    free = moment_norm(joint_moments(model, q, still, still))[at]
    loaded = moment_norm(joint_moments(model, q, still, still, [weight]))[at]
    poses = forward_kinematics(model, q)
    hand = frame_poses(model, poses, "RightHandCOM")[1]
    levers = [
        abs(hand[1] - poses.position[model.segment_names.index(s), 1])
        for s in ("RightUpperArm", "RightForeArm")
    ]
    np.testing.assert_allclose(loaded[:2] - free[:2], 5.0 * 9.81 * np.array(levers), rtol=1e-6)
    np.testing.assert_allclose(loaded[2], free[2], rtol=1e-9)


def test_share_is_of_each_joints_own_reference():
    names = ("jL5S1", "jRightElbow")
    effort = np.array([[100.0, 35.0]])
    np.testing.assert_allclose(effort_share(effort, names), [[0.5, 0.5]])
    np.testing.assert_allclose(
        effort_share(effort, names, {"jL5S1": 50.0, "jRightElbow": 70.0}), [[2.0, 0.5]]
    )
    assert set(REFERENCE_MOMENT_NM) <= set(JOINTS)
    with pytest.raises(PostureError, match="jRightKnee"):
        effort_share(np.ones(1), ("jRightKnee",))


def test_quantiles_over_samples():
    samples = np.arange(101.0)[:, None] * np.array([1.0, 2.0])
    np.testing.assert_allclose(effort_quantiles(samples), [[5, 10], [50, 100], [95, 190]])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: moment_norm(np.zeros((2, 2))), "moment"),
        (lambda: moment_norm(np.full((2, 3), np.nan)), r"moment at index \[0, 0\]"),
        (lambda: effort_l2(np.zeros(7)), "three per joint"),
        (lambda: effort_share(np.zeros(3), ("jL5S1",)), "effort_nm"),
        (lambda: effort_quantiles(np.zeros((0, 3))), "samples"),
    ],
)
def test_malformed_arrays_are_refused(call, message):
    with pytest.raises(PostureError, match=message):
        call()
