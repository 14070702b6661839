"""Tells the format of a recording from its first bytes, never from its name."""

from pathlib import Path
from typing import Literal

from human.readers.errors import TruncatedRecordingError, UnknownFormatError

Format = Literal["mvnx", "bvh"]
_HEAD_BYTES = 4096
_XML_ENCODED_ANGLE = (b"<", b"<\x00", b"\x00<")
_MARKERS = "It holds markers: read them with `read_markers`, fit a person with `human.markers`."
#: Second byte of every C3D file; the first counts blocks of 512 bytes.
_C3D_KEY = 0x50

#: (test on the head, what it is, what to do): formats that people have and that are not read here.
_OTHERS: tuple[tuple[bytes, str, str], ...] = (
    (
        b"Kaydara FBX",
        "a binary FBX scene",
        "Export the skeleton as BVH (Blender: File > Export > BVH).",
    ),
    (b"; FBX", "a text FBX scene", "Export the skeleton as BVH (Blender: File > Export > BVH)."),
    (b"MATLAB 5.0", "a MATLAB file", "Read it with a column map (`read_table`)."),
    (b"MATLAB 7.3", "a MATLAB file", "Read it with a column map (`read_table`)."),
    (b"\x89HDF", "an HDF5 file", "Read it with a column map (`read_table`)."),
    (b"Format Version,", "a CSV file of Motive", _MARKERS),
    (b"PathFileType", "a TRC marker file", _MARKERS),
    (b"PK\x03\x04", "a ZIP archive", "Unpack it and give the file inside."),
    (b"\x1f\x8b", "a gzip archive", "Unpack it and give the file inside."),
    (b"{", "JSON", "Give MVNX or BVH."),
)


def is_c3d(head: bytes) -> bool:
    """Tells a C3D file by its first bytes."""
    return len(head) > 1 and head[1] == _C3D_KEY and head[0] <= 64 and b"\x00" in head


def sniff(path: Path) -> Format:
    """Returns the format of a file by its content.

    Raises:
        TruncatedRecordingError: the file is missing, not a file, or empty.
        UnknownFormatError: the content is of another format; the message names it where known.
    """
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except OSError as problem:
        reason = problem.strerror or type(problem).__name__
        raise TruncatedRecordingError(path.name, "a readable file", reason.lower()) from problem
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if not text:
        raise TruncatedRecordingError(path.name, "a recording", "an empty file")
    if text.upper().startswith(b"HIERARCHY"):
        return "bvh"
    if is_c3d(head):
        raise UnknownFormatError(path.name, "MVNX or BVH", "a C3D file", _MARKERS)
    for magic, name, advice in _OTHERS:
        if text.startswith(magic):
            raise UnknownFormatError(path.name, "MVNX or BVH", name, advice)
    # XML in UTF-16 starts with a byte order mark; the parser checks the root element.
    if text.removeprefix(b"\xff\xfe").removeprefix(b"\xfe\xff").startswith(_XML_ENCODED_ANGLE):
        return "mvnx"
    shown = text[:24].decode("ascii", "replace").splitlines()[0]
    raise UnknownFormatError(
        path.name,
        "MVNX or BVH",
        f"content that begins with {shown!r}",
        "Export the recording as MVNX or BVH.",
    )
