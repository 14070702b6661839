"""What a recording holds, as plain values: for `ergocast inspect`, the API and their readers."""

from dataclasses import asdict, dataclass
from os import PathLike
from typing import Any

from human.readers.read import read_recording
from human.recording import Finding, Gap, Recording


@dataclass(frozen=True, slots=True)
class Inspection:
    """A recording's contents in words and numbers; every field is ready for JSON.

    Attributes:
        source: file name.
        format: ``mvnx`` or ``bvh``.
        version: of the format, or the skeleton's spelling.
        sha256: of the file.
        subject: label, height of the skeleton and stated height (m), None where unknown.
        rate_hz: nominal.
        duration_s: from the first frame of motion to the last.
        frames: of motion, reference poses not counted.
        segments: present, with how each was obtained.
        channels: kinds of data and how often they occur.
        has: whether joint angles, landmarks and foot contacts are in the file.
        aliases: the file's spelling to the house's, where they differ.
        conversions: what was done to bring the file to house units and axes.
        gaps: holes in time.
        problems: findings of severity error or warning.
        notes: the other findings.
    """

    source: str
    format: str
    version: str
    sha256: str
    subject: dict[str, Any]
    rate_hz: float
    duration_s: float
    frames: int
    segments: dict[str, str]
    channels: dict[str, int]
    has: dict[str, bool]
    aliases: dict[str, str]
    conversions: list[str]
    gaps: list[Gap]
    problems: list[Finding]
    notes: list[Finding]

    def to_dict(self) -> dict[str, Any]:
        """Returns the same as nested dictionaries and lists."""
        return asdict(self)


def inspect_recording(
    path: str | PathLike[str], *, units: str | None = None, up: str | None = None
) -> Inspection:
    """Reads a recording and says what it holds.

    Args:
        path: an MVNX or BVH file.
        units: see `read_recording`.
        up: see `read_recording`.

    Raises:
        RecordingFileError: the file cannot be read at all.
    """
    return inspection_of(read_recording(path, units=units, up=up))


def inspection_of(recording: Recording) -> Inspection:
    """Says what a recording already read holds."""
    report, subject = recording.report, recording.subject
    serious = ("error", "warning")
    return Inspection(
        source=recording.source,
        format=recording.format,
        version=recording.version,
        sha256=recording.digest,
        subject={
            "label": subject.label or None,
            "skeleton_height_m": round(subject.skeleton_height_m, 4),
            "stated_height_m": subject.stated_height_m,
            "mass_kg": None,
        },
        rate_hz=recording.rate_hz,
        duration_s=float(recording.time_s[-1] - recording.time_s[0]),
        frames=recording.frames,
        segments={name: recording.segment_status[name] for name in recording.segment_names},
        channels=dict(report.channels),
        has={
            "joint_angles": recording.joint_angle_deg is not None,
            "landmarks": bool(recording.landmarks),
            "foot_contacts": recording.foot_contacts is not None,
        },
        aliases={file: house for file, house in report.aliases.items() if file != house},
        conversions=list(report.conversions),
        gaps=list(report.gaps),
        problems=[finding for finding in report.findings if finding.severity in serious],
        notes=[finding for finding in report.findings if finding.severity not in serious],
    )
