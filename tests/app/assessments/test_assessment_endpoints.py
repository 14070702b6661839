"""Assessments over HTTP: answered, stored, listed, played back, or refused with the place."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.settings import Settings
from human import forward_kinematics, frame_poses
from tests.app.conftest import BASE_URL, Scene

PROBLEM = "application/problem+json"


def test_an_assessment_is_answered_stored_and_listed(
    api: TestClient, scene: Scene, model_id: str
) -> None:
    answer = api.post("/v1/assessments", json=scene.request(model_id, name="three ways"))
    assert answer.status_code == 200, answer.text
    body = answer.json()
    assert [one["id"] for one in body["candidates"]] == [c["id"] for c in scene.candidates()]
    again = api.post("/v1/assessments", json=scene.request(model_id, name="three ways"))
    assert again.content == answer.content
    assert api.get(f"/v1/assessments/{body['id']}").content == answer.content
    items = api.get("/v1/assessments").json()["items"]
    assert [(i["id"], i["n_candidates"], i["name"]) for i in items] == [
        (body["id"], 3, "three ways")
    ]


def test_two_services_give_the_same_answer(
    api: TestClient, scene: Scene, model_id: str, tmp_path: Path
) -> None:
    first = api.post("/v1/assessments", json=scene.request(model_id)).json()
    with TestClient(create_app(Settings(data=tmp_path / "other")), base_url=BASE_URL) as other:
        other.post(
            "/v1/models",
            content=scene.file.read_bytes(),
            headers={"Content-Type": "application/vnd.ergocast.model"},
        )
        second = other.post("/v1/assessments", json=scene.request(model_id)).json()
    assert {**first, "created": ""} == {**second, "created": ""}


def test_the_posture_plays_back_with_the_hand_on_the_path(
    api: TestClient, scene: Scene, model_id: str
) -> None:
    body = api.post("/v1/assessments", json=scene.request(model_id, sigma_x=0.0)).json()
    url = f"/v1/assessments/{body['id']}/candidates/direct/posture"
    posture = api.get(url).json()
    assert posture["joint_names"] == list(scene.model.dof_names)
    frames = len(posture["time_s"])
    assert np.shape(posture["joint_position"]) == (frames, 66)
    assert 1 <= len(posture["samples"]) <= 5
    assert set(posture["effort_p50_nm"]) == set(posture["effort_scale_nm"])
    for angles in (posture["joint_position"], *posture["samples"]):
        q = np.hstack([posture["base"]["position_m"], posture["base"]["orientation_xyzw"], angles])
        q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
        _, hand = frame_poses(scene.model, forward_kinematics(scene.model, q), "RightHandCOM")
        np.testing.assert_allclose(hand, posture["target"]["position_m"], atol=2e-3)
    # Kept rounded to single precision, and the same each time.
    assert api.get(url).json() == posture
    with_posture = api.post(
        "/v1/assessments", json=scene.request(model_id, sigma_x=0.0, include_posture=True)
    ).json()
    inside = with_posture["candidates"][0]["posture"]
    np.testing.assert_allclose(inside["joint_position"], posture["joint_position"], atol=1e-5)


def test_a_rejected_candidate_has_no_posture(api: TestClient, scene: Scene, model_id: str) -> None:
    candidates = [{**scene.candidates()[0], "frame_id": "moon"}, scene.candidates()[1]]
    body = api.post("/v1/assessments", json=scene.request(model_id, candidates=candidates)).json()
    answer = api.get(f"/v1/assessments/{body['id']}/candidates/direct/posture")
    assert answer.status_code == 404
    assert "see its problem" in answer.json()["detail"]
    missing = api.get(f"/v1/assessments/{body['id']}/candidates/none/posture")
    assert missing.status_code == 404


def test_long_work_is_an_operation_with_the_same_result(
    api: TestClient, scene: Scene, model_id: str
) -> None:
    accepted = api.post(
        "/v1/assessments", json=scene.request(model_id), headers={"Prefer": "respond-async"}
    )
    assert accepted.status_code == 202
    assert accepted.headers["Retry-After"] == "1"
    location = accepted.headers["Location"]
    for _ in range(300):
        operation = api.get(location).json()
        if operation["state"] not in ("queued", "running"):
            break
        time.sleep(0.05)
    assert operation["state"] == "succeeded", operation
    later = api.get(operation["result_url"]).json()
    at_once = api.post("/v1/assessments", json=scene.request(model_id)).json()
    assert later == at_once
    events = api.get(f"{location}/events").text
    assert events.startswith("id: 1\nevent: queued\n")
    assert "event: succeeded" in events
    resumed = api.get(f"{location}/events", headers={"Last-Event-ID": "2"}).text
    assert resumed and not resumed.startswith("id: 1\n")
    gone = api.post(f"{location}/cancel")
    assert (gone.status_code, gone.headers["content-type"]) == (409, PROBLEM)


def test_many_points_go_to_the_background(tmp_path: Path, scene: Scene) -> None:
    settings = Settings(data=tmp_path / "data", sync_point_limit=44)
    with TestClient(create_app(settings), base_url=BASE_URL) as api:
        model = api.post(
            "/v1/models",
            content=scene.file.read_bytes(),
            headers={"Content-Type": "application/vnd.ergocast.model"},
        ).json()
        accepted = api.post("/v1/assessments", json=scene.request(model["id"]))
        assert accepted.status_code == 202
        fewer = scene.request(model["id"], candidates=scene.candidates()[:2])
        assert api.post("/v1/assessments", json=fewer).status_code == 200


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"payload_kg": -1}, "/payload_kg"),
        ({"payload_share": 1.5}, "/payload_share"),
        ({"samples": 1}, "/samples"),
        ({"seed": "x"}, "/seed"),
        ({"candidates": []}, "/candidates"),
        ({"candidates": "all"}, "/candidates"),
        ({"surprise": 1}, "/surprise"),
        ({"sigma_x": -0.1}, "/sigma_x/position_m"),
        ({"grasp": "tight"}, "/grasp"),
        ({"hand_force_n": [0, 1]}, "/hand_force_n"),
        ({"start": {}}, "/start/T_world_pelvis"),
        ({"start": {"T_world_pelvis": [[1, 0], [0, 1]]}}, "/start/T_world_pelvis"),
        ({"start": {"T_world_pelvis": {"position_m": [0, 0, 1], "orientation_xyzw": [0, 0, 0, 2]}}},
         "/start/T_world_pelvis"),
        ({"frames": {"a/b": {"position_m": [0, 0]}}}, "/frames/a~1b/position_m"),
        ({"foot_split": {"left": 0.5, "right": 0.6}}, "/foot_split"),
        ({"hand_force_n": [0, 0, 1e300]}, "/hand_force_n/2"),
        ({"payload_kg": "4"}, "/payload_kg"),
        ({"payload_share": True}, "/payload_share"),
        ({"sigma_x": True}, "/sigma_x"),
        ({"samples": True}, "/samples"),
    ],
)  # fmt: skip
def test_a_malformed_request_is_refused_at_its_place(
    api: TestClient, scene: Scene, model_id: str, changes: dict[str, Any], pointer: str
) -> None:
    answer = api.post("/v1/assessments", json=scene.request(model_id, **changes))
    assert answer.status_code == 422
    assert answer.headers["content-type"] == PROBLEM
    body = answer.json()
    assert body["type"] == "/problems/invalid-request"
    assert [fault["pointer"] for fault in body["errors"]] == [pointer]
    assert body["errors"][0]["expected"]
    assert api.get("/v1/assessments").json() == {"items": []}


def test_numbers_that_are_not_finite_are_refused(
    api: TestClient, scene: Scene, model_id: str
) -> None:
    shared = json.dumps(scene.request(model_id, payload_kg=float("nan")))
    answer = api.post(
        "/v1/assessments", content=shared, headers={"Content-Type": "application/json"}
    )
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["pointer"] == "/payload_kg"
    # In a candidate it is a problem of that slot alone.
    candidates = scene.candidates()
    candidates[1]["position_m"][3][0] = float("inf")
    slot = json.dumps(scene.request(model_id, candidates=candidates))
    answer = api.post("/v1/assessments", content=slot, headers={"Content-Type": "application/json"})
    assert answer.status_code == 200
    problems = [one["problem"] for one in answer.json()["candidates"]]
    assert problems[0] is None and problems[2] is None
    assert problems[1]["errors"][0]["pointer"] == "/candidates/1/position_m/3/0"


def test_half_a_surrogate_pair_goes_back_as_it_came(
    api: TestClient, scene: Scene, model_id: str, settings: Settings
) -> None:
    candidates = [{**scene.candidates()[0], "id": "\ud800"}, scene.candidates()[1]]
    sent = json.dumps(scene.request(model_id, candidates=candidates))
    answer = api.post("/v1/assessments", content=sent, headers={"Content-Type": "application/json"})
    assert answer.status_code == 200
    first, second = json.loads(answer.content)["candidates"]
    assert first["id"] == "\ud800" and second["problem"] is None
    assert first["problem"]["errors"][0]["pointer"] == "/candidates/0/id"
    start = {"T_world_pelvis": {"position_m": [0, 0, 1]}, "joint_position": {"\ud800": 0.0}}
    sent = json.dumps(scene.request(model_id, start=start))
    answer = api.post("/v1/assessments", content=sent, headers={"Content-Type": "application/json"})
    assert (answer.status_code, answer.headers["content-type"]) == (422, PROBLEM)


@pytest.mark.parametrize(
    ("content", "kind", "status"),
    [
        ("{", "application/json", 422),
        ("(" * 100_000, "application/json", 422),
        ('{"seed": ' + "9" * 5000 + "}", "application/json", 422),
        ("[]", "application/json", 422),
        ("[" * 100_000, "application/json", 422),
        ("{}", "text/plain", 422),
        (" " * (1 << 17) + "{}", "application/json", 413),
    ],
)
def test_a_body_that_is_no_request_is_refused(
    tmp_path: Path, content: str, kind: str, status: int
) -> None:
    settings = Settings(data=tmp_path / "data", max_body_bytes=1 << 17)
    with TestClient(create_app(settings), base_url=BASE_URL) as api:
        answer = api.post("/v1/assessments", content=content, headers={"Content-Type": kind})
    assert answer.status_code == status
    assert answer.headers["content-type"] == PROBLEM
    assert status == 413 or [fault["pointer"] for fault in answer.json()["errors"]] == [""]


def test_an_unknown_model_is_not_found(api: TestClient, scene: Scene) -> None:
    for name in ("mdl_" + "0" * 64, "../../etc/passwd", ""):
        answer = api.post("/v1/assessments", json=scene.request(name))
        assert answer.status_code == 404, name
