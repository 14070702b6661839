"""From the files of a take to a body in motion: the one door for skeletons and for markers."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.problems import Unreadable
from app.takes import Part, Take
from human import HumanModel, JointLog, Motion, Subject, generate_model
from human.errors import RecordingError
from human.mapped_arrays import forget_pages
from human.marker_recording import MarkerRecording, PlateForces
from human.markers import (
    MarkerError,
    body_from_static,
    fit_markers_in_windows,
)
from human.names import JOINT_OF_SEGMENT
from human.pose import fit_recording
from human.readers import (
    TablePart,
    marker_format,
    read_marker_set,
    read_markers,
    read_plates,
    read_recording,
    read_table,
)
from human.recording import Recording

Array = NDArray[np.float64]
T = TypeVar("T")
#: What a reader gives.
Read = Recording | MarkerRecording | PlateForces | JointLog
#: A person, or how to tell them from the motion as read.
Who = Subject | Callable[[Recording | MarkerRecording], Subject]

#: Seconds of motion worked on at once; the memory used grows with it, and with nothing else.
WINDOW_S = 60.0


@dataclass(eq=False)
class BodyInMotion:
    """A person scaled to a recording, and what they did, window by window.

    Attributes:
        model: The person's body.
        subject: The person.
        source: What the recording is called.
        format: Of the motion's file.
        digest: SHA-256 of the motion's file.
        time_s: ``(frames,)`` s, of the recording; frames that could not be fitted are not in the
            windows.
        rate_hz: Nominal.
        by_markers: Whether segments were seen in the world, each by its own markers.
        unobserved: Segments whose pose is a placeholder.
        plates: Force plates, on their own clock, or None.
        plates_from: Where they came from, in words.
        findings: What is not as it should be in the files themselves.
        fit: Filled as the windows are taken: how well body and recording meet.
        notes: Likewise: what was assumed and noticed, each once.
    """

    model: HumanModel
    subject: Subject
    source: str
    format: str
    digest: str
    time_s: Array
    rate_hz: float
    by_markers: bool
    unobserved: frozenset[str]
    plates: PlateForces | None
    plates_from: str
    findings: tuple[str, ...]
    _windows: Callable[["BodyInMotion"], Iterator[Motion]]
    fit: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def windows(self) -> Iterator[Motion]:
        """Yields the motion in stretches that follow each other."""
        yield from self._windows(self)

    def whole(self) -> Motion:
        """Returns all of the motion at once."""
        return joined(list(self.windows()))

    def say(self, *notes: str) -> None:
        """Adds notes that were not there yet."""
        self.notes += [note for note in dict.fromkeys(notes) if note not in self.notes]


def joined(motions: Sequence[Motion]) -> Motion:
    """Returns stretches that follow each other as one motion."""
    first = motions[0]
    if len(motions) == 1:
        return first
    return replace(
        first,
        time_s=np.concatenate([one.time_s for one in motions]),
        q=np.concatenate([one.q for one in motions]),
        v=np.concatenate([one.v for one in motions]),
        a=np.concatenate([one.a for one in motions]),
        flags={
            name: np.concatenate([one.flags[name] for one in motions])
            for name in first.flags
            if all(name in one.flags for one in motions)
        },
    )


def body_in_motion(
    take: Take, who: Who, *, accept: Sequence[str] = (), window_s: float = WINDOW_S
) -> BodyInMotion:
    """Reads a take and fits the person to it.

    Args:
        take: The motion and what goes with it.
        who: The person, or a function that tells them from the motion as read.
        accept: Codes of findings to go on in spite of.
        window_s: Seconds fitted at once.

    Raises:
        Unreadable: A file cannot be read, or holds something else than its role says.
        HumanError: The person cannot be fitted.
    """
    kind = marker_format(take.motion.path)
    refuse_forces_alone(take)
    if kind is None:
        return _skeleton(take, who, accept, window_s)
    if kind in ("csv", "mat") and take.columns is not None:
        columns = take.columns.path
        only: tuple[TablePart, ...] = ("markers", "joints") if take.grf else ()
        table = _named(take.motion, lambda: read_table(take.motion.path, columns, only))
        if table.joints is not None and table.joints.joint_names and table.markers is None:
            return _log(take, table.joints, table.plates, who, window_s)
    return _markers(take, who, accept, window_s)


def refuse_forces_alone(take: Take) -> None:
    """Refuses a table of forces where a motion is wanted.

    Raises:
        Unreadable: It is one.
    """
    if marker_format(take.motion.path) == "opensim-table":
        raise Unreadable(
            f"{take.motion.name}: expected a motion, got a table of the MOT kind. "
            f"Forces are given as grf:{take.motion.name} beside a motion."
        )


def forces_of(take: Take) -> PlateForces | None:
    """Reads the take's own file of forces, if it has one.

    Raises:
        Unreadable: It cannot be read.
    """
    return None if take.grf is None else _plates(take.grf, take)


def standing_mass_kg(take: Take) -> float | None:
    """Returns the mass that plates carry in the static trial, None where there are none."""
    plates: PlateForces | None = None
    if take.static_grf is not None:
        plates = _plates(take.static_grf, take)
    elif take.static is not None:
        plates = _marker_recording(take.static, take).plates
    return None if plates is None else plates.supported_mass_kg()


def _named(part: Part, read: Callable[[], T]) -> T:
    """Reads a file; errors call it what its owner does."""
    try:
        return read()
    except (RecordingError, MarkerError) as error:
        text = str(error).replace(part.path.name, part.name)
        raise Unreadable(text if part.name in text else f"{part.name}: {text}") from error


def _marker_recording(part: Part, take: Take) -> MarkerRecording:
    columns = take.columns.path if take.columns else None
    apart = take.grf is not None or take.static_grf is not None
    return _named(part, lambda: read_markers(part.path, columns, plates_apart=apart))


def _plates(part: Part, take: Take) -> PlateForces:
    columns = take.columns.path if take.columns else None
    return _named(part, lambda: read_plates(part.path, columns))


def _noticed(*files: tuple[Part | None, Read | None]) -> tuple[str, ...]:
    """Returns what readers found wrong in files, in words."""
    found: list[str] = []
    for part, read in files:
        if part is None or read is None:
            continue
        report = read.report
        if report.gaps:
            missing = sum(gap.missing_frames for gap in report.gaps)
            found.append(
                f"{part.name}: {missing} frames are missing, the first after "
                f"{report.gaps[0].start_s:.2f} s"
            )
        found += [
            f"{part.name}, {one.place}: {one.message}"
            for one in report.findings
            if one.severity != "note"
        ]
    return tuple(dict.fromkeys(found))


def _in_motion(
    take: Take,
    subject: Subject,
    model: HumanModel,
    read: Recording | MarkerRecording | JointLog,
    windows: Callable[[BodyInMotion], Iterator[Motion]],
    unobserved: Collection[str],
    own_plates: PlateForces | None,
    noticed: Sequence[tuple[Part | None, Read | None]],
) -> BodyInMotion:
    """Puts together what every kind of recording tells of itself; its own forces give way."""
    plates = forces_of(take) or own_plates
    body = BodyInMotion(
        model=model,
        subject=subject,
        source=take.motion.name,
        format=read.format,
        digest=read.digest,
        time_s=read.time_s,
        rate_hz=read.rate_hz,
        by_markers=isinstance(read, MarkerRecording),
        unobserved=frozenset(unobserved),
        plates=plates,
        plates_from=(take.grf or take.motion).name if plates else "",
        findings=_noticed(*noticed, (take.grf or take.motion, plates)),
        _windows=windows,
    )
    body.fit["conversions"] = list(read.report.conversions)
    return body


def _skeleton(take: Take, who: Who, accept: Sequence[str], window_s: float) -> BodyInMotion:
    recording = _named(take.motion, lambda: read_recording(take.motion.path))
    subject = who(recording) if callable(who) else who
    fitted = _named(take.motion, lambda: fit_recording(recording, subject, accept=accept))
    missing = {name for name, state in recording.segment_status.items() if state == "unmeasured"}
    body = _in_motion(
        take,
        subject,
        fitted.model,
        recording,
        lambda _: _stretches(fitted.motion, window_s),
        missing | set(fitted.diagnostics.filled_segments),
        None,
        [(take.motion, recording)],
    )
    body.fit.update(fitted.diagnostics.summary())
    body.say(*fitted.diagnostics.notes)
    if take.static is not None:
        body.say(f"{take.static.name} is not used: {recording.format} has a skeleton of its own")
    return body


def _log(
    take: Take, log: JointLog, own_plates: PlateForces | None, who: Who, window_s: float
) -> BodyInMotion:
    if callable(who):
        raise Unreadable(
            f"{take.motion.name}: joint angles do not show who moves. State stature and mass."
        )
    model = generate_model(who)
    motion = _named(take.motion, lambda: log.to_motion(model))
    told = {name.rpartition("_")[0] for name in (*log.joint_names, *log.kept)}
    untold = {segment for segment, joint in JOINT_OF_SEGMENT.items() if joint not in told}

    def windows(_: BodyInMotion) -> Iterator[Motion]:
        return _stretches(motion, window_s)

    body = _in_motion(take, who, model, log, windows, untold, own_plates, [])
    body.say(
        *(f"{what}: {why}" for what, why in motion.provenance.assumed.items()),
        *(finding.message for finding in log.report.findings),
        "lengths are those usual at this stature: a log of angles does not show them",
    )
    return body


def _stretches(motion: Motion, window_s: float) -> Iterator[Motion]:
    number = np.floor((motion.time_s - motion.time_s[0]) / window_s)
    for frames in np.split(np.arange(len(motion)), np.flatnonzero(np.diff(number)) + 1):
        yield motion.select(frames)


def _markers(take: Take, who: Who, accept: Sequence[str], window_s: float) -> BodyInMotion:
    recording = _marker_recording(take.motion, take)
    subject = who(recording) if callable(who) else who
    part = take.static or take.motion
    static = recording if take.static is None else _marker_recording(part, take)
    given = take.marker_set
    marker_set = None if given is None else _named(given, lambda: read_marker_set(given.path))
    mass = standing_mass_kg(take)
    body = _named(
        part,
        lambda: body_from_static(
            static, subject, marker_set, accept=accept, supported_mass_kg=mass
        ),
    )

    def windows(out: BodyInMotion) -> Iterator[Motion]:
        square, count, outliers = 0.0, 0.0, 0.0
        fitting = fit_markers_in_windows(body, recording, seconds=window_s)
        while (fitted := _named(take.motion, lambda: next(fitting, None))) is not None:
            believed = (fitted.residual_m > 0.0) & ~fitted.outlier
            square = square + np.sum(np.where(believed, fitted.residual_m, 0.0) ** 2, axis=0)
            count = count + np.sum(believed, axis=0)
            outliers = outliers + np.sum(fitted.outlier, axis=0)
            out.fit.update(_marker_fit(fitted.marker_names, square, count, outliers))
            out.say(*fitted.notes)
            yield fitted.motion
            forget_pages(recording.position)

    out = _in_motion(
        take,
        subject,
        body.model,
        recording,
        windows,
        body.unobserved(),
        recording.plates,
        [(take.motion, recording), (take.static, static)],
    )
    # Uploaded files are kept under other names than their owners gave them.
    out.say(*(note.replace(part.path.name, part.name) for note in body.notes))
    if take.static is None:
        out.say("the person was scaled from the motion itself: no static trial was given")
    return out


def _marker_fit(
    names: Sequence[str], square: Array, count: Array, outliers: Array
) -> dict[str, Any]:
    """Returns the residuals' root mean squares, all together and of the worst markers."""
    rms = np.sqrt(square / np.maximum(count, 1))
    worst = np.argsort(-rms)[:5].tolist()
    return {
        "marker_rms_m": float(np.sqrt(np.sum(square) / max(float(np.sum(count)), 1.0))),
        "markers": int(np.count_nonzero(count)),
        "worst_markers_rms_m": {names[k]: float(rms[k]) for k in worst if count[k]},
        "outliers": {names[k]: int(outliers[k]) for k in np.flatnonzero(outliers).tolist()},
    }
