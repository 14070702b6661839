"""Angles as MVN states them: zero hanging, positive in the clinical sense on both sides."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from human.mvn_angles import HANGING_ARM_AXES, mvn_joint_angles_deg
from human.names import JOINTS, PARENT_SEGMENT, SEGMENT_OF_JOINT

NONE = Rotation.identity()


def turned(axis: str, degrees: float) -> Rotation:
    return Rotation.from_euler(axis, degrees, degrees=True)


def angles(joint: str, parent: Rotation, child: Rotation, sequence: str = "ZXY") -> np.ndarray:
    return mvn_joint_angles_deg(joint, parent.as_quat(), child.as_quat(), sequence)


@pytest.mark.parametrize("side", ["Right", "Left"])
@pytest.mark.parametrize("sequence", ["ZXY", "XZY"])
def test_hanging_arms_are_zero_and_the_t_pose_is_abducted(side: str, sequence: str) -> None:
    out = -1.0 if side == "Right" else 1.0
    hanging = turned("x", -90.0 * out)
    np.testing.assert_allclose(angles(f"j{side}Shoulder", NONE, hanging, sequence), 0.0, atol=1e-9)
    for lift in (30.0, 75.0):
        np.testing.assert_allclose(
            angles(f"j{side}Shoulder", NONE, turned("x", (lift - 90.0) * out), sequence),
            [lift, 0.0, 0.0],
            atol=1e-9,
        )


@pytest.mark.parametrize("side", ["Right", "Left"])
def test_bending_forward_is_positive_flexion_except_where_joints_bend_back(side: str) -> None:
    out = -1.0 if side == "Right" else 1.0
    # Every joint here turned by 30 degrees in the sagittal plane, forward where it can.
    np.testing.assert_allclose(angles(f"j{side}Hip", NONE, turned("y", -30)), [0, 0, 30], atol=1e-9)
    np.testing.assert_allclose(angles(f"j{side}Knee", NONE, turned("y", 30)), [0, 0, 30], atol=1e-9)
    np.testing.assert_allclose(
        angles(f"j{side}Ankle", NONE, turned("y", -30)), [0, 0, 30], atol=1e-9
    )
    arm = turned("x", -90.0 * out)
    np.testing.assert_allclose(
        angles(f"j{side}Shoulder", NONE, turned("y", -30) * arm), [0, 0, 30], atol=1e-9
    )
    # A forearm bent in the T-pose, palm down, is bent about the vertical and pronated by 90
    # degrees.
    bent = angles(f"j{side}Elbow", NONE, turned("z", -30 * out))
    assert bent[2] == pytest.approx(30.0)
    assert abs(bent[1]) == pytest.approx(90.0)


def test_spine_angles_are_forward_and_to_the_right() -> None:
    np.testing.assert_allclose(angles("jL5S1", NONE, turned("y", 20)), [0, 0, 20], atol=1e-9)
    np.testing.assert_allclose(angles("jL5S1", NONE, turned("x", 15)), [15, 0, 0], atol=1e-9)
    np.testing.assert_allclose(angles("jL5S1", NONE, turned("z", 25)), [0, 25, 0], atol=1e-9)


@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.parametrize("sequence", ["ZXY", "XZY"])
def test_against_an_independent_decomposition(joint: str, sequence: str) -> None:
    """Sizes of the angles by scipy's Euler angles in ISB axes; signs are tested above."""
    rng = np.random.default_rng(JOINTS.index(joint))
    child = SEGMENT_OF_JOINT[joint]
    pair = [Rotation.from_rotvec(rng.uniform(-0.6, 0.6, (20, 3))) for _ in range(2)]
    isb = [
        turns * (Rotation.from_quat(HANGING_ARM_AXES[s]) if s in HANGING_ARM_AXES else NONE)
        for s, turns in zip((PARENT_SEGMENT[child], child), pair, strict=True)
    ]
    between = (isb[0].inv() * isb[1]).as_matrix()
    x, y, z = np.eye(3)[0], np.eye(3)[2], -np.eye(3)[1]
    axes = np.stack([x, y, z], axis=1)
    euler = Rotation.from_matrix(axes.T @ between @ axes).as_euler(sequence, degrees=True)
    order = [sequence.index("X"), sequence.index("Y"), sequence.index("Z")]
    got = mvn_joint_angles_deg(joint, pair[0].as_quat(), pair[1].as_quat(), sequence)
    np.testing.assert_allclose(np.abs(got), np.abs(euler[:, order]), atol=1e-9)
