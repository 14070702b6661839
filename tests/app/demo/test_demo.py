"""The demonstration: made once, whole or not at all, and ready to be looked at."""

import json
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from app.cli import main
from app.demo import load_demo, write_demo
from app.demo.laboratory import BOX_KG
from app.main import create_app
from app.service import ErgocastService
from app.settings import Settings
from app.training import Trained
from prediction import load_model
from tests.app.conftest import BASE_URL, Scene


@pytest.fixture
def quick(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Puts the session's small model of the same person in the place of a long training."""
    made = Trained(load_model(scene.file), (), "", ())
    monkeypatch.setattr("app.demo.files.trained", lambda who, progress: made)


@pytest.mark.usefixtures("quick")
def test_the_demo_is_loaded_once_and_shown(
    settings: Settings, capsys: pytest.CaptureFixture[str]
) -> None:
    service = ErgocastService(settings)
    service.prepare()
    told: list[float] = []
    made = load_demo(service, lambda what, done: told.append(done))
    assert made["made"] and told == sorted(told) and told[-1] == 1.0
    with pytest.raises(SystemExit) as ended:
        main(["demo", "--data", str(settings.data), "--json"])
    again = json.loads(capsys.readouterr().out)
    assert ended.value.code in (0, None)
    assert again == {**made, "made": False}
    with TestClient(create_app(settings), base_url=BASE_URL) as api:
        listed = api.get("/v1/assessments").json()["items"]
        assert [one["id"] for one in listed] == [made["assessment_id"]]
        answer = api.get(f"/v1/assessments/{made['assessment_id']}").json()
        assert [one["problem"] for one in answer["candidates"]] == [None] * 6
        best = next(one for one in answer["candidates"] if one["rank"] == 1)
        worst = max(answer["candidates"], key=lambda one: one["rank"])
        assert best["id"] in ("direct", "close")
        assert worst["cost"]["total"] > 1.3 * best["cost"]["total"]
        assert api.get("/v1/recordings").json()["items"][0]["id"] == made["recording_id"]
        assert api.get(f"/v1/scores/{made['score_id']}").status_code == 200
        # The request lies beside it, ready to be sent again.
        request = json.loads(Path(made["folder"], "request.json").read_text("utf-8"))
        sent = api.post("/v1/assessments", json=request)
        assert sent.json()["id"] == made["assessment_id"]


@pytest.mark.usefixtures("quick")
def test_the_files_are_those_of_a_user(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = write_demo(tmp_path / "demo")
    names = sorted(path.name for path in files.folder.iterdir())
    assert names == [
        "README.txt", "box_handling.bvh", "candidates", "context.json", "lift.trc",
        "lift_grf.mot", "operator.safetensors", "request.json", "static.trc",
    ]  # fmt: skip
    assert [path.name for path in tmp_path.iterdir()] == ["demo"]
    candidates = sorted(str(path) for path in (files.folder / "candidates").iterdir())
    assert len(candidates) == 6
    context = str(files.folder / "context.json")
    options = ["--samples", "4", "--json"]
    with pytest.raises(SystemExit) as ended:
        main(["assess", "--model", str(files.model), "--context", context, *candidates, *options])
    assert ended.value.code in (0, None)
    answer = json.loads(capsys.readouterr().out)
    assert sorted(one["rank"] for one in answer["candidates"]) == [1, 2, 3, 4, 5, 6]


@pytest.mark.usefixtures("quick")
def test_the_lift_can_be_estimated_as_its_readme_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = write_demo(tmp_path / "demo").folder
    text = (folder / "README.txt").read_text("utf-8")
    line = next(line for line in text.splitlines() if line.startswith("ergocast estimate"))
    monkeypatch.chdir(folder)
    with pytest.raises(SystemExit) as ended:
        main([*line.split()[1:], "--json"])
    assert ended.value.code in (0, None)
    holds = json.loads(capsys.readouterr().out)["holds"]
    loaded = [hold for hold in holds if hold["state"] == "loaded"]
    assert len(loaded) == 1
    band = loaded[0]["mass_kg"]
    assert band["p05"] < BOX_KG < band["p95"] and abs(band["p50"] - BOX_KG) < 0.5


def test_a_demo_that_fails_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("app.demo.files.trained", fail)
    monkeypatch.setattr("app.demo.files.simulate_box_handling", fail)
    with pytest.raises(KeyboardInterrupt):
        write_demo(tmp_path / "demo")
    assert list(tmp_path.iterdir()) == []
