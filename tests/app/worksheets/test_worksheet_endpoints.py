"""Worksheets over HTTP: every score with its reason, or the place of what cannot be."""

import json
from typing import Any

import pytest
from starlette.testclient import TestClient

RULA: dict[str, Any] = {
    "upper_arm": {"flexion_deg": 85},
    "lower_arm": {"flexion_deg": 50},
    "wrist": {"flexion_deg": 10, "twist": "mid"},
    "neck": {"flexion_deg": 0},
    "trunk": {"flexion_deg": 0},
    "legs": {"supported_balanced": True},
}
REBA: dict[str, Any] = {
    "neck": {"flexion_deg": 5},
    "trunk": {"flexion_deg": 0},
    "legs": {"bilateral": True},
    "upper_arm": {"flexion_deg": 10},
    "lower_arm": {"flexion_deg": 80},
    "wrist": {"flexion_deg": 0},
    "load": {"kg": 2},
}


def test_rula_of_a_worked_case(api: TestClient) -> None:
    answer = api.post("/v1/worksheets/rula", json={"id": "a", "input": RULA})
    assert answer.status_code == 200, answer.text
    body = answer.json()
    expected = {
        "upper_arm": 3, "lower_arm": 2, "wrist": 2, "wrist_twist": 1, "posture_a": 4,
        "neck": 1, "trunk": 1, "legs": 1, "posture_b": 1, "final": 3, "action_level": 2,
    }  # fmt: skip
    assert {name: body[name] for name in expected} == expected
    assert set(expected) <= set(body["reasons"])
    assert (body["id"], body["method"], body["profile"]) == ("a", "rula", "paper")


def test_reba_answers_too(api: TestClient) -> None:
    body = api.post("/v1/worksheets/reba", json={"input": REBA}).json()
    assert (body["final"], body["action_level"]) == (1, 0)


@pytest.mark.parametrize(
    ("document", "pointer"),
    [
        ({}, "/input"),
        ([], ""),
        ({"input": {**RULA, "wrist": {"flexion_deg": "x"}}}, "/input/wrist/flexion_deg"),
        ({"input": {**RULA, "tail": {}}}, "/input/tail"),
        ({"input": RULA, "ties": "left"}, "/ties"),
        ({"input": RULA, "method": "reba"}, "/method"),
    ],
)
def test_a_sheet_that_cannot_be_scored_is_refused_at_its_place(
    api: TestClient, document: Any, pointer: str
) -> None:
    answer = api.post("/v1/worksheets/rula", json=document)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert [fault["pointer"] for fault in answer.json()["errors"]] == [pointer]


def test_not_a_number_is_refused(api: TestClient) -> None:
    text = json.dumps({"input": {**RULA, "neck": {"flexion_deg": float("nan")}}})
    answer = api.post(
        "/v1/worksheets/rula", content=text, headers={"Content-Type": "application/json"}
    )
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["pointer"] == "/input/neck/flexion_deg"


def test_another_method_is_not_there(api: TestClient) -> None:
    assert api.post("/v1/worksheets/owas", json={"input": RULA}).status_code in (404, 422)
