"""MATLAB files (.mat, all versions) such as the logs of IIT's experiments, read with a column map.

A struct's field is ``joints.q``, its second row ``joints.q[2]``, counted from 1 as MATLAB does.
Which dimension of a matrix is time is told by the number of frames. Logs often hold no time at all:
then the column map must say the rate.
"""

import json
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from human.readers.column_map import ColumnMap
from human.readers.column_records import TableRecording, records, with_markers_named
from human.readers.errors import MalformedRecordingError
from human.readers.files import refuse_large
from human.readers.parser_process import parsed_apart

Array = NDArray[np.float64]

_ROW = re.compile(r"(?P<name>.+)\[(?P<row>[1-9][0-9]{0,5})\]")


def read_mat(path: Path, columns: ColumnMap, digest: str = "") -> TableRecording:
    """Reads what a column map names from a .mat file.

    Args:
        path: the file; versions up to 7 and 7.3 (HDF5).
        columns: what its arrays hold.
        digest: SHA-256 of the file.

    Raises:
        RecordingFileError: the file is damaged or too large, or an array is missing or of another
            shape.
    """
    arrays = mat_arrays(path)
    columns = with_markers_named(columns, arrays)
    frames = _frames(arrays, columns, path.name)

    def column(name: str) -> Array:
        match = _ROW.fullmatch(name)
        stem, row = (match["name"], int(match["row"])) if match else (name, 1)
        values = _array(arrays, stem, path.name)
        if values.ndim == 2 and values.shape[1] == frames != values.shape[0]:
            values = values.T
        values = values.reshape(len(values), -1)
        if (
            len(values) != frames
            or row > values.shape[1]
            or (match is None and values.shape[1] > 1)
        ):
            raise MalformedRecordingError(
                f"{path.name}, {name}", f"a row of {frames} frames",
                f"an array of shape {arrays[stem].shape}", "Write the row as name[1].",
            )  # fmt: skip
        return np.asarray(values[:, row - 1])

    return records(path.name, "mat", column, columns, digest)


def mat_arrays(path: Path) -> Mapping[str, Array]:
    """Returns the numeric arrays of a .mat file by their dotted names, dimensions of one dropped.

    Raises:
        RecordingFileError: the file is damaged or too large.
    """
    refuse_large(path)
    stored = parsed_apart(path, "mat_parse.py", "a .mat file", "Save it again from MATLAB.")
    names = json.loads(str(stored["names"]))
    return {name: stored[f"a{k}"] for k, name in enumerate(names)}


def _array(arrays: Mapping[str, Array], name: str, source: str) -> Array:
    if name not in arrays:
        raise MalformedRecordingError(
            source, f"array {name!r}", f"{', '.join(list(arrays)[:8]) or 'no numeric arrays'} …",
            "Name the arrays in the column map as the file does.",
        )  # fmt: skip
    return arrays[name]


def _frames(arrays: Mapping[str, Array], columns: ColumnMap, source: str) -> int:
    """The time's length, or else the greatest dimension of the first array that is named."""
    name = next(columns.columns()).removeprefix("-")
    match = _ROW.fullmatch(name)
    return max(_array(arrays, match["name"] if match else name, source).shape, default=1)
