"""Real recordings through the service: uploaded, scored, and twins that agree."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

from app.main import create_app
from app.scores.schemas import ScoreResult
from app.settings import Settings


@pytest.fixture
def api(tmp_path: Path) -> Iterator[TestClient]:
    app = create_app(Settings(data=tmp_path, api_keys=""))
    with TestClient(app, base_url="http://127.0.0.1") as client:
        yield client


def scored(api: TestClient, file: Path) -> dict[str, Any]:
    recording = api.post(f"/v1/recordings?name={file.name}", content=file.read_bytes())
    assert recording.status_code == 201, recording.text
    asked = {"recording_id": recording.json()["id"], "height_m": 1.75, "mass_kg": 70.0}
    answer = api.post("/v1/scores", json=asked)
    assert answer.status_code == 200, answer.text
    body: dict[str, Any] = answer.json()
    ScoreResult.model_validate(body)
    return body


def test_a_file_and_its_twin_of_another_format_get_the_same_scores(
    api: TestClient, recordings_dir: Path
) -> None:
    folder = recordings_dir / "xsens_mvnx"
    mvnx, bvh = (scored(api, folder / f"test_mocap.{kind}") for kind in ("mvnx", "bvh"))
    for side in ("left", "right"):
        series = {}
        for name, body in (("mvnx", mvnx), ("bvh", bvh)):
            series[name] = np.interp(
                np.linspace(0.2, 1.0, 50), body["time_s"], body["sides"][side]["rula"]
            ).round()
        assert np.mean(series["mvnx"] == series["bvh"]) > 0.9
    assert mvnx["summary"]["rula"]["median"] == bvh["summary"]["rula"]["median"]


def test_moving_a_box_scores_worse_than_standing(api: TestClient, recordings_dir: Path) -> None:
    box = scored(api, recordings_dir / "xsens_bvh_box" / "MotionBox_XSens.bvh")
    still = scored(api, recordings_dir / "xsens_mvnx" / "Meri-020.mvnx")
    assert box["summary"]["rula"]["max"] == 7
    assert box["summary"]["rula"]["time_at_or_above"]["5"] > 2.0
    assert box["summary"]["rula"]["median"] > still["summary"]["rula"]["median"]
    assert max(box["back_angle_deg"]) > 40.0
    assert len(box["worst"]) == 5
