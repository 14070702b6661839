"""Comma-separated files of any program, read with a column map."""

import csv
import math
from array import array
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from human.readers.column_map import ColumnMap
from human.readers.column_records import TableRecording, records, with_markers_named
from human.readers.errors import (
    MalformedRecordingError,
    TruncatedRecordingError,
)
from human.readers.files import refuse_large

Array = NDArray[np.float64]

_DELIMITERS = ",;\t"
_EMPTY = {"", "nan", "na", "n/a", "none", "null"}


def read_csv(
    path: Path, columns: ColumnMap, digest: str = "", names: list[str] | None = None
) -> TableRecording:
    """Reads the columns of a CSV file that a column map names; the others are passed over.

    Args:
        path: the file, UTF-8.
        columns: what they hold.
        digest: SHA-256 of the file.
        names: of the columns, where they are not those of the header's line.

    Raises:
        RecordingFileError: the file is too large or ends too soon, a column is missing or stands
            there twice, or a cell is no number.
    """
    header, delimiter = csv_header(path, columns)
    names = names or header
    columns = with_markers_named(columns, names)
    wanted = list(dict.fromkeys(name.removeprefix("-") for name in columns.columns()))
    missing = [name for name in wanted if names.count(name) != 1]
    if missing:
        found = names.count(missing[0])
        raise MalformedRecordingError(
            f"{path.name}, line {columns.header_line}", f"column {missing[0]!r} once",
            f"{found} times" if found else f"{', '.join(names[:6])} …",
            "Name the columns in the column map as the file does.",
        )  # fmt: skip
    values = _read_columns(path, [names.index(name) for name in wanted], delimiter, columns, names)
    by_name = dict(zip(wanted, values.T, strict=True))
    return records(path.name, "csv", by_name.__getitem__, columns, digest)


def csv_header(path: Path, columns: ColumnMap | None = None) -> tuple[list[str], str]:
    """Returns the column names of a CSV file and its delimiter.

    Raises:
        RecordingFileError: the file is too large or has no such line.
    """
    refuse_large(path)
    line_number = columns.header_line if columns else 1
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as stream:
        line = ""
        for _ in range(line_number):
            line = stream.readline(1 << 22)
    if not line.strip():
        raise TruncatedRecordingError(path.name, f"column names in line {line_number}", "nothing")
    delimiter = columns.delimiter if columns and columns.delimiter else None
    delimiter = delimiter or max(_DELIMITERS, key=line.count)
    try:
        cells = next(csv.reader([line], delimiter=delimiter))
    except csv.Error as problem:
        raise MalformedRecordingError(
            f"{path.name}, line {line_number}", "column names", str(problem)
        ) from problem
    return [cell.strip() for cell in cells], delimiter


def _read_columns(
    path: Path, indices: list[int], delimiter: str, columns: ColumnMap, names: list[str]
) -> Array:
    """Returns ``(frames, columns)``; NaN where a cell is empty."""
    out = array("d")
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as stream:
        for _ in range(columns.header_line):
            stream.readline(1 << 22)
        rows = csv.reader(stream, delimiter=delimiter)
        try:
            for cells in rows:
                if not any(cell.strip() for cell in cells):
                    continue
                line = columns.header_line + rows.line_num
                for k in indices:
                    if k >= len(cells):
                        raise MalformedRecordingError(
                            f"{path.name}, line {line}", f"{len(names)} cells", f"{len(cells)}"
                        )
                    out.append(_number(cells[k], columns.decimal, path.name, line, names[k]))
        except csv.Error as problem:
            line = columns.header_line + rows.line_num
            raise MalformedRecordingError(
                f"{path.name}, line {line}", "cells", str(problem)
            ) from problem
    if not out:
        raise TruncatedRecordingError(path.name, "rows below the column names", "none")
    return np.frombuffer(out, dtype=np.float64).reshape(-1, len(indices))


def _number(cell: str, decimal: str, source: str, line: int, name: str) -> float:
    text = cell.strip()
    if text.lower() in _EMPTY:
        return math.nan
    try:
        return float(text.replace(",", ".") if decimal == "," else text)
    except ValueError as problem:
        raise MalformedRecordingError(
            f"{source}, line {line}, column {name}", "a number", repr(text[:24]),
            'If a comma is the decimal mark, write "decimal": "," in the column map.'
            if "," in text else "",
        ) from problem  # fmt: skip
