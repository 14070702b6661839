"""Model files over HTTP: kept by content, refused when they are something else."""

import json

import pytest
from starlette.testclient import TestClient

from app.settings import Settings
from human import from_urdf
from tests.app.conftest import Scene

MODEL = {"Content-Type": "application/vnd.ergocast.model"}


def test_a_model_is_kept_listed_and_drawn(api: TestClient, scene: Scene, model_id: str) -> None:
    again = api.post("/v1/models?name=x", content=scene.file.read_bytes(), headers=MODEL).json()
    assert again["id"] == model_id
    items = api.get("/v1/models").json()["items"]
    assert [item["id"] for item in items] == [model_id]
    record = api.get(f"/v1/models/{model_id}").json()
    assert record["name"] == "operator.safetensors"
    assert record["subject"] == {"height_m": 1.72, "mass_kg": 68.0, "sex": "female"}
    assert (record["hand"], record["method"]) == ("right", "cov-ik")
    drawn = api.get(record["urdf_url"])
    assert drawn.headers["content-type"].startswith("text/xml")
    assert "<visual>" in drawn.text
    assert from_urdf(drawn.text).dof_names == scene.model.dof_names


@pytest.mark.parametrize(
    ("content", "status"),
    [(b"", 415), (b"short", 415), (b"\x00" * 100, 415), (b"<xml/>" * 9, 415)],
)
def test_something_else_than_a_model_is_refused(
    api: TestClient, settings: Settings, content: bytes, status: int
) -> None:
    answer = api.post("/v1/models", content=content, headers=MODEL)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert not list(settings.data.rglob("*.part*"))
    assert api.get("/v1/models").json() == {"items": []}


def test_a_damaged_or_other_version_is_refused(api: TestClient, scene: Scene) -> None:
    whole = scene.file.read_bytes()
    cut = api.post("/v1/models?name=mine", content=whole[: len(whole) // 2], headers=MODEL)
    assert cut.status_code in (415, 422)
    size = int.from_bytes(whole[:8], "little")
    header = json.loads(whole[8 : 8 + size])
    inner = json.loads(header["__metadata__"]["ergocast"])
    inner["version"] = 999
    header["__metadata__"]["ergocast"] = json.dumps(inner)
    text = json.dumps(header).encode()
    other = len(text).to_bytes(8, "little") + text + whole[8 + size :]
    answer = api.post("/v1/models?name=mine", content=other, headers=MODEL)
    assert answer.status_code == 422
    assert "version 999" in answer.json()["detail"]
    assert "mine" in answer.json()["detail"] and ".part" not in answer.json()["detail"]


def test_a_model_sent_as_something_else_is_refused(api: TestClient, scene: Scene) -> None:
    answer = api.post(
        "/v1/models", content=scene.file.read_bytes(), headers={"Content-Type": "text/plain"}
    )
    assert answer.status_code == 415


@pytest.mark.parametrize("path", ["/v1/models/mdl_00", "/v1/models/..%2f..%2fetc/urdf"])
def test_what_is_not_there_is_not_found(api: TestClient, path: str) -> None:
    assert api.get(path).status_code == 404
