"""The service as a whole: health, schema, page, problems."""

from pathlib import Path

import pytest
from fastapi import FastAPI
from starlette.testclient import TestClient

from app import dashboard
from app.main import create_app
from app.problems import ADVICE, Problem
from app.settings import Settings
from tests.app.conftest import BASE_URL

ROUTES = {
    "/v1/worksheets/{method}": {"post"},
    "/v1/models": {"get", "post"},
    "/v1/models/{model_id}": {"get"},
    "/v1/models/{model_id}/urdf": {"get"},
    "/v1/recordings": {"get", "post"},
    "/v1/recordings/{recording_id}": {"get"},
    "/v1/recordings/{recording_id}/files": {"post"},
    "/v1/estimates": {"get", "post"},
    "/v1/estimates/{estimate_id}": {"get"},
    "/v1/estimates/{estimate_id}/series": {"get"},
    "/v1/estimates/{estimate_id}/series.parquet": {"get"},
    "/v1/estimates/{estimate_id}/urdf": {"get"},
    "/v1/scores": {"post"},
    "/v1/scores/{score_id}": {"get"},
    "/v1/scores/{score_id}/urdf": {"get"},
    "/v1/assessments": {"get", "post"},
    "/v1/assessments/{assessment_id}": {"get"},
    "/v1/assessments/{assessment_id}/candidates/{candidate_id}/posture": {"get"},
    "/v1/operations": {"get"},
    "/v1/operations/{operation_id}": {"get"},
    "/v1/operations/{operation_id}/events": {"get"},
    "/v1/operations/{operation_id}/cancel": {"post"},
    "/health/live": {"get"},
    "/health/ready": {"get"},
}


def test_the_schema_names_every_route(api: TestClient) -> None:
    schema = api.get("/openapi.json").json()
    assert {path: set(verbs) for path, verbs in schema["paths"].items()} == ROUTES
    assert "Candidate" in str(schema["components"]["schemas"]["AssessmentRequest"])


def test_health(api: TestClient) -> None:
    assert api.get("/health/live").json()["status"] == "ok"
    ready = api.get("/health/ready")
    assert (ready.status_code, ready.json()["checks"]) == (200, {"data": True, "operations": True})


def test_a_service_that_cannot_write_is_not_ready(api: TestClient, settings: Settings) -> None:
    for path in sorted(settings.data.rglob("*"), reverse=True):
        path.unlink() if path.is_file() else path.rmdir()
    settings.data.rmdir()
    settings.data.write_text("a file stands where the folder was")
    answer = api.get("/health/ready")
    assert (answer.status_code, answer.json()["checks"]["data"]) == (503, False)


def test_the_page_is_served_where_it_was_built(tmp_path: Path) -> None:
    (tmp_path / "assets").mkdir()
    (tmp_path / "index.html").write_text("<title>built</title>")
    (tmp_path / "assets" / "a.js").write_text("1")
    app = FastAPI()
    dashboard.install(app, tmp_path)
    with TestClient(app) as client:
        assert "built" in client.get("/").text
        assert client.get("/assets/a.js").text == "1"
        assert client.get("/assets/../../secret").status_code == 404


def test_without_the_page_it_says_how_to_build_it(tmp_path: Path) -> None:
    app = FastAPI()
    dashboard.install(app, tmp_path / "none")
    with TestClient(app) as client:
        assert "dev.py run" in client.get("/").text


def test_every_problem_type_has_a_page(api: TestClient) -> None:
    kinds = [*Problem.__subclasses__(), Problem]
    assert {kind.slug for kind in kinds} == set(ADVICE)
    for kind in kinds:
        page = api.get(f"/problems/{kind.slug}")
        assert page.status_code == 200 and ADVICE[kind.slug] in page.text
    assert api.get("/problems/other").status_code == 404


def test_what_is_not_there_is_a_problem(api: TestClient) -> None:
    answer = api.get("/v1/nothing")
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["instance"] == "/v1/nothing"
    wrong = api.put("/v1/models")
    assert (wrong.status_code, wrong.headers["content-type"]) == (405, "application/problem+json")


def test_an_unforeseen_error_tells_nothing_of_what_was_sent(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    app = create_app(Settings(data=tmp_path))

    def crash() -> None:
        raise RuntimeError("posture 1.2345 of Jane")

    monkeypatch.setattr(app.state.service.models, "all", crash)
    with TestClient(app, base_url=BASE_URL, raise_server_exceptions=False) as client:
        answer = client.get("/v1/models")
    assert answer.status_code == 500
    assert answer.json()["type"] == "/problems/internal"
    assert "Jane" not in answer.text
    assert "Jane" not in "".join(record.getMessage() for record in caplog.records)


def test_with_keys_the_api_asks_for_one(tmp_path: Path) -> None:
    app = create_app(Settings(data=tmp_path, api_keys="one,two"))
    with TestClient(app, base_url="http://robot.example") as client:
        assert client.get("/v1/models").status_code == 401
        good = client.get("/v1/models", headers={"Authorization": "Bearer two"})
        assert good.status_code == 200
