"""Training over HTTP: the same model as by command, cancelled, taken up again, added to."""

import hashlib
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

import prediction.training.train
from app.main import create_app
from app.settings import Settings
from tests.app.conftest import BASE_URL, upload

PERSON = {"height_m": 1.72, "mass_kg": 68.0, "sex": "female"}
QUICK = {"method": "cov-ik"}


def ask(api: TestClient, body: dict[str, Any]) -> dict[str, Any]:
    """Asks for a training and returns the queued operation."""
    answer = api.post("/v1/models", json=body)
    assert answer.status_code == 202, answer.text
    assert answer.headers["location"] == f"/v1/operations/{answer.json()['id']}"
    return dict(answer.json())


def ended(api: TestClient, operation: dict[str, Any]) -> dict[str, Any]:
    """Waits until an operation has ended."""
    for _ in range(3000):
        now = api.get(f"/v1/operations/{operation['id']}").json()
        if now["state"] in ("succeeded", "failed", "cancelled"):
            return dict(now)
        time.sleep(0.02)
    raise AssertionError(f"the training never ended: {now}")


def test_a_cancelled_training_stops_and_leaves_nothing(
    api: TestClient, settings: Settings, reaches: tuple[Path, Path]
) -> None:
    operation = ask(api, {"recordings": [upload(api, reaches[0])], **PERSON, "method": "mi-nsgp"})
    for _ in range(3000):
        progress = api.get(f"/v1/operations/{operation['id']}").json()["progress"]
        if progress["log_likelihood"] is not None:
            break
        time.sleep(0.02)
    assert 0 < progress["done"] < progress["total"]
    assert api.post(f"/v1/operations/{operation['id']}/cancel").status_code == 200
    done = ended(api, operation)
    assert done["state"] == "cancelled" and done["result_url"] is None
    assert list((settings.data / "trainings").glob("*")) == []
    assert api.get("/v1/models").json() == {"items": []}


class Gate:
    """Counts fits; holds the one of the given number back until it is opened."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, stop_at: int) -> None:
        self.fits: list[str] = []
        self.reached, self.opened = threading.Event(), threading.Event()
        fit = prediction.training.train.fit_predictor

        def counted(name: str, *args: Any, **options: Any) -> Any:
            self.fits.append(name)
            if len(self.fits) == stop_at:
                self.reached.set()
                assert self.opened.wait(30.0)
            return fit(name, *args, **options)

        monkeypatch.setattr(prediction.training.train, "fit_predictor", counted)


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[Gate]:
    yield Gate(monkeypatch, stop_at=4)


def test_a_training_goes_on_after_a_stop_and_gives_the_model_of_the_command(
    settings: Settings, reaches: tuple[Path, Path], trained_file: Path, gate: Gate
) -> None:
    with TestClient(create_app(settings), base_url=BASE_URL) as api:
        body = {"recordings": [upload(api, reaches[0])], **PERSON, **QUICK, "name": "mine"}
        operation = ask(api, body)
        assert (operation["kind"], operation["state"]) == ("training", "queued")
        assert gate.reached.wait(60.0)
        # The service cancels its work first, then waits for it.
        threading.Timer(0.3, gate.opened.set).start()
    first = list(gate.fits)
    assert len(list((settings.data / "trainings").rglob("*.part"))) == 3
    with TestClient(create_app(settings), base_url=BASE_URL) as api:
        done = ended(api, operation)
        assert done["state"] == "succeeded", done
        record = api.get(done["result_url"]).json()
        events = api.get(f"/v1/operations/{operation['id']}/events").text
    # two for the comparison, and two for each of two tasks; the one under way is done again
    assert len(first) == 4 and len(gate.fits) - len(first) == 6 - 3
    assert record["id"] == f"mdl_{hashlib.sha256(trained_file.read_bytes()).hexdigest()}"
    assert (record["name"], record["hand"], record["method"]) == ("mine", "right", "cov-ik")
    assert {one["method"] for one in record["metrics"]["scores"]} == {"cov-ik", "minimum-norm"}
    assert [take["name"] for take in record["holds"]["takes"]] == ["one.bvh"]
    assert '"log_likelihood":' in events and "measuring its bands" in events
    assert list((settings.data / "trainings").iterdir()) == []


def test_recordings_are_added_to_a_model(
    api: TestClient, reaches: tuple[Path, Path], trained_file: Path
) -> None:
    headers = {"Content-Type": "application/vnd.ergocast.model"}
    old = api.post("/v1/models", content=trained_file.read_bytes(), headers=headers).json()
    body = {"recordings": [upload(api, reaches[1])], "add_to": old["id"]}
    done = ended(api, ask(api, body))
    assert done["state"] == "succeeded", done
    record = api.get(done["result_url"]).json()
    assert [take["name"] for take in record["holds"]["takes"]] == ["one.bvh", "two.bvh"]
    assert record["holds"]["options"] == old["holds"]["options"]
    assert record["holds"]["samples"] > old["holds"]["samples"]
    failed = ended(api, ask(api, {**body, "recordings": [upload(api, reaches[0])]}))
    assert failed["state"] == "failed"
    assert "one.bvh is the same recording as one.bvh" in failed["problem"]["detail"]
    answer = api.post("/v1/models", json={**body, "height_m": 1.8})
    assert answer.status_code == 422 and "The model is of height 1.72, got 1.8" in answer.text


def test_a_person_without_recordings_gets_a_generic_model(api: TestClient) -> None:
    done = ended(api, ask(api, PERSON))
    record = api.get(done["result_url"]).json()
    assert record["holds"]["takes"] == [] and record["holds"]["samples"] == 0
    assert record["subject"] == PERSON


@pytest.mark.parametrize(
    ("change", "status", "words"),
    [
        ({"height_m": None}, 422, "height"),
        ({"height_m": 0.2}, 422, "height in m"),
        ({"height_m": "1.7"}, 422, "/height_m"),
        ({"mass_kg": -1}, 422, "/mass_kg"),
        ({"hand": "third"}, 422, "/hand"),
        ({"method": "oracle"}, 422, "oracle"),
        ({"engine": "gpytorch", "criterion": "held-out"}, 422, "criterion of engine gpytorch"),
        ({"seed": -1}, 422, "/seed"),
        ({"seed": 1.5}, 422, "/seed"),
        ({"colour": "red"}, 422, "/colour"),
        ({"recordings": "rec_1"}, 422, "/recordings"),
        ({"recordings": ["rec_" + "0" * 64]}, 404, "recording"),
        ({"add_to": "mdl_" + "0" * 64}, 404, "model"),
        ({"name": "x" * 300}, 422, "/name"),
    ],
)
def test_what_cannot_be_trained_is_refused_at_once(
    api: TestClient, reaches: tuple[Path, Path], change: dict[str, Any], status: int, words: str
) -> None:
    body = {"recordings": [upload(api, reaches[0])], **PERSON, **change}
    answer = api.post("/v1/models", json=body)
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert words in answer.text
    assert api.get("/v1/operations").json() == {"items": []}


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"height_m": 1e999}', b"\xff", b"null"])
def test_what_is_no_request_is_refused(api: TestClient, content: bytes) -> None:
    answer = api.post("/v1/models", content=content, headers={"content-type": "application/json"})
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
