"""Tables of the MOT and STO kind (OpenSim), and the force plates that such a table can hold.

A header of ``name=value`` lines down to ``endheader``, one line of column names, then numbers.
"""

import re
from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from human.marker_recording import ForcePlate, PlateForces
from human.readers.checks import checked_times, errors_first, find_gaps
from human.readers.errors import (
    MalformedRecordingError,
    TruncatedRecordingError,
)
from human.readers.files import refuse_large
from human.readers.marker_axes import up_axis, z_up
from human.recording import Finding, ReadingReport

Array = NDArray[np.float64]

_MOST_HEADER_LINES = 500
#: ground_force_1_vx, 1_ground_force_px, ground_torque_1_x, ground_force_l_mz, ground_moment_r_my
_PLATE_COLUMN = re.compile(
    r"^(?P<before>.*?)_?ground_(?P<kind>force|torque|moment)_?(?P<after>.*?)_?"
    r"(?P<quantity>[vpm]?)(?P<axis>[xyz])$"
)


@dataclass(frozen=True, slots=True)
class OpenSimTable:
    """A table as it stands in the file.

    Attributes:
        source: file name, without its folder.
        header: the ``name=value`` lines, names in lower case.
        in_degrees: whether rotations are in degrees; None where the header does not say.
        columns: names, time left out.
        time_s: ``(rows,)`` strictly increasing.
        values: ``(rows, columns)`` in the file's units; may hold NaN.
    """

    source: str
    header: dict[str, str]
    in_degrees: bool | None
    columns: tuple[str, ...]
    time_s: Array
    values: Array


def read_opensim_table(path: Path) -> OpenSimTable:
    """Reads a MOT or STO file.

    Raises:
        RecordingFileError: the header does not end, columns do not fit, or times do not increase.
    """
    refuse_large(path)
    with path.open(encoding="utf-8", errors="replace") as stream:
        head = _header(stream)
        if head is None:
            raise TruncatedRecordingError(path.name, "a header that ends in endheader", "none")
        pairs = (line.split("=", 1) for line in head if "=" in line)
        header = {name.strip().lower(): value.strip() for name, value in pairs}
        columns, numbers = _body(stream, len(head) + 1, path.name)
    stated = header.get("nrows", header.get("datarows", ""))
    if stated.isdigit() and len(numbers) < int(stated):
        raise TruncatedRecordingError(path.name, f"{stated} rows as stated", f"{len(numbers)}")
    if not np.all(np.isfinite(numbers[:, 0])):
        raise MalformedRecordingError("column time", "finite times", "others")
    degrees = header.get("indegrees", "").lower()
    return OpenSimTable(
        source=path.name, header=header,
        in_degrees={"yes": True, "no": False}.get(degrees),
        columns=tuple(columns[1:]), time_s=checked_times(numbers[:, 0], "column time"),
        values=numbers[:, 1:],
    )  # fmt: skip


def _header(stream: Iterable[str]) -> list[str] | None:
    """Returns the lines down to ``endheader``, that one included; None where it does not come."""
    lines = []
    for line in islice(stream, _MOST_HEADER_LINES):
        lines.append(line)
        if line.strip().lower() == "endheader":
            return lines
    return None


def _body(stream: Iterable[str], first: int, source: str) -> tuple[list[str], Array]:
    """Returns the names of the columns, time first, and the rows of numbers."""
    columns: list[str] = []
    # An hour of plates is hundreds of megabytes as a list of lists.
    numbers = array("d")
    for number, line in enumerate(stream, first):
        cells = line.split()
        if not cells:
            continue
        if not columns:
            columns = cells
            double = sorted({name for name in columns if columns.count(name) > 1})
            if columns[0].lower() != "time" or double:
                raise MalformedRecordingError(
                    f"line {number}", "time and then each column once",
                    f"{columns[0]!r} first"
                    + (f", {', '.join(double)} more than once" if double else ""),
                )  # fmt: skip
            continue
        if len(cells) != len(columns):
            raise MalformedRecordingError(
                f"line {number}", f"{len(columns)} columns", f"{len(cells)}"
            )
        try:
            numbers.extend(map(float, cells))
        except ValueError as problem:
            raise MalformedRecordingError(f"line {number}", "numbers", repr(line[:40])) from problem
    if not numbers:
        raise TruncatedRecordingError(
            source, "column names and rows", f"{int(bool(columns))} lines"
        )
    return columns, np.frombuffer(numbers, dtype=np.float64).reshape(-1, len(columns))


def plate_forces(table: OpenSimTable, *, up: str = "y") -> PlateForces:
    """Returns the force plates of a table: force (N), its point (m) and torque (N m) per plate.

    The torque of such a table acts at the point; moments here are about the world's origin.

    Args:
        table: as read.
        up: vertical axis of the file; y is OpenSim's.

    Raises:
        RecordingFileError: no plate, a column of one is missing, or a force is not a number.
    """
    axes = z_up(up_axis(up, "argument up"))
    found: dict[str, dict[str, Array]] = {}
    for name, values in zip(table.columns, table.values.T, strict=True):
        match = _PLATE_COLUMN.match(name.lower())
        if match is None:
            continue
        quantity = match["quantity"] or "m"
        if match["kind"] != "force":
            quantity = "m"
        plate = match["before"] + match["after"]
        found.setdefault(plate, {})[quantity + match["axis"]] = values
    if not found:
        raise MalformedRecordingError(
            table.source, "columns such as ground_force_1_vx", f"{', '.join(table.columns[:4])} …"
        )
    plates, forces, moments = [], [], []
    findings: list[Finding] = []
    for number, (key, columns) in enumerate(found.items(), 1):
        name = key or str(number)
        force = _vectors(columns, "v", name, table.source)
        point = _vectors(columns, "p", name, table.source)
        torque = _vectors(columns, "m", name, table.source)
        idle = ~np.any(force != 0.0, axis=-1)
        # Programs write NaN for the point where nothing presses; there the point does not matter.
        point, torque = np.where(idle[:, None], 0.0, point), np.where(idle[:, None], 0.0, torque)
        for what, values in (("force", force), ("point", point), ("torque", torque)):
            if not np.all(np.isfinite(values)):
                row = int(np.argmax(~np.all(np.isfinite(values), axis=-1)))
                raise MalformedRecordingError(
                    f"{table.source}, plate {name}, row {row}", f"a finite {what}", "another"
                )
        force, point, torque = force @ axes.T, point @ axes.T, torque @ axes.T
        height = 0.0 if np.all(idle) else float(np.median(point[~idle, 2]))
        if np.all(idle):
            findings.append(
                Finding("idle-plate", "note", f"plate {name}", "No force in the whole recording.")
            )
        plates.append(ForcePlate(name, np.zeros(3), height))
        forces.append(force)
        moments.append(torque + np.cross(point, force))
    rate = 1.0 / float(np.median(np.diff(table.time_s))) if len(table.time_s) > 1 else 1.0
    return PlateForces(
        time_s=table.time_s, plates=tuple(plates), force=np.stack(forces, axis=1),
        moment=np.stack(moments, axis=1),
        report=ReadingReport(
            conversions=(f"up is {up}", "moments taken about the world's origin"),
            gaps=find_gaps(table.time_s, 1.0 / rate), findings=errors_first(findings),
            channels={"plates": len(plates)},
        ),
    )  # fmt: skip


def _vectors(columns: dict[str, Array], quantity: str, plate: str, source: str) -> Array:
    missing = [quantity + axis for axis in "xyz" if quantity + axis not in columns]
    if missing:
        raise MalformedRecordingError(
            f"{source}, plate {plate}", "force (vx …), point (px …) and torque (mx or torque_x …)",
            f"no {', '.join(missing)}",
        )  # fmt: skip
    return np.stack([columns[quantity + axis] for axis in "xyz"], axis=-1)
