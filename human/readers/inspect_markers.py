"""What a file of markers or forces holds, as plain values; and the door to any file's inspection.

Such files hold no skeleton, so they have an inspection of their own; `human.markers` makes a motion
of them.
"""

from dataclasses import asdict, dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from human.marker_recording import MarkerRecording, PlateForces
from human.markers.errors import UnknownMarkerSetError
from human.markers.recognise import recognise_marker_set
from human.readers.c3d import read_c3d
from human.readers.csv_motive import read_motive_csv
from human.readers.csv_table import csv_header
from human.readers.files import sha256_of
from human.readers.inspect import Inspection, inspect_recording
from human.readers.marker_files import MarkerFormat, marker_format
from human.readers.mat_table import mat_arrays
from human.readers.opensim_table import OpenSimTable, plate_forces, read_opensim_table
from human.readers.trc import read_trc
from human.recording import Finding, Gap


@dataclass(frozen=True, slots=True)
class MarkerInspection:
    """Contents of a C3D, TRC, MOT, STO, CSV or .mat file; every field is ready for JSON.

    A CSV or .mat file is looked at without its column map: only its columns are said.

    Attributes:
        source: file name.
        format: ``c3d``, ``trc``, ``opensim-table``, ``motive-csv``, ``csv`` or ``mat``.
        sha256: of the file.
        rate_hz: nominal, of the markers or of the table; None for a single row.
        duration_s: from the first frame to the last; None for columns without their map.
        frames: of markers, or rows; None for columns without their map.
        markers: names.
        marker_set: the known set that they are of, or None.
        unseen_frames: number of frames in which a marker was not seen, of those that have any.
        columns: of a table without plates.
        plates: names of the force plates.
        plate_rate_hz: of the forces.
        supported_mass_kg: see `PlateForces.supported_mass_kg`: a hint of the body's mass.
        events: instant (s), label and side.
        channels: kinds of data and how many.
        conversions: what was done to bring the file to house units and axes.
        gaps: holes in time.
        problems: findings of severity error or warning.
        notes: the other findings.
    """

    source: str
    format: MarkerFormat
    sha256: str
    rate_hz: float | None
    duration_s: float | None
    frames: int | None
    markers: list[str]
    unseen_frames: dict[str, int]
    columns: list[str]
    plates: list[str]
    plate_rate_hz: float | None
    supported_mass_kg: float | None
    events: list[dict[str, Any]]
    channels: dict[str, int]
    conversions: list[str]
    gaps: list[Gap]
    problems: list[Finding]
    notes: list[Finding]
    marker_set: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """Returns the same as nested dictionaries and lists."""
        return asdict(self)


def inspect_file(path: str | PathLike[str]) -> Inspection | MarkerInspection:
    """Says what a file holds, whether of a motion, of markers or of forces.

    Args:
        path: MVNX, BVH, C3D, TRC, MOT, STO, CSV or .mat; the content tells.

    Raises:
        RecordingFileError: the file cannot be read at all.
    """
    file = Path(path)
    kind = marker_format(file)
    if kind is None:
        return inspect_recording(file)
    digest = sha256_of(file)
    if kind == "opensim-table":
        return _of_table(read_opensim_table(file), digest)
    if kind in ("csv", "mat"):
        columns = csv_header(file)[0] if kind == "csv" else list(mat_arrays(file))
        return _of_columns(file.name, kind, digest, columns)
    if kind == "motive-csv":
        return _of_markers(read_motive_csv(file, digest), kind)
    return _of_markers((read_c3d if kind == "c3d" else read_trc)(file, digest), kind)


def _of_columns(
    source: str, kind: MarkerFormat, digest: str, columns: list[str]
) -> MarkerInspection:
    said = Finding(
        "column-map", "note", "columns",
        "What the columns hold is said in a column map, a JSON file read together with this one.",
    )  # fmt: skip
    return MarkerInspection(
        source=source, format=kind, sha256=digest, rate_hz=None, duration_s=None, frames=None,
        markers=[], unseen_frames={}, columns=columns, plates=[], plate_rate_hz=None,
        supported_mass_kg=None, events=[], channels={"columns": len(columns)}, conversions=[],
        gaps=[], problems=[], notes=[said],
    )  # fmt: skip


def _of_markers(read: MarkerRecording, kind: MarkerFormat) -> MarkerInspection:
    plates = read.plates
    marker_set, worn = _worn(read)
    findings = (*read.report.findings, *(plates.report.findings if plates else ()), worn)
    return MarkerInspection(
        source=read.source, format=kind, sha256=read.digest, rate_hz=read.rate_hz,
        duration_s=float(read.time_s[-1] - read.time_s[0]), frames=read.frames,
        markers=list(read.marker_names), unseen_frames=read.missing(), columns=[],
        plates=_names(plates), plate_rate_hz=_plate_rate(plates),
        supported_mass_kg=_mass(plates), events=[asdict(event) for event in read.events],
        channels=dict(read.report.channels),
        conversions=[*read.report.conversions, *(plates.report.conversions if plates else ())],
        gaps=list(read.report.gaps), problems=_serious(findings), notes=_others(findings),
        marker_set=marker_set,
    )  # fmt: skip


def _worn(read: MarkerRecording) -> tuple[str | None, Finding]:
    """Says which known set the markers are of, and what is missing or not in it."""
    try:
        worn = recognise_marker_set(read.marker_names)
    except UnknownMarkerSetError as error:
        return None, Finding("marker-set", "note", "markers", str(error))
    said = [f"{worn.marker_set.name}: {worn.marker_set.title}."]
    for names, what in (
        (worn.missing, "Bony points of the set that are not there"),
        (worn.unknown, "Not in the set"),
        (worn.results, "Results of other software"),
    ):
        if names:
            said.append(f"{what}: {', '.join(names)}.")
    return worn.marker_set.name, Finding("marker-set", "note", "markers", " ".join(said))


def _of_table(table: OpenSimTable, digest: str) -> MarkerInspection:
    with_plates = any("ground_force" in name.lower() for name in table.columns)
    plates = plate_forces(table) if with_plates else None
    findings = plates.report.findings if plates else ()
    steps = len(table.time_s) - 1
    duration = float(table.time_s[-1] - table.time_s[0])
    return MarkerInspection(
        source=table.source, format="opensim-table", sha256=digest,
        rate_hz=round(steps / duration, 3) if steps else None, duration_s=duration,
        frames=steps + 1, markers=[], unseen_frames={},
        columns=[] if plates else list(table.columns),
        plates=_names(plates), plate_rate_hz=_plate_rate(plates),
        supported_mass_kg=_mass(plates), events=[], channels={"columns": len(table.columns)},
        conversions=list(plates.report.conversions) if plates else [],
        gaps=list(plates.report.gaps) if plates else [], problems=_serious(findings),
        notes=_others(findings),
    )  # fmt: skip


def _names(plates: PlateForces | None) -> list[str]:
    return [plate.name for plate in plates.plates] if plates else []


def _plate_rate(plates: PlateForces | None) -> float | None:
    if plates is None or len(plates.time_s) < 2:
        return None
    return round((len(plates.time_s) - 1) / float(plates.time_s[-1] - plates.time_s[0]), 3)


def _mass(plates: PlateForces | None) -> float | None:
    mass = plates.supported_mass_kg() if plates else None
    return None if mass is None else round(mass, 2)


def _serious(findings: tuple[Finding, ...]) -> list[Finding]:
    return [finding for finding in findings if finding.severity != "note"]


def _others(findings: tuple[Finding, ...]) -> list[Finding]:
    return [finding for finding in findings if finding.severity == "note"]
