"""The column map: a JSON file in which a user says what the columns of a CSV or .mat file hold.

Every name in it is a column of a CSV file, or a row of a matrix in a .mat file: ``joints.q[2]`` is
the second row of ``q`` in the struct ``joints``. A minus sign before a name turns its sign. Where
three columns are wanted a .mat matrix may be named as a whole.
"""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal, NoReturn

from human.readers.axes import UNITS_M
from human.readers.errors import MalformedRecordingError, UnsafeRecordingError

_LARGEST_BYTES = 1 << 22
_KEYS = ("time", "rate_hz", "time_unit", "up", "units", "markers", "joints", "base", "standing_on",
         "plates", "accelerometers", "wrenches", "delimiter", "decimal",
         "header_line")  # fmt: skip
#: What one unit of the file is in SI units, by kind.
_UNITS: Mapping[str, Mapping[str, float]] = {
    "length": UNITS_M,
    "angle": {"rad": 1.0, "deg": math.pi / 180.0},
    "force": {"N": 1.0, "kN": 1000.0},
    "moment": {"N m": 1.0, "N cm": 0.01, "N mm": 0.001},
    "acceleration": {"m/s^2": 1.0, "mm/s^2": 0.001, "g": 9.80665},
}
_TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}

Columns = tuple[str, ...]
#: What may stand in a file of its own.
TablePart = Literal["markers", "plates", "joints"]
_PART_OF: Mapping[str, TablePart] = {
    "markers": "markers", "plates": "plates", "joints": "joints", "base": "joints",
    "standing_on": "joints", "accelerometers": "joints", "wrenches": "joints",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class JointColumns:
    """Columns of one joint's angle and, where logged, of its rate and acceleration.

    A number instead of a column is an angle that the joint keeps.
    """

    position: str | float
    velocity: str | None = None
    acceleration: str | None = None


@dataclass(frozen=True, slots=True)
class PlateColumns:
    """Columns of a force plate: with ``point`` the moment acts there, else about ``origin``."""

    force: Columns
    moment: Columns
    point: Columns | None
    origin: tuple[float, ...] | None


@dataclass(frozen=True, slots=True)
class ColumnMap:
    """What the columns hold; see `read_column_map`.

    Attributes:
        source: name of the map's file, for messages.
        time: column of the time, or None: then frames follow each other at ``rate_hz``.
        rate_hz: frame rate, or None.
        time_s: seconds in a unit of the time column.
        up: vertical axis of the file, or None.
        units: kind to SI value of the file's unit, as far as stated.
        markers: columns of each marker, or a pattern with ``{name}`` and ``{axis}``.
        joints: by name.
        base: seven columns, or None.
        standing_on: segment that stays where it is, level, and its place (m, z up), or None.
        plates: by name.
        accelerometers: frame and columns, by name.
        wrenches: frame and six columns, by name.
        delimiter: of a CSV file; None: told by its header.
        decimal: mark of a CSV file.
        header_line: line of a CSV file, from 1, with the column names.
        usual_up: vertical axis to take, with a warning, where nothing tells; of a known format.
    """

    source: str
    time: str | None
    rate_hz: float | None
    time_s: float = 1.0
    up: str | None = None
    units: Mapping[str, float] = field(default_factory=dict)
    markers: Mapping[str, Columns] | str | None = None
    joints: Mapping[str, JointColumns] = field(default_factory=dict)
    base: Columns | None = None
    standing_on: tuple[str, tuple[float, ...]] | None = None
    plates: Mapping[str, PlateColumns] = field(default_factory=dict)
    accelerometers: Mapping[str, tuple[str, Columns]] = field(default_factory=dict)
    wrenches: Mapping[str, tuple[str, Columns]] = field(default_factory=dict)
    delimiter: str | None = None
    decimal: str = "."
    header_line: int = 1
    usual_up: str | None = None

    def unit(self, kind: str) -> float:
        """Returns the SI value of the file's unit of a kind.

        Raises:
            MalformedRecordingError: the map does not state it; units are never guessed.
        """
        if kind not in self.units:
            raise MalformedRecordingError(
                f"{self.source}, units", f'"{kind}": one of {", ".join(_UNITS[kind])}', "nothing",
                "Lengths, angles, forces and moments need a stated unit.",
            )  # fmt: skip
        return self.units[kind]

    def only(self, *parts: TablePart) -> "ColumnMap":
        """Returns the map without what stands in other files.

        Raises:
            MalformedRecordingError: nothing is left.
        """
        empty = ColumnMap(self.source, self.time, self.rate_hz)
        gone = [one.name for one in fields(self) if _PART_OF.get(one.name, parts[0]) not in parts]
        out = replace(self, **{name: getattr(empty, name) for name in gone})
        if out.markers is None and set(out.columns()) <= {out.time}:
            raise MalformedRecordingError(f"{self.source}", " or ".join(parts), "none")
        return out

    def columns(self) -> Iterator[str]:
        """Yields every column that is named, markers given by a pattern left out."""
        if self.time is not None:
            yield self.time
        if self.markers is not None and not isinstance(self.markers, str):
            for columns in self.markers.values():
                yield from columns
        for joint in self.joints.values():
            named = (joint.position, joint.velocity, joint.acceleration)
            yield from (column for column in named if isinstance(column, str))
        yield from self.base or ()
        for plate in self.plates.values():
            yield from (*plate.force, *plate.moment, *(plate.point or ()))
        for _, columns in (*self.accelerometers.values(), *self.wrenches.values()):
            yield from columns


def read_column_map(path: Path) -> ColumnMap:
    """Reads a column map.

    ``time`` (a column) or ``rate_hz``; ``up``; ``units`` by kind (length, angle, force, moment,
    acceleration); ``markers``: ``{"RASI": ["RASI_x", "RASI_y", "RASI_z"]}`` or one pattern such as
    ``"{name}_{axis}"``; ``joints``: name to column, to ``position``, ``velocity``,
    ``acceleration``, or to the angle that it keeps; ``base``: seven columns, position and
    quaternion xyzw; without it ``standing_on``: a ``segment`` that stays level at a ``position``
    (m, z up); ``plates``: ``force`` and ``moment`` with the ``origin`` that it is taken about, or
    with the ``point`` of application;
    ``accelerometers``: ``columns`` and ``frame``; ``wrenches``: ``force``, ``moment``, ``frame``.

    Raises:
        MalformedRecordingError: not JSON, an unknown key or unit, or a value of another shape.
    """
    if path.stat().st_size > _LARGEST_BYTES:
        raise UnsafeRecordingError(path.name, "less than 4 MiB", f"{path.stat().st_size} bytes")
    try:
        content = json.loads(path.read_bytes())
    except (ValueError, RecursionError) as problem:
        raise MalformedRecordingError(path.name, "JSON", str(problem)[:120]) from problem
    return _Reader(path.name).column_map(content)


class _Reader:
    """Checks each value and says where in the map it stands."""

    def __init__(self, source: str) -> None:
        self._source = source

    def _refuse(self, place: str, expected: str, got: object) -> NoReturn:
        raise MalformedRecordingError(f"{self._source}, {place}", expected, repr(got)[:80])

    def column_map(self, content: Any) -> ColumnMap:
        found = self._object(content, "column map", _KEYS)
        time, rate = found.get("time"), found.get("rate_hz")
        if (time is None) == (rate is None):
            self._refuse("time", "either the time's column or rate_hz", time)
        if rate is not None and not (isinstance(rate, int | float) and 0 < rate < 1e6):
            self._refuse("rate_hz", "a positive rate", rate)
        markers = found.get("markers")
        if isinstance(markers, str):
            if markers.count("{name}") != 1 or markers.count("{axis}") != 1:
                self._refuse("markers", "a pattern with {name} and {axis}", markers)
        elif markers is not None:
            markers = {
                name: self._columns(columns, f"markers, {name}", 3)
                for name, columns in self._object(markers, "markers").items()
            }
        unit = found.get("time_unit", "s")
        delimiter = found.get("delimiter")
        if unit not in _TIME_UNITS:
            self._refuse("time_unit", f"one of {', '.join(_TIME_UNITS)}", unit)
        if delimiter not in (None, ",", ";", "\t", " "):
            self._refuse("delimiter", "a comma, semicolon, tab or space", delimiter)
        decimal = found.get("decimal", ".")
        if decimal not in (".", ","):
            self._refuse("decimal", "a point or a comma", decimal)
        header = found.get("header_line", 1)
        if not isinstance(header, int) or not 1 <= header <= 1000:
            self._refuse("header_line", "a line from 1 to 1000", header)
        out = ColumnMap(
            source=self._source, time=None if time is None else self._text(time, "time"),
            rate_hz=None if rate is None else float(rate), time_s=_TIME_UNITS[unit],
            up=None if found.get("up") is None else self._text(found["up"], "up"),
            units=self._units(found.get("units", {})), markers=markers,
            joints={n: self._joint(v, f"joints, {n}") for n, v in
                    self._object(found.get("joints", {}), "joints").items()},
            base=self._base(found.get("base")),
            standing_on=self._standing(found.get("standing_on"), "base" in found),
            plates={n: self._plate(v, f"plates, {n}") for n, v in
                    self._object(found.get("plates", {}), "plates").items()},
            accelerometers={
                n: self._accelerometer(v, f"accelerometers, {n}")
                for n, v in self._object(found.get("accelerometers", {}), "accelerometers").items()
            },
            wrenches={n: self._wrench(v, f"wrenches, {n}") for n, v in
                      self._object(found.get("wrenches", {}), "wrenches").items()},
            delimiter=delimiter, decimal=decimal, header_line=header,
        )  # fmt: skip
        if out.markers is None and set(out.columns()) <= {out.time}:
            self._refuse(
                "column map", "markers, joints, plates, accelerometers or wrenches", "none"
            )
        return out

    def _object(
        self, value: Any, place: str, keys: tuple[str, ...] | None = None
    ) -> dict[str, Any]:
        if not isinstance(value, dict):
            self._refuse(place, "an object", value)
        unknown = [key for key in value if keys is not None and key not in keys]
        if unknown:
            self._refuse(place, f"keys among {', '.join(keys or ())}", unknown[0])
        return value

    def _text(self, value: Any, place: str) -> str:
        if not isinstance(value, str) or not value.strip():
            self._refuse(place, "a name", value)
        return value

    def _columns(self, value: Any, place: str, count: int) -> Columns:
        if isinstance(value, str) and value.strip():
            return tuple(f"{value}[{k}]" for k in range(1, count + 1))
        if not isinstance(value, list) or len(value) != count:
            self._refuse(place, f"{count} columns", value)
        return tuple(self._text(name, place) for name in value)

    def _units(self, value: Any) -> dict[str, float]:
        out = {}
        for kind, unit in self._object(value, "units", tuple(_UNITS)).items():
            if not isinstance(unit, str) or unit not in _UNITS[kind]:
                self._refuse(f"units, {kind}", f"one of {', '.join(_UNITS[kind])}", unit)
            out[kind] = _UNITS[kind][unit]
        return out

    def _joint(self, value: Any, place: str) -> JointColumns:
        if isinstance(value, str):
            return JointColumns(self._text(value, place))
        if isinstance(value, int | float) and math.isfinite(value):
            return JointColumns(float(value))
        keys = ("position", "velocity", "acceleration")
        found = {k: self._text(v, place) for k, v in self._object(value, place, keys).items()}
        if "position" not in found:
            self._refuse(place, "a column for the position", value)
        return JointColumns(found["position"], found.get("velocity"), found.get("acceleration"))

    def _base(self, value: Any) -> Columns | None:
        if value is None:
            return None
        found = self._object(value, "base", ("position", "orientation_xyzw"))
        return (
            *self._columns(found.get("position"), "base, position", 3),
            *self._columns(found.get("orientation_xyzw"), "base, orientation_xyzw", 4),
        )

    def _plate(self, value: Any, place: str) -> PlateColumns:
        found = self._object(value, place, ("force", "moment", "point", "origin"))
        point, origin = found.get("point"), found.get("origin")
        if (point is None) == (origin is None):
            self._refuse(place, "either the origin or the columns of the point", value)
        return PlateColumns(
            force=self._columns(found.get("force"), f"{place}, force", 3),
            moment=self._columns(found.get("moment"), f"{place}, moment", 3),
            point=None if point is None else self._columns(point, f"{place}, point", 3),
            origin=None if origin is None else self._numbers(origin, f"{place}, origin"),
        )

    def _numbers(self, value: Any, place: str) -> tuple[float, ...]:
        if not (
            isinstance(value, list)
            and len(value) == 3
            and all(isinstance(x, int | float) and math.isfinite(x) for x in value)
        ):
            self._refuse(place, "three numbers", value)
        return tuple(map(float, value))

    def _standing(self, value: Any, with_base: bool) -> tuple[str, tuple[float, ...]] | None:
        if value is None:
            return None
        found = self._object(value, "standing_on", ("segment", "position"))
        if with_base:
            self._refuse("standing_on", "either it or the base", "both")
        position = self._numbers(found.get("position"), "standing_on, position")
        return self._text(found.get("segment"), "standing_on, segment"), position

    def _accelerometer(self, value: Any, place: str) -> tuple[str, Columns]:
        found = self._object(value, place, ("columns", "frame"))
        columns = self._columns(found.get("columns"), f"{place}, columns", 3)
        return self._text(found.get("frame"), f"{place}, frame"), columns

    def _wrench(self, value: Any, place: str) -> tuple[str, Columns]:
        found = self._object(value, place, ("force", "moment", "frame"))
        force = self._columns(found.get("force"), f"{place}, force", 3)
        moment = self._columns(found.get("moment"), f"{place}, moment", 3)
        return self._text(found.get("frame"), f"{place}, frame"), (*force, *moment)
