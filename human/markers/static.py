"""A person with markers on, from a trial in which they stand: the door of measuring."""

from collections.abc import Collection

import numpy as np

from human.generate import scale_model
from human.marker_recording import MarkerRecording
from human.markers.body import MarkerBody
from human.markers.errors import MarkerBodyError, MarkersRefusedError, MissingLandmarksError
from human.markers.landmarks import Landmarks, frames_with, in_axes, median
from human.markers.marker_set import MarkerSet, wearer
from human.markers.plausible import (
    length_findings,
    mass_findings,
    posture_findings,
    unit_findings,
)
from human.markers.recognise import RecognisedMarkers, match_markers, recognise_marker_set
from human.markers.skeleton import Skeleton, measure_skeleton
from human.model import Array, IntArray, Subject
from human.names import SEGMENTS
from human.recording import Finding

#: Frames measured at most, spread evenly over the trial.
_MOST_FRAMES = 400
#: A marker that moves more than this (m) over a trial shows that it is not a still one.
_STILL_M = 0.05
_BELOW_CHEST = ("L5", "L3", "T12")


def body_from_static(
    recording: MarkerRecording,
    subject: Subject,
    marker_set: MarkerSet | None = None,
    *,
    accept: Collection[str] = (),
    supported_mass_kg: float | None = None,
) -> MarkerBody:
    """Measures a person: segment lengths, and where each marker sits.

    The pose need not be a T-pose, and any trial may stand in for a still one: every length and
    place is a median over its frames. What no marker shows keeps the proportions that go with the
    stature.

    Args:
        recording: the static trial, or another in which the person stands upright.
        subject: the person; masses come from here.
        marker_set: what the markers are; recognised by their names if not given.
        accept: codes of findings to go on in spite of: ``units``, ``up``, ``sides``, ``height``,
            ``length``, ``persons``.
        supported_mass_kg: what force plates carry of the person standing, to compare.

    Returns:
        The scaled model with the recording's markers on it.

    Raises:
        UnknownMarkerSetError: no known set names half of the markers, and none was given.
        MissingLandmarksError: the four points of the pelvis are not seen together.
        MarkerBodyError: the pelvis's markers lie on a line.
        MarkersRefusedError: wrong units, vertical, sides or stature, not named in ``accept``.
    """
    matched = (
        recognise_marker_set(recording.marker_names)
        if marker_set is None
        else match_markers(recording.marker_names, marker_set)
    )
    source = recording.source
    frames = _frames(recording, matched)
    landmarks = Landmarks(recording, matched, frames)
    findings = [*_person_findings(matched, source), *unit_findings(landmarks, source)]
    _refuse(findings, accept, source)
    skeleton = measure_skeleton(landmarks, subject, matched.marker_set.pelvis_dip_deg)
    if "Pelvis" not in skeleton.axes:
        raise MarkerBodyError(
            f"{source}, pelvis: expected markers that span a plane, got all on one line or point; "
            "check which marker is which."
        )
    findings += posture_findings(landmarks, skeleton, source)
    _refuse(findings, accept, source)
    findings += length_findings(skeleton, subject.height_m, source)
    findings += mass_findings(subject.mass_kg, supported_mass_kg, source)
    _refuse(findings, accept, source)

    names, segments, offsets, sds, unplaced = [], [], [], [], []
    for name, place in matched.place_of.items():
        if not place.tracked:
            continue
        offset = _offset(recording, name, place.segment, frames, skeleton)
        if offset is None:
            unplaced.append(name)
            continue
        names.append(name)
        segments.append(SEGMENTS.index(place.segment))
        offsets.append(offset)
        sds.append(place.sd_m)
    observed = _observed(skeleton, {SEGMENTS[k] for k in segments})
    return MarkerBody(
        model=scale_model(subject, skeleton.offsets),
        marker_names=tuple(names),
        segment=np.array(segments, dtype=np.intp),
        offset=np.array(offsets).reshape(-1, 3),
        sd_m=np.array(sds),
        observed=observed,
        notes=(
            *_notes(recording, matched, frames, skeleton, unplaced, observed),
            *(finding.message for finding in findings),
        ),
    )


def _frames(recording: MarkerRecording, matched: RecognisedMarkers) -> IntArray:
    """Returns the frames in which the pelvis is seen."""
    needed = ["right_asis", "left_asis"]
    if matched.name_of_role("right_psis") and matched.name_of_role("left_psis"):
        needed += ["right_psis", "left_psis"]
    else:
        needed += ["sacrum"]
    names = [matched.name_of_role(role) for role in needed]
    missing = [role for role, name in zip(needed, names, strict=True) if name is None]
    if not missing:
        frames = frames_with(recording, [name for name in names if name], _MOST_FRAMES)
        if len(frames):
            return frames
    raise MissingLandmarksError(recording.source, "the pelvis", missing or needed)


def _person_findings(matched: RecognisedMarkers, source: str) -> list[Finding]:
    if not matched.others:
        return []
    taken = wearer(next(iter(matched.place_of)))
    text = (
        f"Markers of several persons: {', '.join(map(repr, [taken, *matched.others]))}; those of "
        f"{taken!r} are taken. Leave the others out of the file to measure one of them."
    )
    return [Finding("persons", "error", source, text)]


def _refuse(findings: list[Finding], accept: Collection[str], source: str) -> None:
    refused = [f for f in findings if f.severity == "error" and f.code not in accept]
    if refused:
        raise MarkersRefusedError(source, refused)


def _offset(
    recording: MarkerRecording, name: str, segment: str, frames: IntArray, skeleton: Skeleton
) -> Array | None:
    """Returns a marker's median place on its segment ``(3,)``, None where it cannot be told."""
    if segment not in skeleton.axes:
        return None
    column = recording.marker_names.index(name)
    seen = recording.valid[frames, column]
    world = np.where(seen[:, None], recording.position[frames, column], np.nan)
    local = median(in_axes(skeleton.axes[segment], world - skeleton.origin[segment]))
    return local if np.all(np.isfinite(local)) else None


def _observed(skeleton: Skeleton, carrying: set[str]) -> tuple[str, ...]:
    """Returns the segments whose posture markers show; the spine's between pelvis and chest too."""
    observed = {name for name in carrying if name in skeleton.axes}
    if "T8" in observed:
        observed.update(_BELOW_CHEST)
        # A girdle without a marker of its own is shown by the arm that hangs on it.
        observed.update(
            f"{side}Shoulder" for side in ("Right", "Left") if f"{side}UpperArm" in observed
        )
    if "Head" in observed:
        observed.add("Neck")
    return tuple(name for name in SEGMENTS if name in observed)


def _notes(
    recording: MarkerRecording,
    matched: RecognisedMarkers,
    frames: IntArray,
    skeleton: Skeleton,
    unplaced: list[str],
    observed: tuple[str, ...],
) -> list[str]:
    notes = [f"{recording.source}: markers of the set {matched.marker_set.name}."]
    if matched.missing:
        notes.append(f"Bony points of the set that are not there: {', '.join(matched.missing)}.")
    if matched.unknown:
        notes.append(f"Markers left out, not in the set: {', '.join(matched.unknown)}.")
    if unplaced:
        notes.append(
            f"Markers left out, their segment is not shown by others: {', '.join(unplaced)}."
        )
    hidden = [name for name in SEGMENTS if name not in observed]
    if hidden:
        notes.append(
            f"No marker shows {', '.join(hidden)}: they keep usual proportions and a reference "
            "posture."
        )
    if "T8" in observed:
        notes.append("L5, L3 and T12 have no marker of their own: they share the chest's turn.")
    notes += skeleton.notes
    forward = median(skeleton.axes["Pelvis"][..., 0])
    heading = np.rad2deg(np.arctan2(forward[1], forward[0]))
    notes.append(f"The person faces {heading:.0f} degrees from the world's x axis towards y.")
    travel = np.ptp(skeleton.origin["Pelvis"], axis=0)
    if float(np.linalg.norm(travel)) > _STILL_M:
        notes.append(
            f"Not a still trial: the pelvis travels {np.linalg.norm(travel):.2f} m; lengths and "
            "places are medians over it."
        )
    return notes
