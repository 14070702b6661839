import numpy as np
import pytest

from human.joint_limits import joint_limits, joint_limits_table
from human.kinematics import forward_kinematics
from human.names import DOF_NAMES, JOINTS, mirrored
from human.rotations import matrix_to_xyz, rotation_vector_to_matrix


def at(model, **degrees):
    """A configuration with some joint angles in degrees."""
    q = model.neutral()
    for name, value in degrees.items():
        q[7 + model.dof_names.index(name)] = np.deg2rad(value)
    return q


def inside(model, q):
    return bool(np.all((q[7:] >= model.lower) & (q[7:] <= model.upper)))


def test_every_line_names_its_source():
    table = joint_limits_table()
    for joint, axes in table["joints"].items():
        assert joint in JOINTS
        assert set(axes) == {"x", "y", "z"}
        for row in axes.values():
            assert row["source"] in table["sources"]
            assert row["range"][0] < row["range"][1]


def test_left_is_right_mirrored():
    lower, upper = joint_limits(DOF_NAMES)
    for index, name in enumerate(DOF_NAMES):
        twin = DOF_NAMES.index(mirrored(name))
        if name.endswith("roty"):
            assert (lower[index], upper[index]) == (lower[twin], upper[twin])
        elif "Right" in name:
            assert (lower[index], upper[index]) == (-upper[twin], -lower[twin])


def test_t_pose_is_inside(model):
    assert inside(model, model.neutral())


# What the sign of each angle does to the body: angles, segment, its axis, where that then points.
DOWN, FORWARD, UP, RIGHT, LEFT, BACK = (
    np.array(v, dtype=float)
    for v in ([0, 0, -1], [1, 0, 0], [0, 0, 1], [0, -1, 0], [0, 1, 0], [-1, 0, 0])
)
MEANINGS = [
    ("right arm hangs", {"jRightShoulder_rotx": 90}, "RightUpperArm", RIGHT, DOWN),
    ("left arm hangs", {"jLeftShoulder_rotx": -90}, "LeftUpperArm", LEFT, DOWN),
    ("right arm raised", {"jRightShoulder_rotx": -90}, "RightUpperArm", RIGHT, UP),
    ("right arm forward", {"jRightShoulder_rotz": 90}, "RightUpperArm", RIGHT, FORWARD),
    (
        "hanging arm extended back",
        {"jRightShoulder_rotx": 90, "jRightShoulder_rotz": -60},
        "RightUpperArm",
        RIGHT,
        0.5 * DOWN + np.sqrt(0.75) * BACK,
    ),
    ("right elbow bends", {"jRightElbow_rotz": 140}, "RightForeArm", RIGHT, None),
    ("left elbow bends", {"jLeftElbow_rotz": -90}, "LeftForeArm", LEFT, FORWARD),
    ("right palm turns forward", {"jRightElbow_roty": -85}, "RightForeArm", DOWN, None),
    ("right hip flexes", {"jRightHip_roty": -90}, "RightUpperLeg", DOWN, FORWARD),
    (
        "right hip abducts",
        {"jRightHip_rotx": -45},
        "RightUpperLeg",
        DOWN,
        (DOWN + RIGHT) / np.sqrt(2),
    ),
    ("left knee bends", {"jLeftKnee_roty": 90}, "LeftLowerLeg", DOWN, BACK),
    ("right foot points", {"jRightAnkle_roty": 50}, "RightFoot", FORWARD, None),
    ("trunk bends", {"jL5S1_roty": 40, "jL4L3_roty": 40, "jL1T12_roty": 10}, "T8", UP, FORWARD),
]


@pytest.mark.parametrize(("what", "angles", "segment", "axis", "direction"), MEANINGS)
def test_daily_postures_are_inside_and_mean_what_they_say(
    model, what, angles, segment, axis, direction
):
    q = at(model, **angles)
    assert inside(model, q), what
    if direction is not None:
        got = forward_kinematics(model, q).of(segment)[0] @ axis
        np.testing.assert_allclose(got, direction, atol=1e-12)


def either_branch_inside(model, joint, rotation):
    """Whether one of the two x-y-z readings of a joint's rotation is within its limits."""
    first = matrix_to_xyz(rotation)
    a, b, c = first
    turned = np.array([a + np.pi, np.pi - b, c + np.pi])
    dofs = model.joint_dofs(model.joint_names.index(joint))
    lower, upper = model.lower[dofs], model.upper[dofs]
    readings = (first, (turned + np.pi) % (2 * np.pi) - np.pi)
    return any(np.all((reading >= lower) & (reading <= upper)) for reading in readings)


@pytest.mark.parametrize("flexion", [5, 45, 90, 120, 150])
@pytest.mark.parametrize("pronation", [-80, -40, 0, 40, 75])
def test_palm_may_turn_at_any_bend_of_the_elbow(model, flexion, pronation):
    # Clinically the forearm bends about z and then turns about its own y; the model turns x, y, z.
    bend, turn = np.deg2rad([[0, 0, flexion], [0, pronation, 0]])
    rotation = rotation_vector_to_matrix(bend) @ rotation_vector_to_matrix(turn)
    assert either_branch_inside(model, "jRightElbow", rotation)


@pytest.mark.parametrize("flexion", [0, 45, 70, 80, 90, 100, 115])
@pytest.mark.parametrize("abduction", [0, 10, 20])
def test_squats_are_inside(model, flexion, abduction):
    bend, spread = np.deg2rad([[0, -flexion, 0], [-abduction, 0, 0]])
    rotation = rotation_vector_to_matrix(bend) @ rotation_vector_to_matrix(spread)
    assert either_branch_inside(model, "jRightHip", rotation)


@pytest.mark.parametrize(
    "angles",
    [
        {"jRightKnee_roty": -30},
        {"jRightElbow_rotz": -30},
        {"jLeftElbow_rotz": 30},
        {"jRightHip_roty": 60},
        {"jRightShoulder_rotx": 170},
        {"jC1Head_roty": 80},
        {"jL5S1_roty": -60},
    ],
)
def test_broken_bodies_are_outside(model, angles):
    assert not inside(model, at(model, **angles))
