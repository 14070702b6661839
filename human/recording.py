"""A recording as read: segment poses over time in house units and axes, and how they were obtained.

World axes are z up; lengths are metres, times seconds, quaternions ``xyzw``. A segment's axes are
those of the human model: parallel to the world's (x forward, y left, z up) in the T-pose, origin at
the segment's proximal joint. Joint angles do not appear here: `human.pose` computes them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Severity = Literal["note", "warning", "error"]
Status = Literal["measured", "interpolated", "unmeasured"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing noticed while reading.

    Attributes:
        code: stable word for machines, such as ``sides`` or ``first-frame``.
        severity: an ``error`` is refused by `fit_recording` unless its code is accepted explicitly.
        place: where in the file.
        message: what it is and what it means, in one sentence.
    """

    code: str
    severity: Severity
    place: str
    message: str


@dataclass(frozen=True, slots=True)
class Gap:
    """A hole in the time axis: no frame between two instants (s)."""

    start_s: float
    end_s: float
    missing_frames: int


@dataclass(frozen=True, slots=True)
class ReadingReport:
    """What was done to the file's content on the way in, and what was noticed."""

    conversions: tuple[str, ...] = ()
    aliases: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    gaps: tuple[Gap, ...] = ()
    findings: tuple[Finding, ...] = ()
    channels: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True, slots=True)
class RecordedSubject:
    """What the file says of the person. Recordings rarely state height, never mass.

    Attributes:
        label: the name in the file, empty when there is none.
        skeleton_height_m: top of head above the lowest point of the feet with the file's skeleton
            in T-pose; an estimate of stature, not a statement of it.
        stated_height_m: the stature stated in the file, if any.
    """

    label: str
    skeleton_height_m: float
    stated_height_m: float | None = None


@dataclass(frozen=True, slots=True)
class Recording:
    """A motion as recorded.

    Attributes:
        source: file name, without its folder.
        format: ``mvnx`` or ``bvh``.
        version: of the format, as stated or recognised.
        time_s: ``(frames,)`` strictly increasing.
        rate_hz: nominal frame rate.
        segment_names: house names of the segments present, parents first.
        orientation_xyzw: ``(frames, segments, 4)`` segment axes in world axes.
        position: ``(frames, segments, 3)`` segment origins in the world, m.
        joint_offset: position of a segment's origin in the axes of its nearest present ancestor, m.
        end_offset: position of a segment's far end in its own axes, m, where the file has one.
        landmarks: per segment, named bony points in its axes, m.
        joint_angle_deg: ``(frames, joints, 3)`` as the file states them (lateral, axial, flexion;
            ZXY), or None; read for comparison, not used by `fit_recording`.
        joint_angle_xzy_deg: the same in the file's second (XZY) decomposition, or None.
        joint_angle_names: house names of the joints in these two.
        foot_contacts: ``(frames, contacts)`` 0 or 1, or None.
        foot_contact_names: names of the contacts.
        segment_status: how each segment's orientation was obtained.
        subject: what is known of the person.
        report: conversions, aliases, gaps, findings.
        digest: SHA-256 of the file.
    """

    source: str
    format: str
    version: str
    time_s: Array
    rate_hz: float
    segment_names: tuple[str, ...]
    orientation_xyzw: Array
    position: Array
    joint_offset: Mapping[str, Array]
    end_offset: Mapping[str, Array]
    landmarks: Mapping[str, Mapping[str, Array]]
    joint_angle_deg: Array | None
    joint_angle_xzy_deg: Array | None
    joint_angle_names: tuple[str, ...]
    foot_contacts: Array | None
    foot_contact_names: tuple[str, ...]
    segment_status: Mapping[str, Status]
    subject: RecordedSubject
    report: ReadingReport
    digest: str

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.time_s)

    @property
    def errors(self) -> tuple[Finding, ...]:
        """The findings that `fit_recording` refuses unless accepted."""
        return tuple(f for f in self.report.findings if f.severity == "error")
