"""Scores of a recording over HTTP, against the scorers called by hand on the same motion."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.scores.schemas import ScoreResult
from ergonomics import TaskContext, posture_angles, rula_inputs, score_rula_interval
from human import Subject, forward_kinematics
from human.pose import fit_recording
from human.readers import read_recording
from tests.app.conftest import upload

PERSON: dict[str, Any] = {"height_m": 1.72, "mass_kg": 68.0, "sex": "female"}


def ask(api: TestClient, recording: str, **options: Any) -> dict[str, Any]:
    answer = api.post("/v1/scores", json={"recording_id": recording, **PERSON, **options})
    assert answer.status_code == 200, answer.text
    body: dict[str, Any] = answer.json()
    return body


def test_scores_are_those_of_the_fitted_motion(api: TestClient, bvh: Path) -> None:
    body = ask(api, upload(api, bvh), hand_load_kg=4.0)
    ScoreResult.model_validate(body)
    fitted = fit_recording(read_recording(bvh), Subject(1.72, 68.0, "female"))
    poses = forward_kinematics(fitted.model, fitted.motion.q)
    angles = posture_angles(fitted.model, poses)
    for side in ("left", "right"):
        inputs = rula_inputs(angles, side=side, task=TaskContext(load_kg=2.0, total_load_kg=4.0))
        expected = score_rula_interval(inputs).high.final
        np.testing.assert_array_equal(body["sides"][side]["rula"], expected)
    worse = np.maximum(body["sides"]["left"]["rula"], body["sides"]["right"]["rula"])
    np.testing.assert_array_equal(body["rula"], worse)
    assert body["summary"]["rula"]["max"] == worse.max()
    assert body["time_s"][int(np.argmax(worse))] == body["summary"]["rula"]["time_of_max_s"]
    at = body["summary"]["rula"]["time_at_or_above"]
    assert at["3"] >= at["5"] >= at["7"] >= 0
    assert body["worst"][0]["score"] == worse.max()
    assert body["worst"][0]["reasons"][0].startswith("RULA")
    posture = body["posture"]
    assert len(posture["time_s"]) == len(posture["joint_position"])


def test_the_same_recording_and_options_give_the_same_bytes(api: TestClient, bvh: Path) -> None:
    request = {"recording_id": upload(api, bvh), **PERSON}
    first = api.post("/v1/scores", json=request)
    assert api.post("/v1/scores", json=request).content == first.content
    identifier = first.json()["id"]
    assert api.get(f"/v1/scores/{identifier}").content == first.content
    drawn = api.get(first.json()["model_urdf_url"])
    assert drawn.status_code == 200 and "<robot" in drawn.text


def test_a_load_raises_the_score_and_is_assumed_when_left_out(api: TestClient, bvh: Path) -> None:
    recording = upload(api, bvh)
    empty = ask(api, recording)
    heavy = ask(api, recording, hand_load_kg=30.0)
    assert np.mean(heavy["rula"]) > np.mean(empty["rula"])
    assumed = {entry["what"] for entry in empty["assumed"]}
    assert "load in the hand" in assumed
    assert "load in the hand" not in {entry["what"] for entry in heavy["assumed"]}


def test_what_is_not_known_of_the_person_is_assumed_and_named(api: TestClient, bvh: Path) -> None:
    answer = api.post("/v1/scores", json={"recording_id": upload(api, bvh)}).json()
    assert {"stature", "body mass"} <= {entry["what"] for entry in answer["assumed"]}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"height_m": 0.3}, "/height_m"),
        ({"height_m": 2.9}, "height"),
        ({"mass_kg": 400.0}, "/mass_kg"),
        ({"height_m": -1}, "/height_m"),
        ({"profile": "mine"}, "/profile"),
        ({"neutral_tolerance_deg": 80}, "/neutral_tolerance_deg"),
        ({"hand_load_kg": -2}, "/hand_load_kg"),
        ({"hand_load_kg": True}, "/hand_load_kg"),
        ({"height_m": "1.72"}, "/height_m"),
    ],
)
def test_an_impossible_person_or_option_is_refused(
    api: TestClient, bvh: Path, options: dict[str, Any], words: str
) -> None:
    body = {"recording_id": upload(api, bvh), **PERSON, **options}
    answer = api.post("/v1/scores", json=body)
    assert answer.status_code == 422
    assert words in answer.text


def test_an_unknown_recording_is_not_found(api: TestClient) -> None:
    for name in ("rec_" + "0" * 64, "../x"):
        answer = api.post("/v1/scores", json={"recording_id": name})
        assert answer.status_code == 404
