"""Reads a BVH file into a `Recording`: names, axes and units resolved, orientations to the T-pose.

BVH gives no units, no axes and no anatomy: a joint's axes are the file's world axes in whatever
pose the skeleton rests in. The house wants segment axes parallel to the world's in the T-pose, so
upper arms, forearms, thighs and shanks that rest in another direction are turned by the shortest
rotation; trunk, feet and everything that rests within a few degrees of it keep the file's axes.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from human.names import BASE_SEGMENT
from human.readers.axes import axis_name, body_axes, metres_per_unit, world_axes
from human.readers.bvh_file import BvhFile, parse_bvh
from human.readers.bvh_names import NamedSkeleton, name_skeleton
from human.readers.checks import (
    errors_first,
    find_jumps,
    find_reversed_sides,
    relative,
    step_angles,
)
from human.readers.errors import MalformedRecordingError
from human.readers.skeleton import (
    DISTAL,
    T_POSE_DIRECTION,
    present_parent,
    shortest_turn,
    stature,
)
from human.recording import Finding, ReadingReport, RecordedSubject, Recording, Status
from human.rotations import (
    matrix_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_rotate,
)

Array = NDArray[np.float64]

#: A rest pose within this of the T-pose is anatomy (a carrying angle, a kyphosis), not another rest
#: pose.
_REST_TOLERANCE_RAD = np.deg2rad(12.0)
_STILL_RAD = 1e-5
#: First frame taken for a rest pose: this far from the second, and this many times the later steps.
_JUMP_RAD = np.deg2rad(20.0)
_JUMP_M = 0.10
_JUMP_RATIO = 4.0


def read_bvh(path: Path, digest: str, units: str | None = None, up: str | None = None) -> Recording:
    """Reads a BVH file.

    Args:
        path: the file.
        digest: its SHA-256, kept with the recording.
        units: a key of `human.readers.axes.UNITS_M`; None to decide by the skeleton's stature.
        up: ``x``, ``y``, ``z`` or with a minus; None to decide by rest skeleton and frames.

    Raises:
        RecordingFileError: see the subclasses in `human.readers.errors`.
    """
    bvh = parse_bvh(path)
    named = name_skeleton(bvh.joints, path.name)
    names = tuple(named.joint_of)
    quat, position = _file_kinematics(bvh, tuple(named.joint_of.values()), path.name)
    rest = _rest_positions(bvh)
    at = {name: rest[index] for name, index in named.joint_of.items()}

    feet = 0.5 * (at["RightFoot"] + at["LeftFoot"])
    left = (at["LeftUpperLeg"] - at["RightUpperLeg"]) + (at["LeftUpperArm"] - at["RightUpperArm"])
    body = body_axes(at["Head"], feet, left, f"{path.name}, rest skeleton")
    trunk = position[:, names.index("Head")] - 0.5 * (
        position[:, names.index("RightFoot")] + position[:, names.index("LeftFoot")]
    )
    trunk /= np.maximum(np.linalg.norm(trunk, axis=-1, keepdims=True), 1e-12)
    forward = quaternion_rotate(quat[0, names.index("Pelvis")], body[0])
    world, why_up = world_axes(trunk, body, forward, up, f"{path.name}, frames")

    turns, turned = _t_pose_turns(at, body)
    joint_offset, end_offset = _offsets(bvh, named, rest, body, turns)
    metres, why_units = metres_per_unit(
        stature(joint_offset, end_offset), units, named.style, f"{path.name}, skeleton"
    )
    joint_offset = {name: offset * metres for name, offset in joint_offset.items()}
    end_offset = {name: offset * metres for name, offset in end_offset.items()}

    turn_quat = matrix_to_quaternion(np.stack([turns[name] for name in names]))
    house = quaternion_multiply(matrix_to_quaternion(world), quat)
    house = quaternion_multiply(
        house, quaternion_multiply(quaternion_conjugate(matrix_to_quaternion(body)), turn_quat)
    )
    position = position @ world.T * metres
    time_s = np.arange(len(house), dtype=np.float64) * bvh.frame_time_s

    findings: list[Finding] = []
    if _starts_with_rest_pose(house, position[:, 0]):
        degrees = np.rad2deg(step_angles(house[:2])[0])
        findings.append(
            Finding(
                "first-frame", "note", "frame 0",
                f"Frame 0 is a reference pose ({degrees:.0f} deg from frame 1): left out of the "
                "motion.",
            )
        )  # fmt: skip
        time_s, house, position = time_s[1:], house[1:], position[1:]
    still = _still_segments(house, names)
    if still:
        findings.append(
            Finding(
                "still-segments", "note", "frames",
                f"Never move against their parents, so probably not measured: {', '.join(still)}.",
            )
        )  # fmt: skip
    findings += find_jumps(time_s, house, position[:, names.index(BASE_SEGMENT)])
    findings += find_reversed_sides(house, names, joint_offset, end_offset)

    conversions = [
        f"world axes: file {axis_name(world[0])} to x, {axis_name(world[1])} to y, "
        f"{axis_name(world[2])} to z, heading untouched; {why_up}",
        why_units,
        "angles from degrees to radians",
        *bvh.findings,
        *turned,
    ]
    if named.merged:
        conversions.append(
            "joints without a segment of their own, their rotation carried on to the next: "
            + ", ".join(named.merged)
        )
    status: dict[str, Status] = {n: "unmeasured" if n in still else "measured" for n in names}
    return Recording(
        source=path.name,
        format="bvh",
        version=f"{named.style} skeleton",
        time_s=time_s,
        rate_hz=1.0 / bvh.frame_time_s,
        segment_names=names,
        orientation_xyzw=house,
        position=position,
        joint_offset=joint_offset,
        end_offset=end_offset,
        landmarks={},
        joint_angle_deg=None,
        joint_angle_xzy_deg=None,
        joint_angle_names=(),
        foot_contacts=None,
        foot_contact_names=(),
        segment_status=status,
        subject=RecordedSubject("", stature(joint_offset, end_offset)),
        report=ReadingReport(
            conversions=tuple(conversions),
            aliases={bvh.joints[index].name: name for name, index in named.joint_of.items()},
            findings=errors_first(findings),
            channels={"root position": 3, "joint rotations": 3 * len(bvh.joints)},
        ),
        digest=digest,
    )


def _rest_positions(bvh: BvhFile) -> Array:
    rest = np.zeros((len(bvh.joints), 3))
    for k, joint in enumerate(bvh.joints):
        if joint.parent >= 0:
            rest[k] = rest[joint.parent] + joint.offset
    return rest


def _file_kinematics(bvh: BvhFile, wanted: tuple[int, ...], file_name: str) -> tuple[Array, Array]:
    """World orientation and position of the wanted joints, in the file's axes and units.

    A joint's rotation is the product of its channels in the order they are listed; position
    channels, where a joint has them, replace its offset.
    """
    root = bvh.joints[0]
    if len(root.channels) < 6:
        raise MalformedRecordingError(
            f"{file_name}, joint {root.name}", "a root with 3 position and 3 rotation channels",
            f"{len(root.channels)} channels",
        )  # fmt: skip
    needed = set(wanted)
    for k in reversed(range(len(bvh.joints))):
        if k in needed and bvh.joints[k].parent >= 0:
            needed.add(bvh.joints[k].parent)
    frames = len(bvh.values)
    quat: dict[int, Array] = {}
    place: dict[int, Array] = {}
    for k, joint in enumerate(bvh.joints):
        if k not in needed:
            continue
        local = np.tile([0.0, 0.0, 0.0, 1.0], (frames, 1))
        offset = np.tile(joint.offset, (frames, 1))
        for i, channel in enumerate(joint.channels):
            axis = "XYZ".index(channel[0])
            value = bvh.values[:, joint.first_channel + i]
            if channel.endswith("position"):
                offset[:, axis] = value
            else:
                half = np.deg2rad(value) / 2.0
                turn = np.zeros((frames, 4))
                turn[:, axis], turn[:, 3] = np.sin(half), np.cos(half)
                local = quaternion_multiply(local, turn)
        if joint.parent < 0:
            quat[k], place[k] = local, offset
        else:
            quat[k] = quaternion_multiply(quat[joint.parent], local)
            place[k] = place[joint.parent] + quaternion_rotate(quat[joint.parent], offset)
    return np.stack([quat[k] for k in wanted], axis=1), np.stack([place[k] for k in wanted], axis=1)


def _t_pose_turns(at: dict[str, Array], body: Array) -> tuple[dict[str, Array], list[str]]:
    """Per segment, the matrix from its T-pose axes to its rest axes (house directions)."""
    turns = {name: np.eye(3) for name in at}
    said: list[str] = []
    for name, direction in T_POSE_DIRECTION.items():
        if name not in at or DISTAL[name] not in at:
            continue
        bone = body @ (at[DISTAL[name]] - at[name])
        target = np.array(direction)
        turn = shortest_turn(target, bone) if np.linalg.norm(bone) > 0 else np.eye(3)
        angle = float(np.arccos(np.clip((np.trace(turn) - 1.0) / 2.0, -1.0, 1.0)))
        if angle > _REST_TOLERANCE_RAD:
            turns[name] = turn
            said.append(
                f"{name} rests {np.rad2deg(angle):.0f} deg from the T-pose: its axes are turned"
            )
    for side in ("Right", "Left"):
        if side + "Hand" in turns:  # a hand is taken to rest in line with its forearm
            turns[side + "Hand"] = turns[side + "ForeArm"]
    return turns, said


def _offsets(
    bvh: BvhFile, named: NamedSkeleton, rest: Array, body: Array, turns: dict[str, Array]
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Joint and end offsets in T-pose axes, file units."""
    joint_offset: dict[str, Array] = {}
    for name, index in named.joint_of.items():
        parent = present_parent(name, named.joint_of)
        if parent is not None:
            joint_offset[name] = (
                turns[parent].T @ body @ (rest[index] - rest[named.joint_of[parent]])
            )
    owner = {index: name for name, index in named.joint_of.items()}
    inner = {present_parent(name, named.joint_of) for name in named.joint_of}
    end_offset: dict[str, Array] = {}
    for k, joint in enumerate(bvh.joints):
        if joint.end_offset is None:
            continue
        segment = k
        while segment not in owner:
            segment = bvh.joints[segment].parent
        name = owner[segment]
        tip = turns[name].T @ body @ (rest[k] + joint.end_offset - rest[segment])
        # Of several fingers the longest makes the hand.
        if name not in inner and np.linalg.norm(tip) > np.linalg.norm(
            end_offset.get(name, np.zeros(3))
        ):
            end_offset[name] = tip
    return joint_offset, end_offset


def _starts_with_rest_pose(quat: Array, root: Array) -> bool:
    """True where frame 0 stands apart from a motion that is continuous afterwards."""
    if len(quat) < 4:
        return False
    turns = step_angles(quat)
    moves = np.linalg.norm(np.diff(root, axis=0), axis=-1)
    later_turn, later_move = (float(np.percentile(steps[1:], 99)) for steps in (turns, moves))
    apart = turns[0] > max(_JUMP_RAD, _JUMP_RATIO * later_turn)
    return bool(apart or moves[0] > max(_JUMP_M, _JUMP_RATIO * later_move))


def _still_segments(quat: Array, names: tuple[str, ...]) -> list[str]:
    if len(quat) < 4:
        return []
    still = []
    for name in names[1:]:
        parent = present_parent(name, names)
        turn = relative(quat, names, parent or "Pelvis", name)
        if np.max(np.linalg.norm(turn - turn[0], axis=-1)) < _STILL_RAD:
            still.append(name)
    return still if len(still) < len(names) - 1 else []
