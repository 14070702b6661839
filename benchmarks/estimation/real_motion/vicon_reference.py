"""The joint moments that Vicon's gait model left in `ktk_walk`'s C3D file."""

from itertools import pairwise
from pathlib import Path

import ezc3d
import numpy as np

from benchmarks.estimation.real_motion.reference import Array, Mask, Reference

_SIDES = {"R": "Right", "L": "Left"}
#: Segment beyond each joint: Vicon's moments are in its axes.
_DISTAL = {"Ankle": "FO", "Knee": "TI", "Hip": "FE"}
#: The first component is positive for the moment of parent on child about the axis to the left,
#: at the knee the other way round (found from the plates' moments about the joints in the file).
_SIGN = {"Ankle": 1.0, "Knee": -1.0, "Hip": 1.0}


def vicon_reference(path: Path) -> Reference:
    """Returns Vicon's moments about the axis of each joint's distal segment that points left.

    Vicon writes a moment wherever it has a plate for the foot or takes the foot to be in the air;
    where the foot stands beside the plates that is wrong. So frames count in which the file holds
    a ground reaction for the foot, or its events say that the foot is off the ground.
    """
    parsed = ezc3d.c3d(str(path))
    parameters = parsed["parameters"]
    labels = parameters["POINT"]["LABELS"]["value"]
    points = {name: parsed["data"]["points"][:3, k].T for k, name in enumerate(labels)}
    header = parsed["header"]["points"]
    frames = len(points[labels[0]])
    time_s = (header["first_frame"] + np.arange(frames)) / header["frame_rate"]
    mass = float(parameters["PROCESSING"]["Bodymass"]["value"][0])
    moment: dict[str, Array] = {}
    axis: dict[str, Array] = {}
    valid: dict[str, Mask] = {}
    for letter, side in _SIDES.items():
        stands = _stands(points[f"{letter}GroundReactionForce"])
        swings = _swings(parameters["EVENT"], side, time_s)
        for part, segment in _DISTAL.items():
            joint = f"j{side}{part}"
            line = points[f"{letter}{segment}L"] - points[f"{letter}{segment}O"]
            line = line / np.linalg.norm(line, axis=1, keepdims=True)
            about = _SIGN[part] * 1e-3 * mass * points[f"{letter}{part}Moment"][:, 0]
            good = np.isfinite(about) & np.all(np.isfinite(line), axis=1) & (stands | swings)
            axis[joint] = np.where(good[:, None], line, [0.0, 1.0, 0.0])
            moment[joint] = np.where(good, about, 0.0)[:, None] * axis[joint]
            valid[joint] = good
    return Reference(
        program="Vicon", trial="walk", mass_kg=mass, time_s=time_s, moment=moment, axis=axis,
        valid=valid, notes=(f"{mass:.1f} kg as the file states",),
    )  # fmt: skip


def _stands(reaction: Array) -> Mask:
    return np.all(np.isfinite(reaction), axis=1) & np.any(reaction != 0.0, axis=1)


def _swings(events: dict[str, dict[str, Array]], side: str, time_s: Array) -> Mask:
    """Frames between a foot's leaving the ground and its next strike."""
    found = zip(
        events["LABELS"]["value"], events["CONTEXTS"]["value"], events["TIMES"]["value"][1],
        strict=True,
    )  # fmt: skip
    mine = sorted((t, label) for label, context, t in found if context == side)
    out = np.zeros(len(time_s), dtype=np.bool_)
    for (left, label), (struck, _) in pairwise(mine):
        if label == "Foot Off":
            out |= (time_s > left) & (time_s < struck)
    return out
