"""Doors to files of markers and of force plates, whatever their format."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Literal

from human.marker_recording import MarkerRecording, PlateForces
from human.readers.c3d import read_c3d
from human.readers.column_map import TablePart
from human.readers.csv_motive import read_motive_csv
from human.readers.errors import AmbiguousRecordingError, UnknownFormatError
from human.readers.files import sha256_of
from human.readers.opensim_table import plate_forces, read_opensim_table
from human.readers.read_table import read_table
from human.readers.sniff import is_c3d
from human.readers.sniff_table import table_format
from human.readers.trc import read_trc

MarkerFormat = Literal["c3d", "trc", "opensim-table", "motive-csv", "csv", "mat"]

_MARKERS: Mapping[MarkerFormat | None, Callable[[Path, str], MarkerRecording]] = {
    "c3d": read_c3d,
    "trc": read_trc,
    "motive-csv": read_motive_csv,
}
_HEAD_BYTES = 1 << 16


def marker_format(path: str | PathLike[str]) -> MarkerFormat | None:
    """Tells by a file's first bytes whether it is of markers or forces; None where it is neither.

    A file that cannot be opened is neither: the reader of other recordings says why.
    """
    try:
        with Path(path).open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError:
        return None
    if is_c3d(head):
        return "c3d"
    if head.startswith(b"PathFileType"):
        return "trc"
    lines = [line.strip().lower() for line in head.split(b"\n")]
    return "opensim-table" if b"endheader" in lines else table_format(Path(path))


def read_markers(
    path: str | PathLike[str],
    columns: str | PathLike[str] | None = None,
    *,
    plates_apart: bool = False,
) -> MarkerRecording:
    """Reads markers, and the force plates of the same file if it has any.

    Args:
        path: a C3D or TRC file, Motive's CSV, or with a column map any CSV or .mat file.
        columns: the column map; see `read_column_map`.
        plates_apart: the plates that the column map names stand in another file.

    Raises:
        RecordingFileError: the file is of another format, damaged, or holds no markers.
    """
    file = Path(path)
    kind = marker_format(file)
    if kind in ("csv", "mat"):
        only: tuple[TablePart, ...] = ("markers",) if plates_apart else ()
        table = read_table(file, _needed(columns, file), only)
        if table.markers is None:
            raise UnknownFormatError(file.name, "markers in the column map", "none")
        return replace(table.markers, plates=table.plates)
    if kind not in _MARKERS:
        raise UnknownFormatError(file.name, "markers: C3D, TRC, CSV or .mat", _other(file))
    digest = sha256_of(file)
    return _MARKERS[kind](file, digest)


def read_plates(
    path: str | PathLike[str], columns: str | PathLike[str] | None = None
) -> PlateForces:
    """Reads force plates.

    Args:
        path: a MOT or STO table (y up, as OpenSim's are), a C3D file with plates, or with a column
            map a CSV or .mat file.
        columns: the column map; see `read_column_map`.

    Raises:
        RecordingFileError: the file is of another format, damaged, or has no plates.
    """
    file = Path(path)
    kind = marker_format(file)
    plates: PlateForces | None = None
    if kind == "opensim-table":
        plates = plate_forces(read_opensim_table(file))
    elif kind == "c3d":
        plates = read_c3d(file).plates
    elif kind in ("csv", "mat"):
        plates = read_table(file, _needed(columns, file), ("plates",)).plates
    if plates is None:
        raise UnknownFormatError(
            file.name, "force plates: MOT, STO, C3D with plates, CSV or .mat", _other(file),
            "Give the file that holds the forces.",
        )  # fmt: skip
    return plates


def _other(file: Path) -> str:
    if not file.is_file():
        return "no such file"
    return "another file" if file.stat().st_size else "an empty file"


def _needed(columns: str | PathLike[str] | None, file: Path) -> str | PathLike[str]:
    if columns is None:
        raise AmbiguousRecordingError(
            file.name, "a column map that says what its columns hold", "none", "columns",
            "Write one, as the readers' README shows.",
        )  # fmt: skip
    return columns
