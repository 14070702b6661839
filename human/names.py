"""Names of the 23 segments, 22 spherical joints and 66 degrees of freedom of the human model.

Spelling and order are those of the IIT human models (``human-gazebo``), so that a joint torque
computed here can be compared with theirs name by name. Segments are listed depth first: a parent
always stands before its children.

Source: Latella et al. 2019, section 2.3 (67 links, 66 degrees of freedom); Xsens MVN segment set.
"""

from collections.abc import Mapping
from types import MappingProxyType

#: (segment, its proximal joint, its parent segment); the pelvis hangs from the world by the
#: floating base.
_TREE: tuple[tuple[str, str, str], ...] = (
    ("L5", "jL5S1", "Pelvis"),
    ("L3", "jL4L3", "L5"),
    ("T12", "jL1T12", "L3"),
    ("T8", "jT9T8", "T12"),
    ("Neck", "jT1C7", "T8"),
    ("Head", "jC1Head", "Neck"),
    ("RightShoulder", "jRightC7Shoulder", "T8"),
    ("RightUpperArm", "jRightShoulder", "RightShoulder"),
    ("RightForeArm", "jRightElbow", "RightUpperArm"),
    ("RightHand", "jRightWrist", "RightForeArm"),
    ("LeftShoulder", "jLeftC7Shoulder", "T8"),
    ("LeftUpperArm", "jLeftShoulder", "LeftShoulder"),
    ("LeftForeArm", "jLeftElbow", "LeftUpperArm"),
    ("LeftHand", "jLeftWrist", "LeftForeArm"),
    ("RightUpperLeg", "jRightHip", "Pelvis"),
    ("RightLowerLeg", "jRightKnee", "RightUpperLeg"),
    ("RightFoot", "jRightAnkle", "RightLowerLeg"),
    ("RightToe", "jRightBallFoot", "RightFoot"),
    ("LeftUpperLeg", "jLeftHip", "Pelvis"),
    ("LeftLowerLeg", "jLeftKnee", "LeftUpperLeg"),
    ("LeftFoot", "jLeftAnkle", "LeftLowerLeg"),
    ("LeftToe", "jLeftBallFoot", "LeftFoot"),
)

BASE_SEGMENT = "Pelvis"
SEGMENTS: tuple[str, ...] = (BASE_SEGMENT, *(segment for segment, _, _ in _TREE))
JOINTS: tuple[str, ...] = tuple(joint for _, joint, _ in _TREE)
AXES: tuple[str, ...] = ("rotx", "roty", "rotz")
DOF_NAMES: tuple[str, ...] = tuple(f"{joint}_{axis}" for joint in JOINTS for axis in AXES)

#: Parent segment of each segment but the pelvis.
PARENT_SEGMENT: Mapping[str, str] = MappingProxyType({s: p for s, _, p in _TREE})
#: Proximal joint of each segment but the pelvis, and back.
JOINT_OF_SEGMENT: Mapping[str, str] = MappingProxyType({s: j for s, j, _ in _TREE})
SEGMENT_OF_JOINT: Mapping[str, str] = MappingProxyType({j: s for s, j, _ in _TREE})

#: Other spellings of the joints met in MVNX files and other models.
JOINT_ALIASES: Mapping[str, str] = MappingProxyType(
    {
        "jL4S3": "jL4L3",
        "jL1T2": "jL1T12",
        "jRightT4Shoulder": "jRightC7Shoulder",
        "jLeftT4Shoulder": "jLeftC7Shoulder",
    }
)


def canonical_joint(name: str) -> str | None:
    """Returns the house spelling of a joint name, or None if the name is not known."""
    name = JOINT_ALIASES.get(name, name)
    return name if name in SEGMENT_OF_JOINT else None


def mirrored(name: str) -> str:
    """Returns the name of the same part on the other side of the body (midline names stay)."""
    if "Right" in name:
        return name.replace("Right", "Left")
    return name.replace("Left", "Right")
