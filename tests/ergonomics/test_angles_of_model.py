"""The angles on the real model: each degree of freedom moves the angle that it should."""

import numpy as np
import pytest

from ergonomics import back_angle, posture_angles, rula_inputs, score_rula
from human import Subject, forward_kinematics, generate_model


@pytest.fixture(scope="module")
def model():
    return generate_model(Subject(1.68, 61.0, "female"))


def _angles(model, **moves):
    """Angles of the N-pose with some joints moved by degrees."""
    q = np.zeros(model.nq)
    q[6] = 1.0
    n_pose = {"jRightShoulder_rotx": 90.0, "jLeftShoulder_rotx": -90.0}
    for name, degrees in (n_pose | moves).items():
        q[7 + model.dof_names.index(name)] = np.deg2rad(degrees)
    return posture_angles(model, forward_kinematics(model, q))


def test_n_pose_of_the_model_scores_as_rest(model):
    angles = _angles(model)
    for side in ("left", "right"):
        arm = angles.arms[side]
        for name in ("upper_arm_deg", "abduction_deg", "shoulder_raise_deg", "wrist_flexion_deg"):
            np.testing.assert_allclose(getattr(arm, name), 0.0, atol=1e-6)
        # Only the straight elbow costs: 0 degrees is below the 60 to 100 of the best band.
        scores = score_rula(rula_inputs(angles, side=side))
        assert (scores.upper_arm, scores.lower_arm, scores.trunk, scores.neck) == (1, 2, 1, 1)


@pytest.mark.parametrize(
    ("dof", "degrees", "side", "name", "expected"),
    [
        ("jRightElbow_rotz", 75, "right", "elbow_deg", 75),
        ("jLeftElbow_rotz", -75, "left", "elbow_deg", 75),
        ("jRightElbow_roty", 50, "right", "pronation_deg", 50),
        ("jLeftElbow_roty", 50, "left", "pronation_deg", 50),
        ("jRightWrist_rotx", 40, "right", "wrist_flexion_deg", 40),
        ("jLeftWrist_rotx", -40, "left", "wrist_flexion_deg", 40),
        ("jRightWrist_rotz", 15, "right", "wrist_deviation_deg", 15),
        ("jLeftWrist_rotz", -15, "left", "wrist_deviation_deg", 15),
        ("jRightC7Shoulder_rotx", -15, "right", "shoulder_raise_deg", 15),
        ("jLeftC7Shoulder_rotx", 15, "left", "shoulder_raise_deg", 15),
        ("jRightShoulder_roty", 30, "right", "upper_arm_deg", 0),
    ],
)
def test_arm(model, dof, degrees, side, name, expected):
    angles = _angles(model, **{dof: degrees})
    np.testing.assert_allclose(getattr(angles.arms[side], name), expected, atol=1e-6)


@pytest.mark.parametrize(
    ("dof", "name"),
    [
        ("jC1Head_roty", "neck_flexion_deg"),
        ("jT1C7_rotz", "neck_twist_deg"),
        ("jL5S1_roty", "trunk_flexion_deg"),
        ("jT9T8_roty", "trunk_flexion_deg"),
        ("jL1T12_rotz", "trunk_twist_deg"),
    ],
)
def test_body(model, dof, name):
    np.testing.assert_allclose(getattr(_angles(model, **{dof: 25.0}), name), 25.0, atol=1e-6)


def test_knee_and_side_bend(model):
    np.testing.assert_allclose(_angles(model, jRightKnee_roty=60).knee_deg["right"], 60, atol=3)
    np.testing.assert_allclose(_angles(model, jL4L3_rotx=-18).trunk_bend_deg, 18, atol=1e-6)


def test_back_angle_reads_the_joint_angles_of_a_pure_bend(model):
    q = np.zeros(model.nq)
    q[6] = 1.0
    bends = {"jL5S1_roty": 12.0, "jL4L3_roty": 9.0, "jL1T12_roty": -4.0, "jT9T8_roty": 6.0}
    for name, degrees in bends.items():
        q[7 + model.dof_names.index(name)] = np.deg2rad(degrees)
    bent = back_angle(model, forward_kinematics(model, q))
    np.testing.assert_allclose(bent.by_joint_deg, list(bends.values()), atol=1e-9)
    np.testing.assert_allclose(bent.chain_sum_deg, 31.0)
