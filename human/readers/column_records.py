"""Makes markers, force plates and joint logs of named columns, as a column map says."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from human.joint_log import JointLog, LoggedVector
from human.marker_recording import ForcePlate, MarkerRecording, PlateForces
from human.readers.checks import checked_times, errors_first, find_gaps
from human.readers.column_map import ColumnMap, Columns, PlateColumns
from human.readers.errors import MalformedRecordingError, TruncatedRecordingError
from human.readers.marker_axes import resolve_up, up_axis, z_up
from human.recording import Finding, ReadingReport

Array = NDArray[np.float64]

#: A logged rate may differ from the derivative of the logged angle by this share before it is said.
_RATE_MISMATCH = 0.2


@dataclass(frozen=True, slots=True)
class TableRecording:
    """What a CSV or .mat file holds, as far as its column map names it; the rest is None."""

    markers: MarkerRecording | None
    plates: PlateForces | None
    joints: JointLog | None


def with_markers_named(columns: ColumnMap, names: Iterable[str]) -> ColumnMap:
    """Returns the map with its marker pattern spelled out for the columns that there are.

    Raises:
        MalformedRecordingError: no three columns fit the pattern.
    """
    if not isinstance(columns.markers, str):
        return columns
    pattern = re.escape(columns.markers)
    pattern = pattern.replace(re.escape("{name}"), "(?P<name>.+?)")
    pattern = pattern.replace(re.escape("{axis}"), "(?P<axis>[xyzXYZ])")
    found: dict[str, dict[str, str]] = {}
    for name in names:
        match = re.fullmatch(pattern, name)
        if match:
            found.setdefault(match["name"], {})[match["axis"].lower()] = name
    markers = {n: tuple(a[k] for k in "xyz") for n, a in found.items() if len(a) == 3}
    if not markers:
        raise MalformedRecordingError(
            f"{columns.source}, markers", f"columns that fit {columns.markers}", "none"
        )
    return replace(columns, markers=markers)


def records(
    source: str, kind: str, column: Callable[[str], Array], columns: ColumnMap, digest: str
) -> TableRecording:
    """Returns the records that a column map describes.

    Args:
        source: name of the file.
        kind: ``csv`` or ``mat``.
        column: returns a column ``(frames,)`` by its name; NaN where a cell is empty.
        columns: what they hold; its markers by name.
        digest: SHA-256 of the file.

    Raises:
        RecordingFileError: a unit is not stated, times do not increase, or a number is missing
            where there must be one (markers may have gaps).
    """
    table = _Table(source, column)
    time_s = _times(table, columns)
    if len(time_s) < 2:
        raise TruncatedRecordingError(source, "two frames or more", f"{len(time_s)}")
    rate = columns.rate_hz or float(np.round(1.0 / np.median(np.diff(time_s)), 3))
    gaps = find_gaps(time_s, 1.0 / rate)
    markers, up = None, columns.up
    axes = None if up is None else z_up(up_axis(up, f"{columns.source}, up"))
    said = () if up is None else (f"up is {up} as the column map says",)
    if columns.markers is not None and not isinstance(columns.markers, str):
        scale = columns.unit("length")
        raw = np.stack([table.vector(c, 3) for c in columns.markers.values()], axis=1)
        valid = np.all(np.isfinite(raw), axis=-1)
        position = np.where(valid[..., None], scale * raw, 0.0)
        axes, why, findings = resolve_up(
            position,
            valid,
            requested=up,
            stated=None,
            convention=columns.usual_up,
            place=f"{source}, markers",
        )
        said = (why,)
        markers = MarkerRecording(
            source=source, format=kind, version="", time_s=time_s, rate_hz=rate,
            marker_names=tuple(columns.markers), position=position @ axes.T, valid=valid,
            events=(), plates=None,
            report=ReadingReport(
                conversions=(f"lengths times {scale:g} to metres", why), gaps=gaps,
                findings=errors_first(findings), channels={"markers": len(columns.markers)},
            ),
            digest=digest,
        )  # fmt: skip
    plates = None
    if columns.plates:
        if axes is None:
            raise MalformedRecordingError(
                f"{columns.source}, up", "the vertical axis of the plates", "nothing",
                'Write "up": "z" or "up": "y".',
            )  # fmt: skip
        report = ReadingReport(
            conversions=said, gaps=gaps, channels={"plates": len(columns.plates)}
        )
        plates = _plates(table, time_s, columns, axes, report)
    joints = None
    if columns.joints or columns.accelerometers or columns.wrenches:
        joints = _joints(table, time_s, rate, kind, columns, axes, digest)
        joints = replace(joints, report=replace(joints.report, gaps=gaps))
    if markers is not None and plates is not None:
        markers = replace(markers, plates=plates)
    return TableRecording(markers, plates, joints)


class _Table:
    """Columns by name, with their sign; every column must have the frames of the first."""

    def __init__(self, source: str, column: Callable[[str], Array]) -> None:
        self.source = source
        self._column = column
        self._frames: int | None = None

    def column(self, name: str) -> Array:
        sign = -1.0 if name.startswith("-") else 1.0
        values = sign * self._column(name.removeprefix("-"))
        if self._frames is not None and len(values) != self._frames:
            raise MalformedRecordingError(
                f"{self.source}, {name}",
                f"{self._frames} frames as in the others",
                f"{len(values)}",
            )
        self._frames = len(values)
        return values

    def vector(self, columns: Sequence[str], width: int) -> Array:
        return np.stack([self.column(name) for name in columns[:width]], axis=-1)

    def whole(self, columns: Columns) -> Array:
        """Columns in which every number must be there."""
        values = self.vector(columns, len(columns))
        bad = ~np.all(np.isfinite(values), axis=-1)
        if np.any(bad):
            raise MalformedRecordingError(
                f"{self.source}, frame {int(np.argmax(bad))}, {columns[0]} …", "finite numbers",
                f"{int(np.sum(bad))} frames without", "Cut them out or fill them in.",
            )  # fmt: skip
        return values


def _times(table: _Table, columns: ColumnMap) -> Array:
    if columns.time is not None:
        time_s = columns.time_s * table.whole((columns.time,))[:, 0]
        return checked_times(time_s, f"column {columns.time}")
    first = next(columns.columns())
    return np.arange(len(table.column(first))) / float(columns.rate_hz or 1.0)


def _plates(
    table: _Table, time_s: Array, columns: ColumnMap, axes: Array, report: ReadingReport
) -> PlateForces:
    newton, newton_metre = columns.unit("force"), columns.unit("moment")
    metre = columns.unit("length")
    plates, forces, moments = [], [], []
    for name, plate in columns.plates.items():
        force = newton * table.whole(plate.force) @ axes.T
        moment = newton_metre * table.whole(plate.moment) @ axes.T
        origin, moment, height = _about(table, plate, force, moment, metre, axes)
        plates.append(ForcePlate(name, origin, height))
        forces.append(force)
        moments.append(moment)
    force = np.stack(forces, axis=1)
    findings = []
    if np.sum(force[..., 2]) < 0.0:
        findings.append(
            Finding(
                "plates", "warning", "force plates",
                "The forces point down: they act on the plates, not on the person (put a minus "
                "before the columns), or up is wrong.",
            )
        )  # fmt: skip
    return PlateForces(
        time_s, tuple(plates), force, np.stack(moments, axis=1),
        replace(report, findings=errors_first(findings)),
    )  # fmt: skip


def _about(
    table: _Table, plate: PlateColumns, force: Array, moment: Array, metre: float, axes: Array
) -> tuple[Array, Array, float]:
    """Returns the point the moment is taken about, that moment, and the surface's height."""
    if plate.point is None:
        origin = axes @ (metre * np.asarray(plate.origin, dtype=np.float64))
        return origin, moment, float(origin[2])
    pressed = np.any(force != 0.0, axis=-1)
    point = metre * table.vector(plate.point, 3) @ axes.T
    # Where nothing presses there is no point, and programs write none.
    point[~pressed] = 0.0
    if not np.all(np.isfinite(point)):
        raise MalformedRecordingError(
            f"{table.source}, {plate.point[0]} …", "a point wherever there is a force", "none"
        )
    height = float(np.median(point[pressed, 2])) if np.any(pressed) else 0.0
    return np.zeros(3), moment + np.cross(point, force), height


def _joints(
    table: _Table, time_s: Array, rate: float, kind: str, columns: ColumnMap, axes: Array | None,
    digest: str,
) -> JointLog:  # fmt: skip
    radian = columns.unit("angle") if columns.joints else 1.0
    states: list[Array | None] = []
    for quantity in ("position", "velocity", "acceleration"):
        moving = [j for j in columns.joints.values() if isinstance(j.position, str)]
        named = [getattr(joint, quantity) for joint in moving]
        if any(named) and not all(named):
            raise MalformedRecordingError(
                f"{columns.source}, joints", f"a {quantity} of every joint or of none", "some"
            )
        states.append(radian * table.whole(tuple(named)) if any(named) else None)
    position, velocity, acceleration = states
    findings = [] if position is None or velocity is None else _rates(position, velocity, time_s)
    kept = {n: radian * j.position for n, j in columns.joints.items()
            if not isinstance(j.position, str)}  # fmt: skip
    if columns.accelerometers:
        columns.unit("acceleration")
    if columns.wrenches:
        columns.unit("force")
    return JointLog(
        source=table.source, format=kind, time_s=time_s, rate_hz=rate,
        joint_names=tuple(name for name in columns.joints if name not in kept), kept=kept,
        position=np.zeros((len(time_s), 0)) if position is None else position,
        velocity=velocity, acceleration=acceleration,
        base=None if columns.base is None else _base(table, columns, axes),
        standing_on=columns.standing_on,
        accelerometers={
            name: LoggedVector(frame, columns.units["acceleration"] * table.whole(names))
            for name, (frame, names) in columns.accelerometers.items()
        },
        wrenches={
            name: LoggedVector(frame, table.whole(names) * np.repeat(
                [columns.units["force"], columns.unit("moment")], 3))
            for name, (frame, names) in columns.wrenches.items()
        },
        report=ReadingReport(
            conversions=(f"angles times {radian:g} to rad",) if columns.joints else (),
            findings=errors_first(findings), channels={"joints": len(columns.joints)},
        ),
        digest=digest,
    )  # fmt: skip


def _base(table: _Table, columns: ColumnMap, axes: Array | None) -> Array:
    if axes is None or not np.array_equal(axes, np.eye(3)):
        raise MalformedRecordingError(
            f"{columns.source}, base", '"up": "z"', repr(columns.up),
            "The base's axes are those of the model: x forward, y left, z up.",
        )  # fmt: skip
    base = table.whole(columns.base or ())
    norm = np.linalg.norm(base[:, 3:], axis=-1)
    if np.any(np.abs(norm - 1.0) > 1e-3):
        frame = int(np.argmax(np.abs(norm - 1.0)))
        raise MalformedRecordingError(
            f"{table.source}, frame {frame}, base orientation", "a unit quaternion",
            f"norm {norm[frame]:.6g}",
        )  # fmt: skip
    return np.concatenate([columns.unit("length") * base[:, :3], base[:, 3:] / norm[:, None]], 1)


def _rates(position: Array, velocity: Array, time_s: Array) -> list[Finding]:
    """Holds the logged rates against the angles: another frame rate or unit shows there."""
    derived = np.gradient(position, time_s, axis=0)
    power = float(np.sum(derived**2))
    if power == 0.0:
        return []
    ratio = float(np.sum(derived * velocity)) / power
    if abs(ratio - 1.0) <= _RATE_MISMATCH:
        return []
    return [
        Finding(
            "rates", "warning", "joint velocities",
            f"They are {ratio:.3g} times the derivative of the angles: frame rate, unit or sign is "
            "not what the column map says.",
        )
    ]  # fmt: skip
