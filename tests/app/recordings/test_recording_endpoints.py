"""Recordings over HTTP: told by content, kept whole or not at all."""

from pathlib import Path

import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.settings import Settings
from tests.app.conftest import BASE_URL, upload

RAW = {"Content-Type": "application/octet-stream"}
BOMB = b"""<?xml version="1.0"?><!DOCTYPE mvnx [<!ENTITY a "aaaaaaaaaa">
<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]><mvnx version="4">&b;</mvnx>"""


def test_a_recording_is_kept_by_its_content(api: TestClient, bvh: Path) -> None:
    identifier = upload(api, bvh)
    again = api.post("/v1/recordings?name=../../other.txt", content=bvh.read_bytes()).json()
    assert again["id"] == identifier
    assert again["name"] == "other.txt"
    items = api.get("/v1/recordings").json()["items"]
    assert [item["id"] for item in items] == [identifier]
    record = api.get(f"/v1/recordings/{identifier}").json()
    assert record["format"] == "bvh"
    assert record["size_bytes"] == bvh.stat().st_size
    assert record["inspection"]["rate_hz"] == pytest.approx(20.0, rel=1e-3)


@pytest.mark.parametrize(
    ("content", "statuses"),
    [
        (b"", {415, 422}),
        (b"hello world\n" * 10, {415}),
        (bytes(range(256)) * 8, {415}),
        (b"HIERARCHY\nROOT Hips\n{", {422}),
        (BOMB, {415, 422}),
    ],
)
def test_what_cannot_be_read_is_refused_and_leaves_nothing(
    api: TestClient, settings: Settings, content: bytes, statuses: set[int]
) -> None:
    answer = api.post("/v1/recordings?name=mine.bvh", content=content)
    assert answer.status_code in statuses, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert ".part" not in answer.text
    assert api.get("/v1/recordings").json() == {"items": []}
    assert not [path for path in settings.data.rglob("*") if path.is_file() and "part" in path.name]


def test_a_truncated_recording_is_refused(api: TestClient, bvh: Path) -> None:
    whole = bvh.read_bytes()
    answer = api.post("/v1/recordings", content=whole[: len(whole) * 2 // 3])
    assert answer.status_code == 422
    assert "frame" in answer.json()["detail"].lower()


def test_an_upload_past_the_limit_is_refused(tmp_path: Path, bvh: Path) -> None:
    settings = Settings(data=tmp_path / "data", max_upload_bytes=1000, max_body_bytes=100)
    with TestClient(create_app(settings), base_url=BASE_URL) as api:
        answer = api.post("/v1/recordings", content=bvh.read_bytes(), headers=RAW)
        assert answer.status_code == 413
        assert not [p for p in (tmp_path / "data").rglob("*") if "part" in p.name]
    larger = Settings(data=tmp_path / "data", max_upload_bytes=1 << 30, max_body_bytes=100)
    with TestClient(create_app(larger), base_url=BASE_URL) as api:
        assert api.post("/v1/recordings", content=bvh.read_bytes(), headers=RAW).status_code == 201


def test_what_is_not_there_is_not_found(api: TestClient) -> None:
    assert api.get("/v1/recordings/rec_" + "0" * 64).status_code == 404
