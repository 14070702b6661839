"""From a take to its estimate: person, motion, feet, run; time series on disk, summary in hand.

Shared by the command line and the service. Everything is done in windows, so that memory does not
grow with the recording.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from app.estimates.columns import CONVENTIONS, columns_of
from app.estimates.feet import FeetOfTake
from app.estimates.schemas import EstimateOptions
from app.estimates.series import series_writer
from app.estimates.summary import summarised
from app.files import write_bytes
from app.fitting import (
    BodyInMotion,
    body_in_motion,
    refuse_forces_alone,
    standing_mass_kg,
)
from app.problems import Fault, InvalidRequest, Unreadable, pointer
from app.takes import Take
from app.version import VERSION
from estimation import ModelErrors, RecordingRun, RunInputError, RunSettings, compile_kernel
from human import Subject, SubjectError, to_urdf

#: Told what is being done, frames done and frames in all.
Progress = Callable[[str, int, int], None]

#: Body mass index, kg/m^2, that plates are believed without being told the person's mass.
_STANDING_INDEX = (15.0, 50.0)
SERIES, BODY = "series.parquet", "body.urdf"


def estimate_take(
    take: Take, options: EstimateOptions, folder: Path, progress: Progress | None = None
) -> dict[str, Any]:
    """Estimates one take.

    Args:
        take: The motion and what goes with it.
        options: Who the person is and how to estimate.
        folder: Where the time series and the person's URDF go; whole or not at all.
        progress: Told how far it is; what it raises stops the work and leaves nothing.

    Returns:
        The summary, ready for JSON.

    Raises:
        InvalidRequest: The person cannot be, or an option does not fit the recording.
        Unreadable: A file cannot be read.
        HumanError, EstimationError: The recording cannot be fitted or estimated.
    """
    tell = progress or (lambda what, done, total: None)
    tell(f"reading {take.motion.name}", 0, 0)
    refuse_forces_alone(take)
    subject, person = _subject(take, options)
    # A second at most, where waiting is no harm; the estimator itself never waits for a compiler.
    compile_kernel()
    body = body_in_motion(take, subject, accept=options.accept)
    _check_against(body, options)
    feet = FeetOfTake(body, options)
    settings = _settings(options, body)
    run = RecordingRun(body.model, settings)
    files = _files(take)
    metadata = {
        "ergocast": VERSION,
        "conventions": CONVENTIONS,
        "options": options.model_dump(mode="json"),
        "files": files,
        "person": person,
    }
    total = len(body.time_s)
    written = 0
    with series_writer(folder / SERIES, metadata) as writer:
        for motion, forces in feet.windows():
            for chunk in run.add(motion, forces):
                if len(chunk):
                    names = body.model.dof_names, body.model.joint_names[: chunk.effort_nm.shape[1]]
                    writer.append(columns_of(chunk, motion, forces, *names))
                written += len(chunk)
                tell(f"estimating {take.motion.name}", min(written, total), total)
        try:
            summary = run.finish()
        except RunInputError as error:
            raise Unreadable(f"{take.motion.name}: {error}") from error
    write_bytes(folder / BODY, to_urdf(body.model).encode())
    tell(f"estimating {take.motion.name}", total, total)
    return {
        "source": take.motion.name,
        "options": options.model_dump(mode="json"),
        "person": {**person, "model_mass_kg": round(summary.body_mass_kg, 3)},
        "files": files,
        "software": f"ergocast {VERSION}",
        **summarised(folder / SERIES, summary, body, feet),
    }


def _subject(take: Take, options: EstimateOptions) -> tuple[Subject, dict[str, Any]]:
    mass, mass_from = options.mass_kg, "given"
    if mass is None:
        mass, mass_from = standing_mass_kg(take), "the plates of the static trial"
    if mass is None:
        fault = Fault(
            pointer("mass_kg"), "body mass in kg, or a static trial on plates", "neither",
            "a kilogram too little in the body is a kilogram too much in the hands",
        )  # fmt: skip
        raise InvalidRequest(f"{take.motion.name}: the person's mass is needed.", [fault])
    low, high = (index * options.height_m**2 for index in _STANDING_INDEX)
    if options.mass_kg is None and not low <= mass <= high:
        fault = Fault(
            pointer("mass_kg"), "the body mass in kg", f"{mass:.1f} kg on the plates",
            f"of a person {options.height_m:g} m tall: a foot may stand beside them, or their "
            "unit is another",
        )  # fmt: skip
        raise InvalidRequest(f"{take.motion.name}: the person's mass is needed.", [fault])
    try:
        subject = Subject(options.height_m, mass, options.sex)
    except SubjectError as error:
        field = "height_m" if error.quantity.startswith("height") else "mass_kg"
        fault = Fault(pointer(field), error.accepted, repr(error.value), "of no adult")
        raise InvalidRequest(str(error), [fault]) from error
    person = {
        "height_m": options.height_m,
        "mass_kg": round(mass, 3),
        "mass_from": mass_from,
        "sex": options.sex,
    }
    return subject, person


def _check_against(body: BodyInMotion, options: EstimateOptions) -> None:
    """Refuses options that this recording cannot meet, before any work."""
    faults = []
    first, last = float(body.time_s[0]), float(body.time_s[-1])
    tare_s = options.tare_s
    if tare_s is not None and not (tare_s[0] < last and tare_s[1] > first):
        expected = f"a stretch of the recording, {first:.2f} to {last:.2f} s"
        got = f"{tare_s[0]:g} to {tare_s[1]:g} s"
        faults.append(Fault(pointer("tare_s"), expected, got, "nothing was recorded there"))
    plates = [] if body.plates is None else [plate.name for plate in body.plates.plates]
    for name in options.assign:
        if name not in plates:
            expected = f"one of the plates: {', '.join(plates) or 'there are none'}"
            faults.append(Fault(pointer("assign", name), expected, repr(name), "no such plate"))
    if faults:
        raise InvalidRequest(f"{body.source}: an option does not fit the recording.", faults)


def _settings(options: EstimateOptions, body: BodyInMotion) -> RunSettings:
    return RunSettings(
        method=options.method,
        free_hands=options.hands,
        definition=options.definition,
        tare_s=options.tare_s,
        unobserved=tuple(name for name in body.model.segment_names if name in body.unobserved),
        model_errors=_model_errors(body) if options.bands == "noise_and_model" else None,
    )


def _model_errors(body: BodyInMotion) -> ModelErrors:
    """Markers on the feet show where they stand on their plates, whatever the angles above."""
    feet = {"RightFoot", "LeftFoot"}
    return ModelErrors(feet_seen=body.by_markers and not feet & body.unobserved)


def _files(take: Take) -> list[dict[str, str]]:
    found = []
    for role, part in take.parts().items():
        with part.path.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
        found.append({"role": role, "name": part.name, "sha256": digest})
    return found
