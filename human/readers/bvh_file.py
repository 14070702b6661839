"""The BVH grammar: a joint tree with offsets and channels, then one line of numbers per frame.

Reads line by line and keeps the numbers alone, so memory is bounded by the frames. Nothing here
knows about people: names, units and axes are resolved in `human.readers.bvh`.

Source: Biovision BVH as written by Xsens MVN, MotionBuilder and the CMU conversions; the grammar is
    the
common part, checked on real files.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from human.readers.errors import (
    MalformedRecordingError,
    RecordingFileError,
    TruncatedRecordingError,
    UnsafeRecordingError,
)

Array = NDArray[np.float64]

CHANNELS = ("Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation")
_CANONICAL_CHANNEL = {name.lower(): name for name in CHANNELS}
_MAX_LINE_BYTES = 1 << 20
_MAX_JOINTS = 2000
_MAX_DEPTH = 200
#: Rates that equipment records at; a frame time rounded to few digits is taken for one of these.
_COMMON_RATES_HZ = (24, 25, 30, 48, 50, 60, 72, 75, 80, 90, 100, 120, 125, 144, 150, 180, 200, 240,
                    250, 300, 360, 400, 480, 500, 600, 1000)  # fmt: skip


@dataclass(slots=True)
class BvhJoint:
    """One joint of the tree, in the file's units and axes."""

    name: str
    parent: int
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    channels: tuple[str, ...] = ()
    first_channel: int = 0
    end_offset: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class BvhFile:
    """A parsed file: joints parents first, ``(frames, channels)`` values, seconds per frame."""

    joints: tuple[BvhJoint, ...]
    values: Array
    frame_time_s: float
    stated_frame_time: str
    findings: tuple[str, ...] = field(default=())


class _Lines:
    """Non-blank lines of a file with their numbers."""

    def __init__(self, path: Path) -> None:
        self.name = path.name
        self.number = 0
        self._iterator = self._read(path)

    def _read(self, path: Path) -> Iterator[list[str]]:
        with path.open("rb") as stream:
            while raw := stream.readline(_MAX_LINE_BYTES):
                self.number += 1
                if len(raw) >= _MAX_LINE_BYTES:
                    raise UnsafeRecordingError(
                        self.place, f"lines shorter than {_MAX_LINE_BYTES} bytes", "a longer one"
                    )
                if self.number == 1:
                    raw = raw.removeprefix(b"\xef\xbb\xbf")
                if words := raw.decode("utf-8", "replace").split():
                    yield words

    @property
    def place(self) -> str:
        return f"{self.name}, line {self.number}"

    def next(self, expected: str) -> list[str]:
        for words in self._iterator:
            return words
        raise TruncatedRecordingError(
            self.place, expected, "the end of the file", "The file is cut off; export it again."
        )

    def rest(self) -> Iterator[list[str]]:
        return self._iterator

    def numbers(self, words: list[str], count: int, what: str) -> list[float]:
        if len(words) != count:
            raise MalformedRecordingError(
                self.place, f"{count} numbers ({what})", f"{len(words)} words"
            )
        try:
            values = [float(word) for word in words]
        except ValueError:
            bad = next(word for word in words if not _is_number(word))
            raise MalformedRecordingError(
                self.place, f"a number ({what})", repr(bad[:40])
            ) from None
        if not all(map(_can_be, values)):
            bad = next(
                word for word, value in zip(words, values, strict=True) if not _can_be(value)
            )
            raise MalformedRecordingError(
                self.place, f"finite numbers ({what})", repr(bad[:40]), "Fill or cut the frame."
            )
        return values


def _can_be(value: float) -> bool:
    # Sizes past this are of no place or angle in any unit, and would overflow once squared.
    return isfinite(value) and abs(value) < 1e9


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def parse_bvh(path: Path) -> BvhFile:
    """Reads a BVH file.

    Raises:
        RecordingFileError: the grammar, a count or a number is wrong; the place is the line.
    """
    lines = _Lines(path)
    joints = _hierarchy(lines)
    width = joints[-1].first_channel + len(joints[-1].channels)
    declared = _keyword_number(lines, "Frames:")
    if declared != int(declared) or declared < 1:
        raise MalformedRecordingError(lines.place, "a frame count of 1 or more", f"{declared:g}")
    dt, written = _frame_time(lines)
    values = _motion(lines, int(declared), width)
    snapped, note = snapped_frame_time(dt, written)
    return BvhFile(tuple(joints), values, snapped, written, (note,) if note else ())


def _hierarchy(lines: _Lines) -> list[BvhJoint]:
    words = lines.next("HIERARCHY")
    if words[0].upper() != "HIERARCHY":
        raise MalformedRecordingError(lines.place, "HIERARCHY", repr(" ".join(words)[:40]))
    joints: list[BvhJoint] = []
    open_blocks: list[int] = []  # joint index, or -1 inside an End Site
    pending: int | None = None  # block announced, brace not yet read
    channels = 0
    while True:
        words = lines.next("the joint tree, closed by MOTION")
        keyword = words[0].upper()
        if pending is not None:
            if words != ["{"]:
                raise MalformedRecordingError(lines.place, "'{'", repr(" ".join(words)[:40]))
            open_blocks.append(pending)
            pending = None
        elif keyword in ("ROOT", "JOINT"):
            if (keyword == "ROOT") != (not open_blocks) or (keyword == "ROOT" and joints):
                raise MalformedRecordingError(
                    lines.place, "one ROOT and its JOINTs", f"{keyword} {' '.join(words[1:])[:40]}",
                    "Files with several people are not read: export one person.",
                )  # fmt: skip
            if open_blocks and open_blocks[-1] < 0:
                raise MalformedRecordingError(lines.place, "'}' after an End Site", keyword)
            name = " ".join(words[1:])
            if not name:
                raise MalformedRecordingError(lines.place, "a joint name", "none")
            if len(joints) >= _MAX_JOINTS or len(open_blocks) >= _MAX_DEPTH:
                raise UnsafeRecordingError(
                    lines.place, f"at most {_MAX_JOINTS} joints, {_MAX_DEPTH} deep", "more"
                )
            joints.append(
                BvhJoint(name, open_blocks[-1] if open_blocks else -1, first_channel=channels)
            )
            pending = len(joints) - 1
        elif keyword == "END":
            if not open_blocks or open_blocks[-1] < 0:
                raise MalformedRecordingError(
                    lines.place, "an End Site inside a joint", "one elsewhere"
                )
            pending = -1
        elif keyword == "OFFSET" and open_blocks:
            x, y, z = lines.numbers(words[1:], 3, "OFFSET")
            if open_blocks[-1] < 0:
                joints[open_blocks[-2]].end_offset = (x, y, z)
            else:
                joints[open_blocks[-1]].offset = (x, y, z)
        elif keyword == "CHANNELS" and open_blocks and open_blocks[-1] >= 0:
            joint = joints[open_blocks[-1]]
            if open_blocks[-1] != len(joints) - 1 or joint.channels:
                raise MalformedRecordingError(
                    lines.place, "one CHANNELS line per joint, before its children", "another"
                )
            joint.channels = _channels(lines, words)
            channels += len(joint.channels)
        elif words == ["}"] and open_blocks:
            open_blocks.pop()
        elif keyword == "MOTION" and joints and not open_blocks:
            return joints
        else:
            raise MalformedRecordingError(
                lines.place, "ROOT, JOINT, End Site, OFFSET, CHANNELS, braces or MOTION",
                repr(" ".join(words)[:40]),
            )  # fmt: skip


def _channels(lines: _Lines, words: list[str]) -> tuple[str, ...]:
    names = tuple(_CANONICAL_CHANNEL.get(word.lower(), word) for word in words[2:])
    if words[1:2] != [str(len(names))]:
        raise MalformedRecordingError(
            lines.place,
            f"CHANNELS {len(names)} before {len(names)} names",
            " ".join(words[:2])[:40],
        )
    unknown = [name for name in names if name not in CHANNELS]
    if unknown or len(set(names)) != len(names):
        raise MalformedRecordingError(
            lines.place,
            f"distinct channels out of {', '.join(CHANNELS)}",
            repr(" ".join(names)[:80]),
        )
    return names


def _keyword_number(lines: _Lines, keyword: str) -> float:
    words = lines.next(keyword)
    if words[0].lower() != keyword.lower():
        raise MalformedRecordingError(lines.place, f"{keyword!r}", repr(" ".join(words)[:40]))
    return lines.numbers(words[1:], 1, keyword)[0]


def _frame_time(lines: _Lines) -> tuple[float, str]:
    words = lines.next("'Frame Time:'")
    if [word.lower() for word in words[:2]] != ["frame", "time:"]:
        raise MalformedRecordingError(lines.place, "'Frame Time:'", repr(" ".join(words)[:40]))
    dt = lines.numbers(words[2:], 1, "Frame Time")[0]
    if not 1e-4 <= dt <= 10.0:
        raise MalformedRecordingError(
            lines.place,
            "a frame time between 0.0001 and 10 s",
            words[2][:40],
            "Export at a fixed rate.",
        )
    return dt, words[2]


def _motion(lines: _Lines, declared: int, width: int) -> Array:
    rows: list[Array] = []
    for words in lines.rest():
        if len(rows) == declared:
            raise MalformedRecordingError(
                lines.place,
                f"the end of the file after the {declared} declared frames",
                "another line",
            )
        rows.append(np.array(lines.numbers(words, width, f"channels of frame {len(rows)}")))
    if len(rows) < declared:
        raise TruncatedRecordingError(
            lines.place, f"{declared} frames as declared", f"{len(rows)}",
            "The file is cut off; export it again.",
        )  # fmt: skip
    return np.stack(rows)


def snapped_frame_time(dt: float, written: str) -> tuple[float, str]:
    """Undoes the rounding of a frame time where exactly one usual rate explains it.

    Args:
        dt: the frame time, s.
        written: the same as it stands in the file; its last digit gives the rounding.

    Returns:
        The frame time to use (s) and a sentence saying what was done, empty if nothing.
    """
    mantissa, _, exponent = written.lower().partition("e")
    digits = len(mantissa.partition(".")[2]) - int(exponent or 0)
    half_ulp = 0.5000001 * 10.0**-digits
    fits = [rate for rate in _COMMON_RATES_HZ if abs(1.0 / rate - dt) <= half_ulp]
    if len(fits) != 1 or abs(1.0 / fits[0] - dt) < 1e-12:
        return dt, ""
    return 1.0 / fits[0], f"frame time {written} s is {fits[0]} Hz rounded: 1/{fits[0]} s is used"


__all__ = ["BvhFile", "BvhJoint", "RecordingFileError", "parse_bvh", "snapped_frame_time"]
