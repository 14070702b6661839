"""Looks a C3D file over, byte by byte, before a parser in native code sees it.

The parser trusts the lengths in the file; a file that lies about them can take the process with
it. So every length is held against the file's size here first: the header, the chain of parameter
records, and the frames that the header promises.
"""

import struct
from dataclasses import dataclass
from math import prod

from human.readers.errors import (
    MalformedRecordingError,
    TruncatedRecordingError,
    UnsafeRecordingError,
)

_BLOCK = 512
_KEY = 0x50
#: Processor types by their byte: order of bytes, and which byte of a float has the sign.
_PROCESSORS = {84: ("<", 3), 85: ("<", 1), 86: (">", 0)}
_ELEMENT_BYTES = {-1: 1, 1: 1, 2: 2, 4: 4}
_FULL_16_BITS = 65535
_MOST_FRAMES = 1 << 24
_MOST_DIMENSIONS = 7

Parameter = tuple[int, tuple[int, ...], bytes]


@dataclass(frozen=True, slots=True)
class Layout:
    """What the file declares: counts, and which parameters there are by group and name."""

    points: int
    analogs_per_frame: int
    frames: int
    parameters: frozenset[tuple[str, str]]


def check_layout(content: bytes, name: str) -> Layout:
    """Refuses a file whose lengths do not fit each other or the file.

    Args:
        content: the whole file.
        name: for messages.

    Raises:
        RecordingFileError: saying which length it was.
    """
    if len(content) < 2 * _BLOCK:
        raise TruncatedRecordingError(
            name, "a header and parameters (1024 bytes)", f"{len(content)} bytes"
        )
    start = _BLOCK * (content[0] - 1)
    if content[1] != _KEY or start < _BLOCK or start + 4 > len(content):
        raise MalformedRecordingError(
            f"{name}, header", "the C3D key and a block of parameters in the file",
            f"key {content[1]}, block {content[0]}",
        )  # fmt: skip
    processor = content[start + 3]
    if processor not in _PROCESSORS:
        raise MalformedRecordingError(
            f"{name}, parameters", "processor type 84, 85 or 86", str(processor)
        )
    order, sign_byte = _PROCESSORS[processor]
    points, analogs, first, last = struct.unpack_from(order + "4H", content, 2)
    data_block = struct.unpack_from(order + "H", content, 16)[0]
    wide = bool(content[12 + sign_byte] & 0x80)
    parameters = _parameters(content, start + 4, order, name)
    frames = last - first + 1
    if last == _FULL_16_BITS:
        frames = _long_trial(parameters, order) or frames
    if not 0 < frames <= _MOST_FRAMES or data_block < 2:
        raise MalformedRecordingError(
            f"{name}, header", "frames and a block where they begin",
            f"frames {first} to {last}, block {data_block}",
        )  # fmt: skip
    if ("POINT", "RATE") not in parameters or ("POINT", "USED") not in parameters:
        raise MalformedRecordingError(
            f"{name}, parameters", "POINT:USED and POINT:RATE", "a file without"
        )
    _check_used(parameters, points, order, name)
    needed = _BLOCK * (data_block - 1) + frames * (4 * points + analogs) * (4 if wide else 2)
    if needed > len(content):
        raise TruncatedRecordingError(
            f"{name}, frames", f"{needed} bytes for {frames} frames", f"{len(content)} bytes",
            "The file was cut off.",
        )  # fmt: skip
    return Layout(points, analogs, frames, frozenset(parameters))


def _check_used(
    parameters: dict[tuple[str, str], Parameter], points: int, order: str, name: str
) -> None:
    data = parameters["POINT", "USED"][2]
    used = struct.unpack_from(order + "H", data)[0] if len(data) >= 2 else -1
    if used != points:
        raise MalformedRecordingError(
            f"{name}, POINT:USED", f"{points} points as in the header", str(used)
        )


def _parameters(content: bytes, at: int, order: str, name: str) -> dict[tuple[str, str], Parameter]:
    """Walks the chain of records; every step must stay in the file and go forward."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Parameter]] = []
    while True:
        if at + 2 > len(content):
            raise TruncatedRecordingError(f"{name}, parameters", "their end", "the file's")
        length, group = struct.unpack_from("2b", content, at)
        if length == 0 or group == 0:
            break
        length = abs(length)
        link = at + 2 + length
        if link + 4 > len(content):
            raise TruncatedRecordingError(f"{name}, parameters", "their end", "the file's")
        word = content[at + 2 : link].decode("latin-1").strip().upper()
        step = struct.unpack_from(order + "H", content, link)[0]
        following = link + step
        if group < 0:
            groups[-group] = word
            end = link + 3 + content[link + 2]
        else:
            kind, dimensions, data_at = _shape(content, link + 2, word, name)
            end = data_at + abs(kind) * prod(dimensions)
            found.append((group, word, (kind, dimensions, content[data_at:end])))
        if max(end, following) > len(content):
            raise TruncatedRecordingError(
                f"{name}, parameter {word}", f"{max(end, following)} bytes", f"{len(content)} bytes"
            )
        if step and end > following:
            raise UnsafeRecordingError(
                f"{name}, parameter {word}", "a length that fits its record", f"{end - at} bytes"
            )
        if step == 0:
            break
        at = following
    return {(groups.get(group, ""), word): value for group, word, value in found}


def _shape(content: bytes, at: int, word: str, name: str) -> tuple[int, tuple[int, ...], int]:
    kind, count = struct.unpack_from("bB", content, at)
    if kind not in _ELEMENT_BYTES or count > _MOST_DIMENSIONS or at + 2 + count > len(content):
        raise MalformedRecordingError(
            f"{name}, parameter {word}", "a type of -1, 1, 2 or 4 and up to 7 dimensions",
            f"type {kind}, {count} dimensions",
        )  # fmt: skip
    return kind, tuple(content[at + 2 : at + 2 + count]), at + 2 + count


def _long_trial(parameters: dict[tuple[str, str], Parameter], order: str) -> int | None:
    """Returns the number of frames of a trial too long for the header's 16 bits."""
    ends: list[int] = []
    for word in ("ACTUAL_START_FIELD", "ACTUAL_END_FIELD"):
        data = parameters.get(("TRIAL", word), (2, (), b""))[2]
        if len(data) < 4:
            return None
        low, high = struct.unpack_from(order + "2H", data)
        ends.append(int(low) + (int(high) << 16))
    return ends[1] - ends[0] + 1
