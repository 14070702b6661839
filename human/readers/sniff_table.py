"""Tells CSV and .mat files by their first bytes."""

from pathlib import Path
from typing import Literal

from human.readers.csv_motive import is_motive

TableFormat = Literal["csv", "mat", "motive-csv"]
_HEAD_BYTES = 4096


def table_format(path: Path) -> TableFormat | None:
    """Returns the format, or None where the content is neither.

    CSV has no mark of its own: text with commas, semicolons or tabs counts.
    """
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError:
        return None
    if head.startswith((b"MATLAB 5.0", b"MATLAB 7.3", b"\x89HDF")):
        return "mat"
    if head.startswith((b"PathFileType", b"<", b"{")) or b"\x00" in head:
        return None
    try:
        text = head.decode("utf-8-sig", "strict" if len(head) < _HEAD_BYTES else "ignore")
    except UnicodeDecodeError:
        return None
    if is_motive(text):
        return "motive-csv"
    printable = all(character.isprintable() or character in "\t\r\n" for character in text)
    return "csv" if printable and any(mark in text for mark in ",;\t") else None
