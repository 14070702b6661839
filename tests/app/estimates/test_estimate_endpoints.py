"""Estimates over HTTP: several files form one recording, work goes on in the background."""

import io
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from starlette.testclient import TestClient

from app.estimates import service as estimates_service
from app.estimates.schemas import Estimate
from app.main import create_app
from app.problems import Cancelled
from app.settings import Settings
from tests.app.conftest import BASE_URL, upload
from tests.app.estimates.lifting import BOX_KG, Lifting

PERSON: dict[str, Any] = {"height_m": 1.75, "mass_kg": 72.0, "sex": "male", "bands": "noise"}


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """One service for the tests that only read what it has made."""
    settings = Settings(data=tmp_path_factory.mktemp("service"), api_keys="")
    with TestClient(create_app(settings), base_url=BASE_URL) as api:
        yield api


def add(api: TestClient, recording: str, role: str, file: Path) -> dict[str, Any]:
    answer = api.post(
        f"/v1/recordings/{recording}/files?role={role}&name={file.name}",
        content=file.read_bytes(),
        headers={"Content-Type": "application/octet-stream"},
    )
    assert answer.status_code == 201, answer.text
    body: dict[str, Any] = answer.json()
    return body


def ended(api: TestClient, operation: str) -> dict[str, Any]:
    for _ in range(6000):
        found: dict[str, Any] = api.get(f"/v1/operations/{operation}").json()
        if found["state"] in ("succeeded", "failed", "cancelled"):
            return found
        time.sleep(0.01)
    raise AssertionError(f"the work never ended: {found}")


def ask(api: TestClient, recording: str, **options: Any) -> dict[str, Any]:
    answer = api.post("/v1/estimates", json={"recording_id": recording, **PERSON, **options})
    assert answer.status_code == 202, answer.text
    assert answer.headers["location"] == f"/v1/operations/{answer.json()['id']}"
    return ended(api, answer.json()["id"])


@pytest.fixture(scope="module")
def recording(served: TestClient, lifting: Lifting) -> str:
    identifier = upload(served, lifting.motion)
    add(served, identifier, "grf", lifting.grf)
    record = add(served, identifier, "static", lifting.static)
    assert [(one["role"], one["name"]) for one in record["files"]] == [
        ("grf", "lift_grf.mot"),
        ("static", "static.trc"),
    ]
    return identifier


@pytest.fixture(scope="module")
def estimate(served: TestClient, recording: str) -> dict[str, Any]:
    operation = ask(served, recording)
    assert operation["state"] == "succeeded", operation
    body: dict[str, Any] = served.get(operation["result_url"]).json()
    return body


def test_the_box_is_weighed_over_http(served: TestClient, estimate: dict[str, Any]) -> None:
    Estimate.model_validate(estimate)
    (held,) = [hold for hold in estimate["holds"] if hold["state"] == "loaded"]
    assert held["mass_kg"]["p50"] == pytest.approx(BOX_KG, abs=0.3)
    assert {one["role"] for one in estimate["files"]} == {"motion", "static", "grf"}
    (item,) = served.get("/v1/estimates").json()["items"]
    assert item["id"] == estimate["id"] and item["source"] == "lift.trc"
    assert "<robot" in served.get(estimate["model_urdf_url"]).text


def test_the_same_asked_again_is_the_one_that_is_there(
    served: TestClient, recording: str, estimate: dict[str, Any]
) -> None:
    again = ask(served, recording)
    assert again["result_url"] == f"/v1/estimates/{estimate['id']}"
    assert len(served.get("/v1/estimates").json()["items"]) == 1


def test_series_come_in_parts_and_whole(served: TestClient, estimate: dict[str, Any]) -> None:
    url = estimate["series_url"]
    query = {"columns": "payload_p50_kg,jRightBallFoot_roty_torque_nm", "start": 1.0, "end": 2.0}
    part = served.get(url, params=query).json()
    assert list(part["columns"]) == ["time_s", *query["columns"].split(",")]
    assert part["units"]["payload_p50_kg"] == "kg"
    time_s = part["columns"]["time_s"]
    assert 1.0 <= min(time_s) and max(time_s) < 2.0 and len(time_s) == 50
    # The toes have no markers: nothing rather than a number.
    assert set(part["columns"]["jRightBallFoot_roty_torque_nm"]) == {None}
    whole = pq.read_table(io.BytesIO(served.get(f"{url}.parquet").content))
    assert whole.column_names == estimate["columns"]
    assert whole.num_rows == estimate["frames"]


def test_scores_take_markers(served: TestClient, recording: str) -> None:
    body = {"recording_id": recording, "height_m": 1.75}
    answer = served.post("/v1/scores", json=body)
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert "RightToe" in found["unmeasured"] and max(found["rula"]) >= 2
    nobody = served.post("/v1/scores", json={"recording_id": recording})
    assert nobody.status_code == 422 and "/height_m" in nobody.text


def test_scores_of_an_estimate_take_its_payload_and_hold_the_articular_stress(
    served: TestClient, recording: str, estimate: dict[str, Any]
) -> None:
    answer = served.post("/v1/scores", json={"estimate_id": estimate["id"]})
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert (found["recording_id"], found["estimate_id"]) == (recording, estimate["id"])
    assert found["articular_stress"] == estimate["efforts"]
    person = {"height_m": 1.75, "mass_kg": 72.0, "sex": "male"}
    held = next(hold for hold in estimate["holds"] if hold["state"] == "loaded")
    body = {"recording_id": recording, **person, "hand_load_kg": held["mass_kg"]["p50"]}
    assert found["rula"] == served.post("/v1/scores", json=body).json()["rula"]
    assert found["assumed"][0]["what"] == "load in the hands"
    neither = served.post("/v1/scores", json={})
    assert neither.status_code == 422 and "estimate_id" in neither.text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"height_m": None}, "/height_m"),
        ({"height_m": "1.75"}, "/height_m"),
        ({"mass_kg": -1.0}, "/mass_kg"),
        ({"tare_s": [2.0, 1.0]}, "/tare_s"),
        ({"assign": {"1": "middle"}}, "/assign/1"),
        ({"hands": "three"}, "/hands"),
        ({"clock_offset_s": 1e9}, "/clock_offset_s"),
        ({"colour": "red"}, "/colour"),
    ],
)
def test_a_malformed_request_is_refused_at_once(
    served: TestClient, recording: str, change: dict[str, Any], words: str
) -> None:
    body = {"recording_id": recording, **PERSON, **change}
    answer = served.post("/v1/estimates", json=body)
    assert answer.status_code == 422 and words in answer.text


def test_what_is_not_there_is_not_found(served: TestClient, estimate: dict[str, Any]) -> None:
    unknown = {"recording_id": "rec_" + "0" * 64, **PERSON}
    assert served.post("/v1/estimates", json=unknown).status_code == 404
    for path in ("", "/series?columns=time_s", "/series.parquet", "/urdf"):
        assert served.get(f"/v1/estimates/est_{'0' * 64}{path}").status_code == 404
    strange = served.get(estimate["series_url"], params={"columns": "time_s,../../etc"})
    assert strange.status_code == 422 and "../../etc" in strange.text
    for when in ({"start": "nan"}, {"end": "inf"}):
        asked = {"columns": "time_s", **when}
        assert served.get(estimate["series_url"], params=asked).status_code == 422


def test_numbers_that_json_cannot_hold_are_refused(served: TestClient, recording: str) -> None:
    body = f'{{"recording_id": "{recording}", "height_m": 1.75, "tare_s": [0.0, 1e999]}}'
    answer = served.post(
        "/v1/estimates", content=body, headers={"content-type": "application/json"}
    )
    assert answer.status_code == 422 and "/tare_s/1" in answer.text


def test_every_option_is_described_where_clients_look(served: TestClient) -> None:
    schema = served.get("/openapi.json").json()["components"]["schemas"]["EstimateRequest"]
    undescribed = [name for name, one in schema["properties"].items() if "description" not in one]
    assert undescribed == ["recording_id"]


@pytest.mark.parametrize(
    ("role", "content", "status"),
    [
        ("grf", b"hello world\n", {415}),
        ("grf", b"x\nendheader\ntime a\n0 1\n", {422}),
        ("static", b"HIERARCHY\nROOT Hips\n{", {415}),
        ("static", b"PathFileType\t4\n", {422}),
        ("marker_set", b"[]", {422}),
        ("columns", b"{", {422}),
        ("colour", b"{}", {422}),
    ],
)
def test_a_part_that_is_no_such_thing_is_refused_and_not_kept(
    served: TestClient, recording: str, role: str, content: bytes, status: set[int]
) -> None:
    before = served.get(f"/v1/recordings/{recording}").json()
    answer = served.post(
        f"/v1/recordings/{recording}/files?role={role}&name=mine.txt", content=content
    )
    assert answer.status_code in status, answer.text
    assert ".part" not in answer.text
    assert served.get(f"/v1/recordings/{recording}").json() == before


def test_a_table_of_forces_is_no_motion(served: TestClient, lifting: Lifting) -> None:
    answer = served.post("/v1/recordings?name=a.mot", content=lifting.grf.read_bytes())
    assert answer.status_code == 415 and "role=grf" in answer.json()["detail"]


def test_a_recording_that_cannot_be_fitted_fails_with_the_reason(
    served: TestClient, tmp_path: Path
) -> None:
    names = "\t\t\t".join(["a", "b", "c", "d"])
    cells = "0.1\t0\t0.1\t0.1\t0\t-0.1\t0\t1\t0.1\t0\t1.7\t0"
    rows = "".join(f"{k + 1}\t{k / 100}\t{cells}\n" for k in range(9))
    file = tmp_path / "who.trc"
    file.write_text(
        f"PathFileType\t4\nDataRate\tUnits\n100\tm\nFrame#\tTime\t{names}\n\t\tX1\n{rows}"
    )
    operation = ask(served, upload(served, file))
    assert operation["state"] == "failed"
    assert operation["problem"]["type"] == "/problems/unreadable-file"
    assert "who.trc" in operation["problem"]["detail"]


@pytest.mark.parametrize(
    ("option", "pointer"),
    [({"tare_s": [500.0, 502.0]}, "/tare_s"), ({"assign": {"9": "left"}}, "/assign/9")],
)
def test_an_option_that_does_not_fit_the_recording_is_named(
    served: TestClient, recording: str, option: dict[str, Any], pointer: str
) -> None:
    operation = ask(served, recording, **option)
    assert operation["problem"]["type"] == "/problems/invalid-request"
    assert [fault["pointer"] for fault in operation["problem"]["errors"]] == [pointer]


def test_cancelled_work_leaves_nothing(
    api: TestClient, settings: Settings, lifting: Lifting, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(take: Any, options: Any, folder: Path, progress: Any) -> Any:
        (folder / "half").write_text("x")
        while True:
            progress("estimating", 1, 2)
            time.sleep(0.001)

    monkeypatch.setattr(estimates_service, "estimate_take", stopped)
    body = {"recording_id": upload(api, lifting.motion), **PERSON}
    operation = api.post("/v1/estimates", json=body).json()["id"]
    while api.get(f"/v1/operations/{operation}").json()["state"] == "queued":
        time.sleep(0.001)
    api.post(f"/v1/operations/{operation}/cancel")
    assert ended(api, operation)["state"] == "cancelled"
    assert api.get("/v1/estimates").json() == {"items": []}
    assert not list((settings.data / "estimates").rglob("half"))


def test_work_under_way_is_taken_up_after_a_restart(
    settings: Settings, lifting: Lifting, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[Path] = []

    def endless(take: Any, options: Any, folder: Path, progress: Any) -> Any:
        begun.append(folder)
        while True:
            progress("estimating", 1, 2)
            time.sleep(0.001)

    with monkeypatch.context() as patched:
        patched.setattr(estimates_service, "estimate_take", endless)
        with TestClient(create_app(settings), base_url=BASE_URL) as before:
            body = {"recording_id": upload(before, lifting.motion), **PERSON}
            operation = before.post("/v1/estimates", json=body).json()["id"]
            while not begun:
                time.sleep(0.001)
    # What a service leaves that is killed.
    begun[0].mkdir()
    (begun[0] / ".part-1.parquet").write_text("half")

    def short(take: Any, options: Any, folder: Path, progress: Any) -> Any:
        assert not any(folder.iterdir())
        raise Cancelled("taken up, with " + take.motion.name)

    monkeypatch.setattr(estimates_service, "estimate_take", short)
    with TestClient(create_app(settings), base_url=BASE_URL) as after:
        assert ended(after, operation)["problem"]["detail"] == "taken up, with lift.trc"
