"""The door to files that need a column map: CSV of any program and .mat."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from human.readers.column_map import TablePart, read_column_map
from human.readers.column_records import TableRecording
from human.readers.csv_table import read_csv
from human.readers.errors import TruncatedRecordingError, UnknownFormatError
from human.readers.files import sha256_of
from human.readers.mat_table import read_mat
from human.readers.sniff_table import table_format


def read_table(
    path: str | PathLike[str], columns: str | PathLike[str], only: Sequence[TablePart] = ()
) -> TableRecording:
    """Reads markers, force plates and joint logs from a CSV or .mat file.

    Args:
        path: the file.
        columns: its column map, a JSON file; see `read_column_map`.
        only: what of the map stands in this file; all of it where nothing is said.

    Raises:
        RecordingFileError: either file is missing or damaged, or they do not fit each other.
    """
    file, map_file = Path(path), Path(columns)
    for one in (file, map_file):
        if not one.is_file():
            raise TruncatedRecordingError(one.name, "a readable file", "no such file")
    column_map = read_column_map(map_file)
    if only:
        column_map = column_map.only(*only)
    kind = table_format(file)
    digest = sha256_of(file)
    if kind == "csv":
        return read_csv(file, column_map, digest)
    if kind == "mat":
        return read_mat(file, column_map, digest)
    raise UnknownFormatError(
        file.name, "a CSV or .mat file", kind or "another",
        "Files of other formats need no column map.",
    )  # fmt: skip
