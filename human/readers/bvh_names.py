"""Which house segment each joint of a BVH skeleton moves.

Two spellings are in use, and they clash: `RightShoulder` is the upper arm where there is a
`RightCollar` (Xsens, Poser), and the clavicle where there is a `RightArm` (CMU, MotionBuilder,
Mixamo, Rokoko). The spelling is therefore recognised as a whole, and the spine by its place in the
tree.
"""

from dataclasses import dataclass

from human.names import SEGMENTS
from human.readers.bvh_file import BvhJoint
from human.readers.errors import MalformedRecordingError
from human.readers.skeleton import present_parent

SIDES = ("Right", "Left")

_LIMBS: dict[str, dict[str, str]] = {
    "Xsens": {
        "collar": "Shoulder", "shoulder": "UpperArm", "elbow": "ForeArm", "wrist": "Hand",
        "hip": "UpperLeg", "knee": "LowerLeg", "ankle": "Foot", "toe": "Toe",
    },
    "CMU": {
        "shoulder": "Shoulder", "arm": "UpperArm", "uparm": "UpperArm", "forearm": "ForeArm",
        "lowarm": "ForeArm", "hand": "Hand", "upleg": "UpperLeg", "leg": "LowerLeg",
        "lowleg": "LowerLeg", "foot": "Foot", "toebase": "Toe", "toe": "Toe",
    },
    "segment": {
        "shoulder": "Shoulder", "upperarm": "UpperArm", "forearm": "ForeArm", "hand": "Hand",
        "upperleg": "UpperLeg", "lowerleg": "LowerLeg", "foot": "Foot", "toe": "Toe",
    },
}  # fmt: skip

#: Without these no posture of the whole body can be made.
REQUIRED = ("Head", *(s + part for s in SIDES for part in
            ("UpperArm", "ForeArm", "UpperLeg", "LowerLeg", "Foot")))  # fmt: skip

#: How spine joints, counted from the pelvis, are taken when there are fewer than four.
_SPINE: dict[int, tuple[str, ...]] = {1: ("T8",), 2: ("L5", "T8"), 3: ("L5", "T12", "T8")}


@dataclass(frozen=True, slots=True)
class NamedSkeleton:
    """House segments of a BVH tree.

    Attributes:
        style: the spelling recognised: ``Xsens``, ``CMU`` or ``segment``.
        joint_of: index of the BVH joint that carries each house segment, parents first.
        merged: names of joints without a house segment of their own.
    """

    style: str
    joint_of: dict[str, int]
    merged: tuple[str, ...]


def plain(name: str) -> str:
    """Strips name spaces (``mixamorig:``) and separators, and lowers the case."""
    return "".join(c for c in name.rsplit(":", 1)[-1].lower() if c.isalnum())


def name_skeleton(joints: tuple[BvhJoint, ...], file_name: str) -> NamedSkeleton:
    """Recognises the joints of a tree.

    Raises:
        MalformedRecordingError: limbs or head are missing, or the tree has no spine.
    """
    best: dict[str, int] = {}
    style = ""
    for candidate, parts in _LIMBS.items():
        found = _limbs(joints, parts)
        if len(found) > len(best):
            best, style = found, candidate
    head = [k for k, joint in enumerate(joints) if plain(joint.name) == "head"]
    if head:
        best["Head"] = head[0]
    missing = [name for name in REQUIRED if name not in best]
    if missing:
        raise MalformedRecordingError(
            f"{file_name}, joint tree",
            "the joint names of an Xsens or CMU/MotionBuilder skeleton",
            f"no joint for {', '.join(missing)} among {', '.join(j.name for j in joints)[:300]}",
            "Rename the joints to either spelling.",
        )
    best |= _trunk(joints, best, file_name)
    joint_of = {name: best[name] for name in SEGMENTS if name in best}
    _check_tree(joints, joint_of, file_name)
    used = set(joint_of.values())
    merged = tuple(joint.name for k, joint in enumerate(joints) if k not in used)
    if style == "CMU" and {"lhipjoint", "lowerback"} <= {plain(j.name) for j in joints}:
        style = "CMU (mocap.cs.cmu.edu)"
    return NamedSkeleton(style, joint_of, merged)


def _limbs(joints: tuple[BvhJoint, ...], parts: dict[str, str]) -> dict[str, int]:
    found: dict[str, int] = {}
    for k, joint in enumerate(joints):
        name = plain(joint.name)
        for side in SIDES:
            part = parts.get(name.removeprefix(side.lower()))
            if name.startswith(side.lower()) and part and side + part not in found:
                found[side + part] = k
    return found


def _ancestors(joints: tuple[BvhJoint, ...], index: int) -> list[int]:
    """The joint and its ancestors, root last."""
    chain = [index]
    while joints[chain[-1]].parent >= 0:
        chain.append(joints[chain[-1]].parent)
    return chain


def _trunk(joints: tuple[BvhJoint, ...], limbs: dict[str, int], file_name: str) -> dict[str, int]:
    right, left, head = (
        _ancestors(joints, limbs[n]) for n in ("RightUpperArm", "LeftUpperArm", "Head")
    )
    chest = next(k for k in right if k in set(left))
    spine = [k for k in reversed(_ancestors(joints, chest)) if joints[k].parent >= 0]
    if not spine or chest not in head:
        raise MalformedRecordingError(
            f"{file_name}, joint tree", "arms and head on a spine above the root", "another tree"
        )
    names = _SPINE.get(len(spine), ("L5", "L3", "T12", "T8"))
    # Of a longer spine the top joint is the chest, the others are taken from the pelvis upwards.
    trunk = dict(zip(names[:-1], spine, strict=False)) | {"T8": chest}
    trunk["Pelvis"] = _ancestors(joints, chest)[-1]
    neck = [k for k in reversed(head[1:]) if k not in set(_ancestors(joints, chest))]
    if neck:
        trunk["Neck"] = neck[0]
    return trunk


def _check_tree(joints: tuple[BvhJoint, ...], joint_of: dict[str, int], file_name: str) -> None:
    for segment, index in joint_of.items():
        parent = present_parent(segment, joint_of)
        if parent is not None and joint_of[parent] not in _ancestors(joints, index)[1:]:
            raise MalformedRecordingError(
                f"{file_name}, joint tree",
                f"{joints[index].name} below {joints[joint_of[parent]].name}",
                "it elsewhere in the tree",
            )
