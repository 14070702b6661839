"""What every reader checks before it hands a recording out, whatever the format."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from human.names import JOINT_OF_SEGMENT
from human.readers.errors import MalformedRecordingError
from human.readers.skeleton import present_parent
from human.recording import Finding, Gap
from human.rotations import quaternion_conjugate, quaternion_multiply, quaternion_rotate

Array = NDArray[np.float64]

_REFUSED_NORM = 1e-3
_SAID_NORM = 1e-5
_GAP_STEPS = 1.5
#: A hinge bent less than this says nothing about its direction.
_BENT_SINE = np.sin(np.deg2rad(20.0))
_LEAST_BENT_FRAMES = 3
_REVERSED_SHARE = 0.8
_OFFSET_CLEAR_M = 0.02
_INCONSISTENT_M = 0.03
#: A turn between neighbouring frames beyond both is a jump: radians, and times the usual step.
_JUMP_RAD = np.deg2rad(20.0)
_JUMP_RATIO = 5.0
#: No pelvis moves faster than this: the fastest sprinters reach 12.4 m/s.
_JUMP_M_S = 15.0
_LEAST_FRAMES = 10


def checked_times(time_s: Array, place: str) -> Array:
    """Refuses times that do not strictly increase.

    Raises:
        MalformedRecordingError: with the first offending frame.
    """
    steps = np.diff(time_s)
    bad = np.flatnonzero(~(steps > 0.0))
    if bad.size:
        k = int(bad[0]) + 1
        word = "the same time as" if time_s[k] == time_s[k - 1] else "a time before"
        raise MalformedRecordingError(
            f"{place}, frame {k}", "times that increase from frame to frame",
            f"{time_s[k]:.6g} s, {word} frame {k - 1} ({time_s[k - 1]:.6g} s)",
            "Sort the frames or cut the repeated ones.",
        )  # fmt: skip
    return time_s


def find_gaps(time_s: Array, step_s: float) -> tuple[Gap, ...]:
    """Returns the holes wider than one and a half frame steps."""
    steps = np.diff(time_s)
    return tuple(
        Gap(float(time_s[k]), float(time_s[k + 1]), round(steps[k] / step_s) - 1)
        for k in np.flatnonzero(steps > _GAP_STEPS * step_s)
    )


def unit_quaternions(quat: Array, segments: tuple[str, ...], place: str) -> tuple[Array, list[str]]:
    """Normalises quaternions ``(frames, segments, 4)`` that are unit up to rounding.

    Returns:
        The unit quaternions and, where more than rounding was undone, a sentence saying so.

    Raises:
        MalformedRecordingError: a norm is off by more than a thousandth.
    """
    norm = np.linalg.norm(quat, axis=-1)
    off = np.abs(norm - 1.0)
    if np.max(off) > _REFUSED_NORM:
        frame, segment = np.unravel_index(int(np.argmax(off > _REFUSED_NORM)), off.shape)
        raise MalformedRecordingError(
            f"{place}, frame {frame}, orientation of {segments[int(segment)]}",
            f"a unit quaternion (norm 1 within {_REFUSED_NORM})",
            f"norm {norm[frame, segment]:.6g}", "The file is damaged or holds something else.",
        )  # fmt: skip
    said = int(np.count_nonzero(off > _SAID_NORM))
    notes = [f"{said} quaternions normalised (norm off by up to {np.max(off):.1e})"] if said else []
    return quat / norm[..., None], notes


def relative(quat: Array, names: tuple[str, ...], parent: str, child: str) -> Array:
    """Returns the orientation of a child segment in its parent's axes, ``(frames, 4)`` xyzw."""
    return quaternion_multiply(
        quaternion_conjugate(quat[:, names.index(parent)]), quat[:, names.index(child)]
    )


def find_reversed_sides(
    quat: Array,
    names: tuple[str, ...],
    joint_offset: Mapping[str, Array],
    end_offset: Mapping[str, Array],
) -> list[Finding]:
    """Looks for a mirrored or side-swapped body.

    A body seen in a mirror, or with left and right exchanged, is not a body: its toes point
    backwards, or its knees and elbows bend the wrong way. Each sign is looked for by itself. (A
    mirror image whose sides were renamed as well is a possible body and cannot be told from one.)

    Derived here: in the T-pose axes of the house the toes lie at positive x, the left side at
    positive y; bending a knee takes the shank to negative x, bending an elbow the forearm to
    positive x.

    Args:
        quat: ``(frames, segments, 4)`` world orientations.
        names: the segments.
        joint_offset: segment origins in their parent's axes, m.
        end_offset: far ends of segments in their axes, m.
    """
    signs: list[str] = []
    for side, outward in (("Left", 1.0), ("Right", -1.0)):
        for part in ("UpperLeg", "Shoulder", "UpperArm"):
            offset = joint_offset.get(side + part)
            if offset is not None and outward * offset[1] < -_OFFSET_CLEAR_M:
                signs.append(f"{side + part} lies on the other side of its parent's axes")
        toe = joint_offset.get(side + "Toe", end_offset.get(side + "Foot"))
        if toe is not None and toe[0] < -_OFFSET_CLEAR_M:
            signs.append(f"the {side.lower()} toes point backwards")
        signs += _reversed_hinge(
            quat, names, side + "UpperLeg", side + "LowerLeg", [0, 0, -1], -1.0
        )
        signs += _reversed_hinge(
            quat, names, side + "UpperArm", side + "ForeArm", [0, outward, 0], 1.0
        )
    if not signs:
        return []
    return [
        Finding(
            "sides", "error", "skeleton and frames",
            "Left and right are exchanged or the file is mirrored: " + "; ".join(signs) + ".",
        )
    ]  # fmt: skip


def _reversed_hinge(
    quat: Array, names: tuple[str, ...], parent: str, child: str, bone: list[float], bends_to: float
) -> list[str]:
    if parent not in names or child not in names:
        return []
    ahead = quaternion_rotate(relative(quat, names, parent, child), np.array(bone, dtype=float))[
        :, 0
    ]
    bent = ahead[np.abs(ahead) > _BENT_SINE] * bends_to
    if bent.size < _LEAST_BENT_FRAMES or np.mean(bent < 0) < _REVERSED_SHARE:
        return []
    degrees = np.rad2deg(np.median(np.arcsin(np.clip(-bent, -1, 1))))
    return [f"{JOINT_OF_SEGMENT[child]} bends the wrong way (median {degrees:.0f} deg)"]


def find_loose_joints(
    quat: Array, position: Array, names: tuple[str, ...], joint_offset: Mapping[str, Array]
) -> list[Finding]:
    """Compares the file's positions with what its orientations and skeleton give.

    Raises nothing: a disagreement above 3 cm in the median is an ``inconsistent`` error finding.
    """
    worst: dict[str, float] = {}
    for child, offset in joint_offset.items():
        parent = present_parent(child, names)
        if parent is None:
            continue
        k = names.index(parent)
        there = position[:, k] + quaternion_rotate(quat[:, k], offset)
        distance = np.linalg.norm(there - position[:, names.index(child)], axis=-1)
        worst[child] = float(np.median(distance))
    loose = {name: d for name, d in worst.items() if d > _INCONSISTENT_M}
    if not loose:
        return []
    text = ", ".join(f"{name} {1000 * d:.0f} mm" for name, d in loose.items())
    return [
        Finding(
            "inconsistent", "error", "positions against orientations",
            f"Positions do not follow from orientations and skeleton ({text}): mirrored, or of two "
            "sources.",
        )
    ]  # fmt: skip


def step_angles(quat: Array) -> Array:
    """Returns the largest turn of any segment per step of time, ``(frames - 1,)`` rad."""
    dots = np.abs(np.sum(quat[1:] * quat[:-1], axis=-1))
    return np.asarray(2.0 * np.arccos(np.clip(np.min(dots, axis=-1), 0.0, 1.0)))


def find_jumps(time_s: Array, quat: Array, pelvis: Array) -> list[Finding]:
    """Returns warnings where posture or pelvis jump between neighbouring frames without a gap.

    Args:
        time_s: ``(frames,)``.
        quat: ``(frames, segments, 4)`` world orientations.
        pelvis: ``(frames, 3)`` m.
    """
    return _turning_jumps(time_s, quat) + _moving_jumps(time_s, pelvis)


def _moving_jumps(time_s: Array, pelvis: Array) -> list[Finding]:
    speed = np.linalg.norm(np.diff(pelvis, axis=0), axis=-1) / np.diff(time_s)
    at = np.flatnonzero(speed > _JUMP_M_S)
    if not at.size:
        return []
    shown = ", ".join(f"{time_s[k + 1]:.3f}" for k in at[:5])
    return [
        Finding(
            "jumps", "warning", f"frames before {shown} s",
            f"{at.size} jumps of the pelvis (up to {np.max(speed):.3g} m/s; people stay below "
            f"{_JUMP_M_S:g}): where it is before and after does not fit together.",
        )
    ]  # fmt: skip


def _turning_jumps(time_s: Array, quat: Array) -> list[Finding]:
    if len(quat) < _LEAST_FRAMES:
        return []
    turns = step_angles(quat)
    steps = np.diff(time_s)
    usual = float(np.percentile(turns, 95))
    wide = steps > _GAP_STEPS * np.median(steps)
    at = np.flatnonzero((turns > max(_JUMP_RAD, _JUMP_RATIO * usual)) & ~wide)
    if not at.size:
        return []
    shown = ", ".join(f"{time_s[k + 1]:.3f}" for k in at[:5])
    return [
        Finding(
            "jumps", "warning", f"frames before {shown} s",
            f"{at.size} jumps of the posture between neighbouring frames (up to "
            f"{np.rad2deg(np.max(turns[at])):.0f} deg): velocities there mean nothing.",
        )
    ]  # fmt: skip


def errors_first(findings: list[Finding]) -> tuple[Finding, ...]:
    """Returns findings with the errors first."""
    rank = {"error": 0, "warning": 1, "note": 2}
    return tuple(sorted(findings, key=lambda finding: rank[finding.severity]))


__all__ = [
    "checked_times",
    "errors_first",
    "find_gaps",
    "find_jumps",
    "find_loose_joints",
    "find_reversed_sides",
    "relative",
    "step_angles",
    "unit_quaternions",
]
