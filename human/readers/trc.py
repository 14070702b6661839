"""Marker files of the TRC kind: tab-separated text with a header of five lines.

What files of different programs do: leave cells empty for markers not seen, drop the tabs at the
end of the header's and of short lines, put a blank line below the header or none, and state more
or fewer markers than they list. Names are taken from the fourth line, the number of columns
from it too; what the header states otherwise is compared and reported.
"""

import math
from collections.abc import Iterable
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from human.marker_recording import MarkerRecording
from human.readers.axes import UNITS_M
from human.readers.checks import checked_times, errors_first, find_gaps
from human.readers.errors import (
    AmbiguousRecordingError,
    MalformedRecordingError,
    TruncatedRecordingError,
)
from human.readers.files import refuse_large
from human.readers.marker_axes import resolve_up
from human.readers.row_store import RowStore
from human.recording import Finding, ReadingReport

Array = NDArray[np.float64]

_HEADER_LINES = 5
_BLOCK_ROWS = 2048
_SAMPLE_FRAMES = 5000


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
    refuse_large(path)
    with path.open(encoding="utf-8", errors="replace") as stream:
        head = [line.rstrip("\r\n") for line in islice(stream, _HEADER_LINES)]
        if len(head) < _HEADER_LINES:
            raise TruncatedRecordingError(
                path.name, "a header of five lines and frames", f"{len(head)} lines"
            )
        stated = dict(zip(head[1].split("\t"), head[2].split("\t"), strict=False))
        names = _marker_names(head[3])
        metres, why_metres = _metres(units, stated.get("Units", "").strip())
        times, store, valid = _frames(stream, len(names), metres)
    time_s = checked_times(times, "column Time")
    # Which way is up shows on a sample of the frames as well as on all.
    step = -(-len(time_s) // _SAMPLE_FRAMES)
    some = store.every(step).reshape(-1, len(names), 3)
    axes, why_up, said = resolve_up(
        some, valid[::step], requested=up, stated=None, convention="y", place="markers",
    )  # fmt: skip
    store.change(lambda block: (block.reshape(-1, 3) @ axes.T).reshape(block.shape))
    findings = said + _count_findings(stated, len(time_s), len(names))
    rate = _rate(stated, time_s)
    return MarkerRecording(
        source=path.name, format="trc", version=head[0].partition("\t")[2].partition("\t")[0],
        time_s=time_s, rate_hz=rate, marker_names=names,
        position=store.array().reshape(len(time_s), len(names), 3), valid=valid, events=(),
        plates=None,
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


def _frames(
    stream: Iterable[str], markers: int, metres: float
) -> tuple[Array, RowStore, NDArray[np.bool_]]:
    """Returns times ``(frames,)``, positions in m and where each marker was seen."""
    store = RowStore(3 * markers)
    times: list[Array] = []
    seen: list[NDArray[np.bool_]] = []
    rows: list[list[float]] = []

    def keep() -> None:
        numbers = np.array(rows, dtype=np.float64)
        raw = numbers[:, 2:].reshape(len(rows), markers, 3)
        valid = np.all(np.isfinite(raw), axis=-1)
        store.append(np.where(valid[..., None], raw * metres, 0.0).reshape(len(rows), -1))
        times.append(numbers[:, 1].copy())
        seen.append(valid)
        rows.clear()

    for number, line in enumerate(stream, _HEADER_LINES + 1):
        row = _row(line, number, 2 + 3 * markers)
        if row is not None:
            rows.append(row)
        if len(rows) == _BLOCK_ROWS:
            keep()
    if rows:
        keep()
    if not times:
        raise TruncatedRecordingError("below the header", "frames", "none")
    return np.concatenate(times), store, np.concatenate(seen)


def _row(line: str, number: int, width: int) -> list[float] | None:
    """Returns the numbers of a line, NaN where a cell is empty; None for an empty line."""
    cells = line.rstrip("\r\n").split("\t")
    if len(cells) == width:
        try:
            row = list(map(float, cells))
        except ValueError:
            pass
        else:
            return _timed(row, number, line)
    if not any(cell.strip() for cell in cells):
        return None
    while len(cells) > width and not cells[-1].strip():
        cells.pop()
    if len(cells) > width:
        raise MalformedRecordingError(
            f"line {number}", f"{width} columns for {(width - 2) // 3} markers", f"{len(cells)}"
        )
    row = [_number(cell, number) for cell in cells] + [math.nan] * (width - len(cells))
    return _timed(row, number, line)


def _timed(row: list[float], number: int, line: str) -> list[float]:
    if not (math.isfinite(row[0]) and math.isfinite(row[1])):
        raise MalformedRecordingError(f"line {number}", "a frame number and a time", line[:30])
    return row


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


def _rate(stated: dict[str, str], time_s: Array) -> float:
    if len(time_s) > 1:
        return float(np.round(1.0 / np.median(np.diff(time_s)), 3))
    rate = _number(stated.get("DataRate", ""), 3)
    if not rate > 0.0:
        raise MalformedRecordingError("line 3, DataRate", "a positive rate", repr(rate))
    return rate
