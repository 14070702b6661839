"""``ergocast benchmark prediction``: a folder in, a paired table out."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from app.cli.root import cli
from human import Subject, generate_model
from human.readers import write_bvh
from human.simulate import operator, simulate_reaching

RUNNER = CliRunner()
PERSON = ["--height", "1.75", "--mass", "72"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("recordings")
    model = generate_model(Subject(1.75, 72.0, "male"))
    rng = np.random.default_rng(5)
    who = operator("average", rng, model)
    motion = simulate_reaching(model, who, rng, movements=3, rate_hz=15.0).motion
    write_bvh(out / "one.bvh", model, motion)
    (out / "notes.txt").write_text("not a recording")
    return out


def test_every_split_is_scored_and_written(folder, tmp_path):
    out = tmp_path / "out"
    asked = ["benchmark", "prediction", str(folder), *PERSON, "--method", "sb-m", "--json"]
    result = RUNNER.invoke(cli, [*asked, "--out", str(out)])
    assert result.exit_code == 0, result.output
    found = json.loads(result.output)
    assert found["files"] == ["one.bvh"]
    assert [s["held_out"] for s in found["splits"]] == [f"part {k} of 4" for k in (1, 2, 3, 4)]
    for rows in found["tables"].values():
        by_name = {row["method"]: row for row in rows}
        assert set(by_name) == {"sb-m", "cov-ik", "minimum-norm"}
        assert by_name["cov-ik"]["rollout_ratio"]["0.5"] == 1.0
        assert by_name["minimum-norm"]["rollout_ratio"]["0.5"] > 1.0
    assert json.loads((out / "scores.json").read_text())["tables"] == found["tables"]
    assert (out / "errors.png").read_bytes().startswith(b"\x89PNG")


def test_a_folder_without_recordings_is_refused_by_name(tmp_path):
    result = RUNNER.invoke(cli, ["benchmark", "prediction", str(tmp_path), *PERSON])
    assert result.exit_code != 0
    assert "expected recordings of motion" in str(result.exception)
