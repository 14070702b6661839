"""A body of sticks in N-pose, posed by hand-written rotation matrices: no Euler angles."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from human.names import PARENT_SEGMENT, SEGMENTS

Floats = NDArray[np.float64]

#: Proximal joint of each segment from its parent's, in the T-pose, metres; right side.
_OFFSET = {
    "L5": (0, 0, 0.1),
    "L3": (0, 0, 0.1),
    "T12": (0, 0, 0.1),
    "T8": (0, 0, 0.1),
    "Neck": (0, 0, 0.2),
    "Head": (0, 0, 0.1),
    "Shoulder": (0, -0.03, 0.15),
    "UpperArm": (0, -0.14, 0),
    "ForeArm": (0, -0.3, 0),
    "Hand": (0, -0.25, 0),
    "UpperLeg": (0, -0.1, 0),
    "LowerLeg": (0, 0, -0.42),
    "Foot": (0, 0, -0.42),
    "Toe": (0.15, 0, -0.05),
}


@dataclass(frozen=True)
class StickPoses:
    rotation: Floats
    position: Floats


class Sticks:
    """Stands for a model: only the names of its segments are asked for."""

    segment_names = SEGMENTS


def turn(axis: ArrayLike, angle_deg: float) -> Floats:
    """Returns a right-handed rotation about an axis (Rodrigues), ``(3, 3)``."""
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    angle = np.deg2rad(angle_deg)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


FORWARD, LEFT, UP = np.eye(3)
_N_POSE = {"RightUpperArm": turn(FORWARD, 90), "LeftUpperArm": turn(FORWARD, -90)}


def pose(moves: Mapping[str, Floats] | None = None, *, root: Floats | None = None) -> StickPoses:
    """Poses the sticks.

    Args:
        moves: World-axes rotation applied to a segment and all that hangs on it, about its
            proximal joint, from the N-pose; parents are moved after their children.
        root: Rotation of the whole body.
    """
    moves = dict(moves or {})
    rotation: dict[str, Floats] = {}
    position = {"Pelvis": np.array([0.3, -0.2, 1.0])}
    local: dict[str, Floats] = {}
    # A move is written in world axes of the N-pose; carry it into the parent's axes there.
    still: dict[str, Floats] = {}
    for name in SEGMENTS:
        parent = PARENT_SEGMENT.get(name)
        base = still[parent] if parent else np.eye(3)
        still[name] = base @ _N_POSE.get(name, np.eye(3))
        local[name] = base.T @ moves.get(name, np.eye(3)) @ base @ _N_POSE.get(name, np.eye(3))
    for name in SEGMENTS:
        parent = PARENT_SEGMENT.get(name)
        if parent is None:
            rotation[name] = (np.eye(3) if root is None else root) @ local[name]
            continue
        side, part = ("", name)
        for word in ("Right", "Left"):
            if name.startswith(word):
                side, part = word, name.removeprefix(word)
        offset = np.array(_OFFSET[part], dtype=float)
        if side == "Left":
            offset[1] = -offset[1]
        rotation[name] = rotation[parent] @ local[name]
        position[name] = position[parent] + rotation[parent] @ offset
    return StickPoses(
        np.stack([rotation[name] for name in SEGMENTS]),
        np.stack([position[name] for name in SEGMENTS]),
    )


def stack(poses: list[StickPoses]) -> StickPoses:
    """Returns poses one after another along a first axis."""
    return StickPoses(np.stack([p.rotation for p in poses]), np.stack([p.position for p in poses]))
