"""C3D files: markers, events, and force plates of types 1 to 4.

Parsing is `ezc3d`'s, in a process of its own (`c3d_parse`), after `check_layout` has found the
file's lengths to fit. What is resolved here: units, axes, which points are markers, what was not
seen, and the clocks of both.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from human.marker_recording import ForcePlate, MarkerEvent, MarkerRecording, PlateForces
from human.readers.axes import UNITS_M
from human.readers.c3d_layout import check_layout
from human.readers.checks import errors_first
from human.readers.errors import (
    AmbiguousRecordingError,
    MalformedRecordingError,
)
from human.readers.files import refuse_large
from human.readers.marker_axes import resolve_up
from human.readers.parser_process import parsed_apart
from human.recording import Finding, ReadingReport

Array = NDArray[np.float64]

_PLATE_TYPES = (1, 2, 3, 4)
#: Groups of results that programs write beside the markers, as if they were points.
_RESULTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")
_MOMENT_UNITS_M = {"Nmm": 1e-3, "Nm": 1.0, "Ncm": 1e-2}


def read_c3d(
    path: Path, digest: str = "", units: str | None = None, up: str | None = None
) -> MarkerRecording:
    """Reads a C3D file.

    Args:
        path: the file.
        digest: SHA-256 of the file.
        units: a key of `UNITS_M` that overrides the file's.
        up: vertical axis of the file; overrides what the file states.

    Raises:
        RecordingFileError: the file is damaged, or units or axes cannot be told.
    """
    refuse_large(path)
    check_layout(path.read_bytes(), path.name)
    arrays, meta = _parse(path)
    point = meta["parameters"]["POINT"]
    rate = float(meta["point_rate"])
    if not (np.isfinite(rate) and rate > 0.0):
        raise MalformedRecordingError(f"{path.name}, POINT:RATE", "a positive rate", f"{rate:g}")
    labels, keep = _markers(point, arrays["points"].shape[1], path.name)
    raw = np.moveaxis(arrays["points"][:, keep], 0, -1).swapaxes(0, 1)
    residual = arrays["residuals"][keep].T
    # A marker not seen has a negative residual; some programs write zeros for it instead.
    valid = np.all(np.isfinite(raw), axis=-1) & ~(residual < 0.0) & np.any(raw != 0.0, axis=-1)
    metres, why_metres = _metres(units, _text(point, "UNITS"))
    position = np.where(valid[..., None], raw * metres, 0.0)
    axes, why_up, said = resolve_up(
        position, valid, requested=up, stated=_text(point, "Y_SCREEN") or None, convention=None,
        place=f"{path.name}, markers",
    )  # fmt: skip
    time_s = (meta["first_point"] + np.arange(len(raw))) / rate
    findings: list[Finding] = []
    plates = _plates(arrays, meta, axes, metres if units else None, findings, path.name)
    channels = {"markers": len(labels), "analog": meta["analogs"]}
    dropped = arrays["points"].shape[1] - len(labels)
    if dropped:
        channels["results"] = dropped
    return MarkerRecording(
        source=path.name, format="c3d", version="", time_s=time_s, rate_hz=rate,
        marker_names=labels, position=position @ axes.T, valid=valid,
        events=_events(meta["parameters"].get("EVENT", {})), plates=plates,
        report=ReadingReport(
            conversions=(why_metres, why_up), findings=errors_first(findings + said),
            channels=channels,
        ),
        digest=digest,
    )  # fmt: skip


def _parse(path: Path) -> tuple[dict[str, Array], dict[str, Any]]:
    advice = "Export it again from the program that recorded it."
    arrays = parsed_apart(path, "c3d_parse.py", "a C3D file", advice)
    return arrays, json.loads(str(arrays.pop("meta")))


def _text(group: Any, name: str) -> str:
    value = group[name] if name in group else []
    return str(value[0]).strip() if len(value) else ""


def _markers(point: Any, count: int, place: str) -> tuple[tuple[str, ...], list[int]]:
    names = [str(name).strip() for key in point if key.startswith("LABELS")
             for name in point[key]]  # fmt: skip
    if len(names) < count:
        raise MalformedRecordingError(f"{place}, POINT:LABELS", f"{count} names", f"{len(names)}")
    results = {str(name).strip() for key in _RESULTS if key in point
               for name in point[key]}  # fmt: skip
    keep = [k for k, name in enumerate(names[:count]) if name and name not in results]
    kept = [names[k] for k in keep]
    double = sorted({name for name in kept if kept.count(name) > 1})
    if double:
        raise MalformedRecordingError(
            f"{place}, POINT:LABELS", "each marker once", f"{', '.join(double)} more than once"
        )
    if not kept:
        raise MalformedRecordingError(f"{place}, POINT:LABELS", "markers", "none")
    return tuple(kept), keep


def _metres(requested: str | None, stated: str) -> tuple[float, str]:
    unit = stated.lower() if requested is None else requested
    if unit not in UNITS_M:
        raise AmbiguousRecordingError(
            "POINT:UNITS", f"one of {', '.join(UNITS_M)}", repr(unit), "units", "Pass units='mm'."
        )
    return UNITS_M[unit], f"lengths in {unit} as {'stated' if requested is None else 'requested'}"


def _events(group: Any) -> tuple[MarkerEvent, ...]:
    if "TIMES" not in group or "LABELS" not in group:
        return ()
    times = np.asarray(group["TIMES"], dtype=np.float64).reshape(2, -1)
    contexts = list(group["CONTEXTS"]) if "CONTEXTS" in group else []
    contexts += [""] * times.shape[1]
    read = [
        # The first row counts whole minutes.
        MarkerEvent(float(60.0 * minutes + seconds), str(label).strip(), str(context).strip())
        for minutes, seconds, label, context in zip(*times, group["LABELS"], contexts, strict=False)
    ]
    return tuple(sorted(read, key=lambda event: event.time_s))


def _plates(
    arrays: dict[str, Array], meta: Any, axes: Array, metres: float | None,
    findings: list[Finding], name: str,
) -> PlateForces | None:  # fmt: skip
    group = meta["parameters"].get("FORCE_PLATFORM", {})
    refused = meta["plates_refused"] if np.any(group.get("USED", 0)) else ""
    types = np.ravel(group.get("TYPE", []))[: len(arrays["force"])].tolist()
    if not set(types) <= set(_PLATE_TYPES):
        refused = f"types {types}, of which only 1 to 4 are read"
    if refused:
        findings.append(Finding("plates", "warning", "FORCE_PLATFORM", f"No forces: {refused}."))
    if refused or not types:
        return None
    plates, forces, moments = [], [], []
    for k, (in_force, in_moment, in_length) in enumerate(meta["plate_units"]):
        number = k + 1
        length = UNITS_M.get(in_length) if metres is None else metres
        turning = _MOMENT_UNITS_M.get(in_moment)
        if length is None or turning is None or in_force != "N":
            raise MalformedRecordingError(
                f"{name}, plate {number}", "units of N, N mm or N m, and length",
                f"{in_force}, {in_moment}, {in_length}",
            )  # fmt: skip
        corners = length * arrays["corners"][k].T @ axes.T
        centre = np.mean(corners, axis=0)
        plates.append(ForcePlate(str(number), centre, float(centre[2]), corners))
        forces.append(arrays["force"][k].T @ axes.T)
        # The parser's moments are about the middle of the corners.
        moments.append(turning * arrays["moment"][k].T @ axes.T)
    force, moment = np.stack(forces, axis=1), np.stack(moments, axis=1)
    if not (np.all(np.isfinite(force)) and np.all(np.isfinite(moment))):
        raise MalformedRecordingError(f"{name}, plates", "finite forces", "others")
    if np.sum(force[..., 2]) < 0.0:
        findings.append(
            Finding(
                "plates", "warning", "force plates",
                "The forces point down: they act on the plates, not on the person, or up is "
                "wrong.",
            )
        )  # fmt: skip
    rate = float(meta["analog_rate"])
    time_s = (meta["first_analog"] + np.arange(len(force))) / rate
    report = ReadingReport(conversions=("moments taken about the middle of each plate",))
    return PlateForces(time_s, tuple(plates), force, moment, report)
