"""Marker files of the TRC kind: tab-separated text with a header of five lines.

What files of different programs do: leave cells empty for markers not seen, drop the tabs at the
end of the header's and of short lines, put a blank line below the header or none, and state more
or fewer markers than they list. Names are taken from the fourth line, the number of columns
from it too; what the header states otherwise is compared and reported.
"""

import math
from pathlib import Path

import numpy as np

from human.marker_recording import MarkerRecording
from human.readers.axes import UNITS_M
from human.readers.checks import checked_times, errors_first, find_gaps
from human.readers.errors import (
    AmbiguousRecordingError,
    MalformedRecordingError,
    TruncatedRecordingError,
    UnsafeRecordingError,
)
from human.readers.marker_axes import resolve_up
from human.recording import Finding, ReadingReport

_LARGEST_BYTES = 1 << 30
_HEADER_LINES = 5


def read_trc(
    path: Path, digest: str = "", units: str | None = None, up: str | None = None
) -> MarkerRecording:
    """Reads a TRC file.

    Args:
        path: the file.
        digest: SHA-256 of the file.
        units: a key of `UNITS_M` that overrides the file's.
        up: vertical axis of the file; without it a standing person tells, else y is taken and
            the report warns.

    Raises:
        RecordingFileError: the file is damaged or its units are unknown.
    """
    if path.stat().st_size > _LARGEST_BYTES:
        raise UnsafeRecordingError(
            path.name, "less than 1 GiB", f"{path.stat().st_size} bytes", "Split the file."
        )
    lines = path.read_text("utf-8", "replace").splitlines()
    if len(lines) <= _HEADER_LINES:
        raise TruncatedRecordingError(
            path.name, "a header of five lines and frames", f"{len(lines)} lines"
        )
    stated = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    names = _marker_names(lines[3])
    numbers = _table(lines, len(names))
    time_s = checked_times(numbers[:, 1], "column Time")
    raw = numbers[:, 2:].reshape(len(time_s), len(names), 3)
    valid = np.all(np.isfinite(raw), axis=-1)
    metres, why_metres = _metres(units, stated.get("Units", "").strip())
    position = np.where(valid[..., None], raw * metres, 0.0)
    axes, why_up, said = resolve_up(
        position, valid, requested=up, stated=None, convention="y", place="markers"
    )
    findings = said + _count_findings(stated, len(time_s), len(names))
    rate = _rate(stated, time_s)
    return MarkerRecording(
        source=path.name, format="trc", version=lines[0].partition("\t")[2].partition("\t")[0],
        time_s=time_s, rate_hz=rate, marker_names=names,
        position=position @ axes.T, valid=valid, events=(), plates=None,
        report=ReadingReport(
            conversions=(why_metres, why_up), gaps=find_gaps(time_s, 1.0 / rate),
            findings=errors_first(findings), channels={"markers": len(names)},
        ),
        digest=digest,
    )  # fmt: skip


def _marker_names(line: str) -> tuple[str, ...]:
    cells = line.split("\t")
    names = [cell.strip() for cell in cells[2:] if cell.strip()]
    if not cells[0].strip().lower().startswith("frame") or not names:
        raise MalformedRecordingError(
            "line 4", "Frame#, Time and the names of the markers", repr(line[:40])
        )
    double = sorted({name for name in names if names.count(name) > 1})
    if double:
        raise MalformedRecordingError(
            "line 4", "each marker once", f"{', '.join(double)} more than once", "Rename one."
        )
    return tuple(names)


def _table(lines: list[str], markers: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Returns ``(frames, 2 + 3 markers)``; NaN where a cell is empty."""
    width = 2 + 3 * markers
    rows: list[list[float]] = []
    for number, line in enumerate(lines[_HEADER_LINES:], _HEADER_LINES + 1):
        cells = line.rstrip("\r\n").split("\t")
        if not any(cell.strip() for cell in cells):
            continue
        while len(cells) > width and not cells[-1].strip():
            cells.pop()
        if len(cells) > width:
            raise MalformedRecordingError(
                f"line {number}", f"{width} columns for {markers} markers", f"{len(cells)}"
            )
        rows.append([_number(cell, number) for cell in cells] + [math.nan] * (width - len(cells)))
        if not all(map(math.isfinite, rows[-1][:2])):
            raise MalformedRecordingError(f"line {number}", "a frame number and a time", line[:30])
    if not rows:
        raise TruncatedRecordingError("below the header", "frames", "none")
    return np.array(rows, dtype=np.float64)


def _number(cell: str, line: int) -> float:
    text = cell.strip()
    if not text:
        return math.nan
    try:
        return float(text)
    except ValueError as problem:
        raise MalformedRecordingError(f"line {line}", "a number", repr(text[:24])) from problem


def _metres(requested: str | None, stated: str) -> tuple[float, str]:
    unit = stated.lower() if requested is None else requested
    if unit not in UNITS_M:
        raise AmbiguousRecordingError(
            "units of length", f"one of {', '.join(UNITS_M)}", repr(unit), "units",
            "Pass units='mm'.",
        )  # fmt: skip
    return UNITS_M[unit], f"lengths in {unit} as {'stated' if requested is None else 'requested'}"


def _count_findings(stated: dict[str, str], frames: int, markers: int) -> list[Finding]:
    findings = []
    for key, counted in (("NumFrames", frames), ("NumMarkers", markers)):
        text = stated.get(key, "").strip()
        if text and text != str(counted):
            findings.append(
                Finding("header", "warning", f"line 3, {key}", f"{text} stated, {counted} found.")
            )
    return findings


def _rate(stated: dict[str, str], time_s: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
    if len(time_s) > 1:
        return float(np.round(1.0 / np.median(np.diff(time_s)), 3))
    rate = _number(stated.get("DataRate", ""), 3)
    if not rate > 0.0:
        raise MalformedRecordingError("line 3, DataRate", "a positive rate", repr(rate))
    return rate
