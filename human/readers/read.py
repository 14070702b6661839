"""The door: one call for every format."""

from os import PathLike
from pathlib import Path

from human.readers.bvh import read_bvh
from human.readers.files import sha256_of
from human.readers.mvnx import read_mvnx
from human.readers.sniff import sniff
from human.recording import Recording

_READERS = {"bvh": read_bvh, "mvnx": read_mvnx}


def read_recording(
    path: str | PathLike[str], *, units: str | None = None, up: str | None = None
) -> Recording:
    """Reads a recording; the format is told by its content.

    Args:
        path: an MVNX (version 3 or 4) or BVH file.
        units: length unit of a BVH file (``m``, ``cm``, ``mm``, ``in``, ``cmu``), for when its
            skeleton does not tell.
        up: vertical axis of a BVH file (``y``, ``z``, ``-z`` …), for when its frames do not tell.

    Returns:
        The motion in metres, seconds and z-up axes, with a report of what was converted and
        noticed.

    Raises:
        RecordingFileError: the file is of another format, damaged, hostile or ambiguous; the
            subclass says which, the message where. No other exception leaves this function for any
            file content.
    """
    file = Path(path)
    read = _READERS[sniff(file)]
    digest = sha256_of(file)
    return read(file, digest, units, up)
