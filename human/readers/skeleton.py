"""The skeleton of a file, brought to the T-pose axes of the house."""

from collections.abc import Container, Mapping

import numpy as np
from numpy.typing import NDArray

from human.names import PARENT_SEGMENT, SEGMENTS
from human.rotations import rotation_vector_to_matrix

Array = NDArray[np.float64]

_DOWN, _RIGHT, _LEFT = (0.0, 0.0, -1.0), (0.0, -1.0, 0.0), (0.0, 1.0, 0.0)
#: Direction of a long bone in its own axes, which is where it points in the T-pose.
T_POSE_DIRECTION: Mapping[str, tuple[float, float, float]] = {
    "RightUpperArm": _RIGHT, "RightForeArm": _RIGHT, "LeftUpperArm": _LEFT, "LeftForeArm": _LEFT,
    "RightUpperLeg": _DOWN, "RightLowerLeg": _DOWN, "LeftUpperLeg": _DOWN, "LeftLowerLeg": _DOWN,
}  # fmt: skip
#: Long bone to the segment at its far end.
DISTAL: Mapping[str, str] = {
    side + bone: side + end
    for side in ("Right", "Left")
    for bone, end in (("UpperArm", "ForeArm"), ("ForeArm", "Hand"), ("UpperLeg", "LowerLeg"),
                      ("LowerLeg", "Foot"))
}  # fmt: skip


def present_parent(segment: str, present: Container[str]) -> str | None:
    """Returns the nearest house ancestor of a segment that a file has, None for the pelvis."""
    parent = PARENT_SEGMENT.get(segment)
    while parent is not None and parent not in present:
        parent = PARENT_SEGMENT.get(parent)
    return parent


def shortest_turn(source: Array, target: Array) -> Array:
    """Returns the rotation matrix of least angle that takes the direction ``source`` to ``target``.

    Both are ``(3,)``, of any length, not opposite (opposite ones give a half turn about an axis
    normal to them).
    """
    a, b = source / np.linalg.norm(source), target / np.linalg.norm(target)
    axis = np.cross(a, b)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        normal = np.cross(a, np.eye(3)[int(np.argmin(np.abs(a)))])
        axis, sine = (np.zeros(3), 1.0) if a @ b > 0 else (normal, float(np.linalg.norm(normal)))
    angle = float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
    return rotation_vector_to_matrix(axis / sine * angle)


def t_pose_positions(joint_offset: Mapping[str, Array]) -> dict[str, Array]:
    """Returns the segment origins in the T-pose, pelvis at the origin; m, house axes."""
    present = {"Pelvis", *joint_offset}
    positions = {"Pelvis": np.zeros(3)}
    for segment in SEGMENTS[1:]:
        if segment in joint_offset:
            parent = present_parent(segment, present)
            positions[segment] = positions[parent or "Pelvis"] + joint_offset[segment]
    return positions


def stature(
    joint_offset: Mapping[str, Array],
    end_offset: Mapping[str, Array],
    landmarks: Mapping[str, Mapping[str, Array]] | None = None,
) -> float:
    """Returns the height of the skeleton standing in T-pose: highest minus lowest known point."""
    origins = t_pose_positions(joint_offset)
    heights = [position[2] for position in origins.values()]
    heights += [origins[s][2] + tip[2] for s, tip in end_offset.items() if s in origins]
    for segment, points in (landmarks or {}).items():
        if segment in origins:
            heights += [origins[segment][2] + point[2] for point in points.values()]
    return float(max(heights) - min(heights))
