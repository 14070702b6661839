"""Reads an MVNX file into a `Recording`.

Segment axes in MVNX are those of the house: parallel to the world's in the T-pose. One exception is
undone here: in files of version 3 the upper arms, forearms and hands come in axes parallel to the
world's when the arms hang, palms to the thighs. Which of the two a file uses is decided by its own
positions.

Source: axes and angle conventions checked on real files of versions 3 and 4
    (`benchmarks/recordings.py`).
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from human.mvn_angles import HANGING_ARM_AXES
from human.names import BASE_SEGMENT, SEGMENTS, canonical_joint
from human.readers.axes import STATURE_M
from human.readers.checks import (
    checked_times,
    errors_first,
    find_gaps,
    find_jumps,
    find_loose_joints,
    find_reversed_sides,
    unit_quaternions,
)
from human.readers.errors import AmbiguousRecordingError, MalformedRecordingError
from human.readers.mvnx_file import MvnxFile, MvnxFrame, parse_mvnx
from human.readers.skeleton import present_parent, stature
from human.recording import Finding, ReadingReport, RecordedSubject, Recording, Status
from human.rotations import quaternion_conjugate, quaternion_multiply, quaternion_rotate

Array = NDArray[np.float64]

#: Segments that inertial suits have no sensor for and fill in from their neighbours.
_ALWAYS_INTERPOLATED = frozenset({"L5", "L3", "T12", "Neck", "RightToe", "LeftToe"})
_END_POINT = {
    "Head": "pTopOfHead", "RightHand": "pRightTopOfHand", "LeftHand": "pLeftTopOfHand",
    "RightToe": "pRightToe", "LeftToe": "pLeftToe",
}  # fmt: skip


def read_mvnx(
    path: Path, digest: str, units: str | None = None, up: str | None = None
) -> Recording:
    """Reads an MVNX file.

    Args:
        path: the file.
        digest: its SHA-256, kept with the recording.
        units: only ``m`` or None: the format fixes metres.
        up: only ``z`` or None: the format fixes z up.

    Raises:
        RecordingFileError: see the subclasses in `human.readers.errors`.
    """
    for argument, value, fixed in (("units", units, "m"), ("up", up, "z")):
        if value not in (None, fixed):
            raise AmbiguousRecordingError(
                f"argument {argument}",
                f"{fixed!r}, which MVNX fixes",
                repr(value),
                argument,
                "Leave it out.",
            )
    file = parse_mvnx(path)
    indices = {name: k for k, name in enumerate(file.segments) if name in SEGMENTS}
    names = tuple(name for name in SEGMENTS if name in indices)
    _require(file, names, path.name)
    keep = [indices[name] for name in names]
    quat_wxyz = _stack(file, "orientation", 4, path.name)[:, keep]
    quat, notes = unit_quaternions(np.roll(quat_wxyz, -1, axis=-1), names, path.name)
    position = _stack(file, "position", 3, path.name)[:, keep]
    time_s, rate_hz, time_notes = _times(file, path.name)

    joint_offset, aliases = _joint_offsets(file, names, path.name)
    landmarks = {s: p for s, p in file.points.items() if s in names and p}
    quat, arm_note = _arms_to_t_pose_axes(quat, position, names, joint_offset)
    end_offset = {s: landmarks[s][p] for s, p in _END_POINT.items() if p in landmarks.get(s, {})}
    height = stature(joint_offset, end_offset, landmarks)
    if not STATURE_M[0] <= height <= STATURE_M[1]:
        raise MalformedRecordingError(
            f"{path.name}, segments",
            f"a skeleton {STATURE_M[0]}-{STATURE_M[1]} m tall (MVNX is in metres)",
            f"{height:.4g} m", "The file was changed after export, or its points are incomplete.",
        )  # fmt: skip

    findings = find_loose_joints(quat, position, names, joint_offset)
    findings += find_jumps(time_s, quat, position[:, names.index(BASE_SEGMENT)])
    findings += find_reversed_sides(quat, names, joint_offset, end_offset)
    status = _status(file, names)
    unmeasured = [name for name in names if status[name] == "unmeasured"]
    if unmeasured:
        findings.append(
            Finding(
                "unmeasured-segments", "warning", "sensors",
                f"No sensor on or below {', '.join(unmeasured)}: what the file says of them is not "
                "measured.",
            )
        )  # fmt: skip
    if file.reference_frames:
        kinds = ", ".join(f.attributes.get("type", "?") for f in file.reference_frames)
        findings.append(
            Finding(
                "reference-poses",
                "note",
                "frames",
                f"Left out of the motion: reference poses {kinds}.",
            )
        )
    angles, angles_xzy, angle_names = _joint_angles(file)
    contacts = [f.values.get("footContacts") for f in file.frames]
    have_contacts = (
        all(c is not None for c in contacts)
        and len({len(c) for c in contacts if c is not None}) == 1
    )
    return Recording(
        source=path.name,
        format="mvnx",
        version=f"{file.version or 'unstated'} (MVN {file.software or 'unknown'})",
        time_s=time_s,
        rate_hz=rate_hz,
        segment_names=names,
        orientation_xyzw=quat,
        position=position,
        joint_offset=joint_offset,
        end_offset=end_offset,
        landmarks=landmarks,
        joint_angle_deg=angles,
        joint_angle_xzy_deg=angles_xzy,
        joint_angle_names=angle_names,
        foot_contacts=np.stack([c for c in contacts if c is not None]) if have_contacts else None,
        foot_contact_names=tuple(file.contacts) if have_contacts else (),
        segment_status=status,
        subject=RecordedSubject(file.subject.get("label", ""), height),
        report=ReadingReport(
            conversions=(
                "world axes as in the file (z up), heading untouched; lengths in m, as MVNX fixes",
                "quaternions from w x y z to x y z w",
                *notes,
                *time_notes,
                *arm_note,
            ),
            aliases=aliases,
            gaps=find_gaps(time_s, 1.0 / rate_hz),
            findings=errors_first(findings),
            channels=dict(file.channels),
        ),
        digest=digest,
    )


def _require(file: MvnxFile, names: tuple[str, ...], place: str) -> None:
    needed = ("Pelvis", "T8", "Head", "RightUpperArm", "LeftUpperArm")
    missing = [name for name in needed if name not in names]
    if missing:
        raise MalformedRecordingError(
            f"{place}, segments", "the body segments of MVN", f"none called {', '.join(missing)}"
        )


def _stack(file: MvnxFile, element: str, width: int, place: str) -> Array:
    for k, frame in enumerate(file.frames):
        if element not in frame.values:
            raise MalformedRecordingError(
                f"{place}, line {frame.line}, frame {k}", f"an <{element}> element", "none",
                "Export with segment orientation and position.",
            )  # fmt: skip
    return np.stack([frame.values[element].reshape(-1, width) for frame in file.frames])


def _attribute(frame: MvnxFrame, name: str, k: int, place: str) -> float | None:
    text = frame.attributes.get(name)
    if text is None or not text.strip():
        return None
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise MalformedRecordingError(
            f"{place}, line {frame.line}, frame {k}", f"a number as {name}", repr(text[:40])
        )
    return value


def _times(file: MvnxFile, place: str) -> tuple[Array, float, list[str]]:
    """Frame times, s: index over rate where that explains the ms that the file rounds to."""
    rate_text = file.subject.get("frameRate", "")
    try:
        rate = float(rate_text)
    except ValueError:
        rate = float("nan")
    if not (np.isfinite(rate) and 0.1 <= rate <= 10_000):
        raise MalformedRecordingError(
            f"{place}, subject", "a frameRate between 0.1 and 10000 Hz", repr(rate_text[:40])
        )
    stated = [_attribute(f, "time", k, place) for k, f in enumerate(file.frames)]
    index = [_attribute(f, "index", k, place) for k, f in enumerate(file.frames)]
    milliseconds = np.array([value for value in stated if value is not None])
    counts = np.array([value for value in index if value is not None])
    whole = len(milliseconds) == len(stated)
    counted = len(counts) == len(index)
    if whole:
        checked_times(milliseconds / 1000.0, place)
    if counted:
        checked_times(counts / rate, place)
        exact = counts / rate
        if (
            not whole
            or np.max(np.abs((milliseconds - milliseconds[0]) / 1000 - (exact - exact[0])))
            <= 1.01e-3
        ):
            return (
                exact,
                rate,
                [f"times: frame index over {rate:g} Hz (the file rounds them to ms)"],
            )
    if whole:
        return milliseconds / 1000.0, rate, ["times from ms to s, as stated"]
    return (
        np.arange(len(file.frames)) / rate,
        rate,
        [f"no usable times in the file: frames taken {rate:g} Hz apart"],
    )


def _joint_offsets(
    file: MvnxFile, names: tuple[str, ...], place: str
) -> tuple[dict[str, Array], dict[str, str]]:
    """Segment origins in their parents' axes, from the points that the joints connect."""
    aliases: dict[str, str] = {}
    offset: dict[str, Array] = {}
    for label in file.joints:
        joint = canonical_joint(label)
        if joint is not None and joint != label:
            aliases[label] = joint
        ends = [text.partition("/") for text in file.connectors.get(label, [])]
        if len(ends) != 2 or ends[1][0] not in names:
            continue
        (parent, _, upper), (child, _, lower) = ends
        if parent != present_parent(child, names):
            raise MalformedRecordingError(
                f"{place}, joint {label}",
                f"{child} connected to {present_parent(child, names)}",
                parent,
            )
        try:
            offset[child] = file.points[parent][upper] - file.points[child][lower]
        except KeyError as problem:
            raise MalformedRecordingError(
                f"{place}, joint {label}", "points for both connectors", f"no point {problem}"
            ) from None
    lost = [name for name in names[1:] if name not in offset]
    if lost:
        raise MalformedRecordingError(
            f"{place}, joints", "a joint for every segment", f"none for {', '.join(lost)}"
        )
    return offset, aliases


def _arms_to_t_pose_axes(
    quat: Array, position: Array, names: tuple[str, ...], joint_offset: dict[str, Array]
) -> tuple[Array, list[str]]:
    """Undoes the axes of hanging arms where the positions follow from them, not from T-pose axes.

    Both readings are tried on the bones from shoulder to elbow and from elbow to wrist; the one
    that puts the far end where the file has it is taken.
    """
    turned = quat.copy()
    for name, axes in HANGING_ARM_AXES.items():
        if name in names:
            k = names.index(name)
            turned[:, k] = quaternion_multiply(quat[:, k], quaternion_conjugate(axes))
    residual = [0.0, 0.0]
    for child in ("RightForeArm", "LeftForeArm", "RightHand", "LeftHand"):
        if child not in names:
            continue
        parent = present_parent(child, names)
        k = names.index(parent or "Pelvis")
        bone = position[:, names.index(child)] - position[:, k]
        for way, reading in enumerate((quat, turned)):
            along = quaternion_rotate(reading[:, k], joint_offset[child])
            residual[way] += float(np.median(np.linalg.norm(along - bone, axis=-1)))
    if residual[1] < residual[0]:
        return turned, [
            "arm and hand axes from those of hanging arms to those of the T-pose: the positions "
            "follow from the former"
        ]
    return quat, []


def _status(file: MvnxFile, names: tuple[str, ...]) -> dict[str, Status]:
    """A segment without sensor is filled in by MVN if one sits further out, else not measured."""
    if not file.sensors:
        return dict.fromkeys(names, "measured")
    sensed = set(file.sensors)
    carried: set[str] = set()
    for name in reversed(names):
        if name in sensed or name in carried:
            parent = present_parent(name, names)
            if parent is not None:
                carried.add(parent)
    out: dict[str, Status] = {}
    for name in names:
        parent = present_parent(name, names)
        filled = name in carried or (name in _ALWAYS_INTERPOLATED and parent in sensed)
        out[name] = "measured" if name in sensed else "interpolated" if filled else "unmeasured"
    return out


def _joint_angles(file: MvnxFile) -> tuple[Array | None, Array | None, tuple[str, ...]]:
    known = [(k, canonical_joint(label)) for k, label in enumerate(file.joints)]
    keep = [k for k, joint in known if joint is not None]
    names = tuple(joint for _, joint in known if joint is not None)
    out: list[Array | None] = []
    for element in ("jointAngle", "jointAngleXZY"):
        rows = [f.values[element] for f in file.frames if element in f.values]
        whole = len(rows) == len(file.frames)
        out.append(np.stack(rows).reshape(len(rows), -1, 3)[:, keep] if whole else None)
    return out[0], out[1], names if out[0] is not None or out[1] is not None else ()
