"""A file's size and digest, before anything in it is believed."""

import hashlib
from pathlib import Path

from human.readers.errors import UnsafeRecordingError

_LARGEST_BYTES = 1 << 30


def refuse_large(path: Path) -> None:
    """Refuses a file that no reader should take into memory.

    Raises:
        UnsafeRecordingError: it has a gibibyte and more.
    """
    if (size := path.stat().st_size) > _LARGEST_BYTES:
        raise UnsafeRecordingError(path.name, "less than 1 GiB", f"{size} bytes", "Split the file.")


def sha256_of(path: Path) -> str:
    """Returns the SHA-256 of a file's bytes, in hexadecimal digits."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
