"""Marker files of OptiTrack Motive (CSV): a header of its own, read without a column map.

The first line holds ``Format Version`` and other pairs, among them the unit. Below stand a row of
types, one of names, and one of axes beginning with ``Frame`` and ``Time``. Positions of labelled
markers are taken; where there are none, those of the markers of rigid bodies. Bones and rigid
bodies themselves are solved by Motive and are passed over.
"""

import csv
from dataclasses import replace
from pathlib import Path

from human.marker_recording import MarkerRecording
from human.readers.axes import UNITS_M
from human.readers.column_map import ColumnMap
from human.readers.csv_table import read_csv
from human.readers.errors import MalformedRecordingError
from human.recording import Finding

_HEADER_LINES = 12
#: Pieces of trajectories that nobody gave a name.
_UNLABELLED = "unlabeled"
_UNITS = {"meters": "m", "centimeters": "cm", "millimeters": "mm", "inches": "in"}
#: Kinds of markers, the preferred first.
_KINDS = ("marker", "rigid body marker", "bone marker")
_TYPES = {*_KINDS, "rigid body", "bone"}


def is_motive(head: str) -> bool:
    """Tells from the first characters whether a file is Motive's."""
    return head.lstrip("\ufeff").lower().startswith("format version,")


def read_motive_csv(path: Path, digest: str = "", up: str | None = None) -> MarkerRecording:
    """Reads the labelled markers of a CSV file that Motive exported.

    Args:
        path: the file.
        digest: SHA-256 of the file.
        up: vertical axis of the file; without it standing markers tell (Motive's is y).

    Raises:
        RecordingFileError: the header is not Motive's, there are no markers, or the file is
            damaged.
    """
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as stream:
        lines = [stream.readline(1 << 22) for _ in range(_HEADER_LINES)]
    try:
        rows = [next(csv.reader([line]), []) for line in lines]
    except csv.Error as problem:
        raise MalformedRecordingError(f"{path.name}, header", "cells", str(problem)) from problem
    stated = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    unit = _UNITS.get(stated.get("Length Units", "").strip().lower())
    if unit is None:
        raise MalformedRecordingError(
            f"{path.name}, line 1, Length Units", f"one of {', '.join(_UNITS)}",
            repr(stated.get("Length Units")),
        )  # fmt: skip
    axes = next((k for k, row in enumerate(rows) if row and row[0].strip() == "Frame"), None)
    types = next((k for k, row in enumerate(rows) if k > 0 and _TYPES & _words(row)), None)
    if axes is None or types is None or types >= axes:
        raise MalformedRecordingError(
            path.name, "rows of types, names and axes as Motive writes them", "others"
        )
    header = (rows[types], rows[types + 1], rows[axes - 1], rows[axes])
    markers, unlabelled = _positions(header, path.name)
    if not markers:
        raise MalformedRecordingError(
            path.name, "positions of labelled markers", "none", "Export with markers ticked."
        )
    columns = ColumnMap(
        source=path.name, time="1", rate_hz=None, up=up, units={"length": UNITS_M[unit]},
        markers=markers, delimiter=",", header_line=axes + 1, usual_up="y",
    )  # fmt: skip
    numbers = [str(k) for k in range(len(rows[axes]))]
    read = read_csv(path, columns, digest, numbers).markers
    assert read is not None
    findings = read.report.findings
    if unlabelled:
        findings += (
            Finding(
                "unlabelled", "note", "markers",
                f"{unlabelled} pieces of markers without a name were passed over.",
            ),
        )  # fmt: skip
    return replace(
        read, format="motive-csv", version=stated.get("Format Version", ""),
        report=replace(read.report, findings=findings),
    )  # fmt: skip


def _positions(
    header: tuple[list[str], list[str], list[str], list[str]], place: str
) -> tuple[dict[str, tuple[str, ...]], int]:
    """Returns the columns of each named marker, by number, and how many have no name."""
    for kind in _KINDS:
        found: dict[str, dict[str, str]] = {}
        unlabelled = 0
        cells = enumerate(zip(*header, strict=False))
        for k, (of, name, quantity, axis) in ((k, map(str.strip, cell)) for k, cell in cells):
            if of.lower() != kind or quantity.lower() != "position" or axis not in ("X", "Y", "Z"):
                continue
            if name.lower().startswith(_UNLABELLED):
                unlabelled += axis == "X"
                continue
            if axis in found.setdefault(name, {}):
                raise MalformedRecordingError(
                    f"{place}, row of names", "each marker once", f"{name} more than once"
                )
            found[name][axis] = str(k)
        markers = {n: tuple(a[c] for c in "XYZ") for n, a in found.items() if len(a) == 3}
        if markers:
            return markers, unlabelled
    return {}, 0


def _words(row: list[str]) -> set[str]:
    return {cell.strip().lower() for cell in row}
