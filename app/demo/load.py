"""Loads the demonstration into a service's data, so that its page shows something at once."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from app.assessments.schemas import AssessmentRequest
from app.demo.files import DemoFiles, write_demo
from app.demo.scene import REVISION
from app.files import read_json, write_json
from app.scores.schemas import ScoreRequest
from app.service import ErgocastService
from app.version import VERSION

Progress = Callable[[str, float], None]

_STAMP = "demo.json"


def load_demo(service: ErgocastService, progress: Progress | None = None) -> dict[str, Any]:
    """Makes the demonstration and adds it to the service's data; does nothing where it is there.

    Args:
        service: Where to.
        progress: Told what is being done and the share done.

    Returns:
        The ids of the model, recording, score and assessment, the folder of the files, and whether
        anything was made.
    """
    tell = progress or (lambda what, done: None)
    folder = service.settings.data / "demo"
    stamp = folder / _STAMP
    mark = f"{VERSION}/{REVISION}"
    if stamp.is_file():
        known: dict[str, Any] = read_json(stamp)
        if known.get("mark") == mark and _present(service, known):
            return {**known, "made": False}
    files = write_demo(folder, lambda what, done: tell(what, 0.85 * done))
    return {**_add(service, files, stamp, mark, tell), "made": True}


def _present(service: ErgocastService, known: dict[str, Any]) -> bool:
    data = service.settings.data
    return all(
        (data / kind / str(known.get(key))).is_dir()
        for kind, key in (
            ("models", "model_id"),
            ("recordings", "recording_id"),
            ("assessments", "assessment_id"),
            ("scores", "score_id"),
        )
    )


def _add(
    service: ErgocastService, files: DemoFiles, stamp: Path, mark: str, tell: Progress
) -> dict[str, Any]:
    model = service.models.add_file(files.model, "demo operator")
    recording = service.recordings.add_file(files.recording, files.recording.name)
    tell("assessing the robot's candidates", 0.87)
    body = {**read_json(files.request), "model_id": model.id}
    request = AssessmentRequest.model_validate(body)
    write_json(files.request, body)
    operator = service.models.open(model.id)
    assessment = service.assessments.make(request, operator)
    tell("scoring the recording", 0.95)
    score = service.scores.answer(
        ScoreRequest(
            recording_id=recording.id, height_m=1.72, mass_kg=68.0, sex="female", hand_load_kg=6.0
        )
    )
    known = {
        "mark": mark,
        "model_id": model.id,
        "recording_id": recording.id,
        "assessment_id": _id_of(assessment),
        "score_id": _id_of(score),
        "folder": str(files.folder),
    }
    write_json(stamp, known)
    tell("done", 1.0)
    return known


def _id_of(content: bytes) -> str:

    return str(json.loads(content)["id"])
