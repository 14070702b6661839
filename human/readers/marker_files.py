"""Doors to files of markers and of force plates, whatever their format."""

import hashlib
from os import PathLike
from pathlib import Path
from typing import Literal

from human.marker_recording import MarkerRecording, PlateForces
from human.readers.c3d import read_c3d
from human.readers.errors import UnknownFormatError
from human.readers.opensim_table import plate_forces, read_opensim_table
from human.readers.trc import read_trc

MarkerFormat = Literal["c3d", "trc", "opensim-table"]

_HEAD_BYTES = 1 << 16
#: Second byte of every C3D file; the first counts blocks of 512 bytes.
_C3D_KEY = 0x50


def marker_format(path: str | PathLike[str]) -> MarkerFormat | None:
    """Tells by a file's first bytes whether it is of markers or forces; None where it is neither.

    A file that cannot be opened is neither: the reader of other recordings says why.
    """
    try:
        with Path(path).open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError:
        return None
    if len(head) > 1 and head[1] == _C3D_KEY and head[0] <= 64 and b"\x00" in head:
        return "c3d"
    if head.startswith(b"PathFileType"):
        return "trc"
    lines = [line.strip().lower() for line in head.split(b"\n")]
    return "opensim-table" if b"endheader" in lines else None


def read_markers(
    path: str | PathLike[str], *, units: str | None = None, up: str | None = None
) -> MarkerRecording:
    """Reads markers, and the force plates of the same file if it has any.

    Args:
        path: a C3D or TRC file.
        units: unit of length that overrides the file's, a key of `UNITS_M`.
        up: vertical axis that overrides the file's.

    Raises:
        RecordingFileError: the file is of another format, damaged or ambiguous.
    """
    file = Path(path)
    kind = marker_format(file)
    if kind not in ("c3d", "trc"):
        raise UnknownFormatError(
            file.name, "markers: a C3D or TRC file", "another", "Give the file of markers."
        )
    with file.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    return (read_c3d if kind == "c3d" else read_trc)(file, digest, units, up)


def read_plates(path: str | PathLike[str], *, up: str = "y") -> PlateForces:
    """Reads force plates.

    Args:
        path: a MOT or STO table, or a C3D file with plates.
        up: vertical axis of a table, which does not state it; y is OpenSim's.

    Raises:
        RecordingFileError: the file is of another format, damaged, or has no plates.
    """
    file = Path(path)
    kind = marker_format(file)
    if kind == "opensim-table":
        return plate_forces(read_opensim_table(file), up=up)
    if kind == "c3d":
        plates = read_c3d(file).plates
        if plates is not None:
            return plates
    raise UnknownFormatError(
        file.name, "force plates: a MOT or STO table, or a C3D file with plates", "none",
        "Give the file that holds the forces.",
    )  # fmt: skip
