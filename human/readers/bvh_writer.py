"""Writes a motion as BVH as Xsens MVN does: its joint names, centimetres, y up, channels Y X Z.

Other programs read it, and so does `human.readers`, which finds the same posture again.
"""

from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from human.kinematics import forward_kinematics
from human.model import HumanModel
from human.motion import Motion
from human.names import PARENT_SEGMENT, SEGMENTS
from human.readers.errors import MalformedRecordingError

Array = NDArray[np.float64]

_TRUNK = {"Pelvis": "Hips", "L5": "Chest", "L3": "Chest2", "T12": "Chest3", "T8": "Chest4",
          "Neck": "Neck", "Head": "Head"}  # fmt: skip
_LIMB = {"Shoulder": "Collar", "UpperArm": "Shoulder", "ForeArm": "Elbow", "Hand": "Wrist",
         "UpperLeg": "Hip", "LowerLeg": "Knee", "Foot": "Ankle", "Toe": "Toe"}  # fmt: skip
#: House axes to the file's: y up, z forward, x left.
_FILE = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
_CM = 100.0
_UNEVEN = 1e-3
#: Fallback lengths of the outermost segments (m), for models without shapes.
_TIP_M = {"Head": (0.0, 0.0, 0.17), "RightHand": (0.0, -0.17, 0.0), "LeftHand": (0.0, 0.17, 0.0),
          "RightToe": (0.06, 0.0, -0.014), "LeftToe": (0.06, 0.0, -0.014)}  # fmt: skip


def xsens_name(segment: str) -> str:
    """Returns the joint name that Xsens gives a segment in BVH files."""
    for side in ("Right", "Left"):
        if segment.startswith(side):
            return side + _LIMB[segment.removeprefix(side)]
    return _TRUNK[segment]


def write_bvh(path: str | PathLike[str], model: HumanModel, motion: Motion) -> None:
    """Writes a motion of the 23-segment model.

    The frame time is the median step. As in Xsens files the first frame is a T-pose and the motion
    follows; readers leave it out. A step is kept in the file to 9 digits.

    Args:
        path: where to; overwritten.
        model: with the house's 23 segments.
        motion: evenly sampled.

    Raises:
        MalformedRecordingError: other segments, or uneven times: BVH has no time axis.
    """
    file = Path(path)
    if model.segment_names != SEGMENTS:
        raise MalformedRecordingError(
            file.name, "a model of the 23 segments", f"{len(model.segment_names)}"
        )
    steps = np.diff(motion.time_s)
    step = float(np.median(steps)) if steps.size else 1.0 / 60.0
    if steps.size and np.max(np.abs(steps - step)) > _UNEVEN * step:
        raise MalformedRecordingError(
            file.name, "evenly sampled frames, since BVH has no time axis",
            f"steps from {steps.min():.6g} to {steps.max():.6g} s", "Resample the motion first.",
        )  # fmt: skip
    lines = ["HIERARCHY", *_hierarchy(model)]
    lines += ["MOTION", f"Frames: {len(motion.time_s) + 1}", f"Frame Time: {step:.9f}"]
    rows = np.concatenate([_rows(model, _t_pose(model)), _rows(model, motion.q)])
    lines += [" ".join(f"{value:.6f}" for value in row) for row in rows]
    file.write_text("\n".join(lines) + "\n", encoding="ascii")


def _t_pose(model: HumanModel) -> Array:
    q = model.neutral()
    feet = sum(
        model.offsets[model.joint_names.index(f"jRight{j}")][2] for j in ("Hip", "Knee", "Ankle")
    )
    q[2] = -feet
    return q[None]


def _hierarchy(model: HumanModel) -> list[str]:
    children: dict[str, list[str]] = {name: [] for name in SEGMENTS}
    for name in SEGMENTS[1:]:
        children[PARENT_SEGMENT[name]].append(name)
    out: list[str] = []

    def block(segment: str, depth: int) -> None:
        pad = " " * depth
        root = segment == SEGMENTS[0]
        offset = np.zeros(3) if root else model.offsets[SEGMENTS.index(segment) - 1]
        out.append(f"{pad}{'ROOT' if root else 'JOINT'} {xsens_name(segment)}")
        out.append(pad + "{")
        out.append(f"{pad} OFFSET {_triple(offset)}")
        position = "6 Xposition Yposition Zposition" if root else "3"
        out.append(f"{pad} CHANNELS {position} Yrotation Xrotation Zrotation")
        for child in children[segment]:
            block(child, depth + 1)
        if not children[segment]:
            out.extend(
                [
                    f"{pad} End Site",
                    pad + " {",
                    f"{pad}  OFFSET {_triple(_tip(model, segment))}",
                    pad + " }",
                ]
            )
        out.append(pad + "}")

    block(SEGMENTS[0], 0)
    return out


def _tip(model: HumanModel, segment: str) -> Array:
    """The far end of an outermost segment, twice as far as its centre of mass along its length."""
    fallback = np.array(_TIP_M[segment])
    centre = model.centers_of_mass[SEGMENTS.index(segment)]
    along = fallback / np.linalg.norm(fallback)
    reach = 2.0 * float(centre @ along)
    return along * reach if reach > 0.0 else fallback


def _triple(vector: Array) -> str:
    return " ".join(f"{value:.6f}" for value in _FILE @ vector * _CM)


def _rows(model: HumanModel, q: Array) -> Array:
    """Channels ``(frames, 72)``: root position (cm), then Y X Z angles (deg) of every joint."""
    poses = forward_kinematics(model, q)
    world = _FILE @ poses.rotation @ _FILE.T
    columns: list[Array] = [poses.position[:, 0] @ _FILE.T * _CM]
    for k, name in enumerate(SEGMENTS):  # depth first, the order in which blocks are written
        local = world[:, k]
        if k:
            local = np.swapaxes(world[:, SEGMENTS.index(PARENT_SEGMENT[name])], -1, -2) @ local
        columns.append(_yxz_deg(local))
    return np.concatenate(columns, axis=1)


def _yxz_deg(rotation: Array) -> Array:
    """Angles of ``Ry(p) Rx(r) Rz(s)``, deg; at the singularity the last is zero.

    Derived here: ``R12 = -sin r``, ``R02/R22 = tan p``, ``R10/R11 = tan s``.
    """
    cosine = np.hypot(rotation[:, 0, 2], rotation[:, 2, 2])
    r = np.arctan2(-rotation[:, 1, 2], cosine)
    locked = cosine < 1e-9
    p = np.where(locked, np.arctan2(-rotation[:, 2, 0], rotation[:, 0, 0]),
                 np.arctan2(rotation[:, 0, 2], rotation[:, 2, 2]))  # fmt: skip
    s = np.where(locked, 0.0, np.arctan2(rotation[:, 1, 0], rotation[:, 1, 1]))
    return np.asarray(np.rad2deg(np.stack([p, r, s], axis=-1)))
