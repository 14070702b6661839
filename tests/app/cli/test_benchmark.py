"""``ergocast benchmark prediction``: a folder in, a paired table out."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from app.cli.root import cli
from app.method_comparison import METHODS, recordings_in
from app.problems import InvalidRequest
from human import Subject, generate_model
from human.readers import write_bvh
from human.simulate import operator, simulate_reaching
from prediction import MethodScore, SplitScores

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


@pytest.fixture(scope="module")
def sorted_folder(tmp_path_factory):
    """Two primitives of one person, and beside them what no one can use."""
    out = tmp_path_factory.mktemp("sorted")
    model = generate_model(Subject(1.75, 72.0, "male"))
    rng = np.random.default_rng(6)
    who = operator("average", rng, model)
    for primitive in ("far", "near"):
        (out / primitive).mkdir()
        motion = simulate_reaching(model, who, rng, movements=1, rate_hz=10.0).motion
        write_bvh(out / primitive / "take1.bvh", model, motion)
    (out / "far" / "take2.bvh").write_text("HIERARCHY\nROOT nobody")
    (out / "videos").mkdir()
    return out


@pytest.fixture
def untrained(monkeypatch):
    """Scores splits by their sizes: what is asked here is which splits there are."""

    def compared(chain, splits, methods, *, also, **_):
        def score(split, name):
            ratio = len(split.train) / len(split.test) * (1.0 if name == "cov-ik" else 2.0)
            at = {"0.25": ratio, "0.5": 2.0 * ratio}
            return MethodScore(name, 1.0, 1.0, ratio, 0.0, 0.9, ratio, at, 1e-5, 1e-4, 0.9, 10.0)

        names = ("cov-ik", *methods, *(also or {}))
        return [SplitScores((s.design, s.name), {n: score(s, n) for n in names}) for s in splits]

    monkeypatch.setattr("app.method_comparison.compare_on_splits", compared)


def test_every_split_is_scored_and_written(folder, tmp_path):
    out = tmp_path / "out"
    asked = ["benchmark", "prediction", str(folder), *PERSON, "--method", "cov-ik", "--json"]
    result = RUNNER.invoke(cli, [*asked, "--out", str(out)])
    assert result.exit_code == 0, result.output
    found = json.loads(result.output)
    assert found["files"] == ["one.bvh"]
    assert [s["held_out"] for s in found["splits"]] == [f"part {k} of 4" for k in (1, 2, 3, 4)]
    for rows in found["tables"].values():
        by_name = {row["method"]: row for row in rows}
        assert set(by_name) == {"cov-ik", "minimum-norm"}
        assert by_name["cov-ik"]["rollout_ratio"]["0.5"] == 1.0
        assert by_name["minimum-norm"]["rollout_ratio"]["0.5"] > 1.0
    assert json.loads((out / "scores.json").read_text())["tables"] == found["tables"]
    assert (out / "errors.png").read_bytes().startswith(b"\x89PNG")


def test_a_folder_without_recordings_is_refused_by_name(tmp_path):
    result = RUNNER.invoke(cli, ["benchmark", "prediction", str(tmp_path), *PERSON])
    assert result.exit_code != 0
    assert "expected recordings of motion" in str(result.exception)


def test_a_file_where_the_results_go_is_refused_before_the_work(folder):
    taken = folder / "notes.txt"
    result = RUNNER.invoke(cli, ["benchmark", "prediction", str(folder), *PERSON, "--out", taken])
    assert result.exit_code != 0
    assert "expected a folder, this is a file" in str(result.exception)
    assert taken.read_text() == "not a recording"


def test_sub_folders_are_primitives_and_what_cannot_be_read_is_left_out_by_name(
    sorted_folder, tmp_path, untrained
):
    out = tmp_path / "out"
    asked = ["benchmark", "prediction", str(sorted_folder), *PERSON, "--out", str(out)]
    result = RUNNER.invoke(cli, [*asked, "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.output)
    assert found["primitives"] == {"far": ["far/take1.bvh"], "near": ["near/take1.bvh"]}
    assert [one["name"] for one in found["left_out"]] == ["far/take2.bvh"]
    assert found["left_out"][0]["reason"]
    names = [(s["design"], s["held_out"]) for s in found["splits"]]
    parts = [("same", f"{p}, part {k} of 4") for p in ("far", "near") for k in (1, 2, 3, 4)]
    assert names == [*parts, ("other", "far"), ("other", "near")]
    same, other = found["tables"]["same"], found["tables"]["other"]
    assert {row["splits"] for row in same} == {8} and {row["splits"] for row in other} == {2}
    # Three quarters of a primitive are trained on; of the other motion, all.
    cov = next(row for row in same if row["method"] == "cov-ik")
    assert cov["rollout_rmse_deg"]["0.25"] == pytest.approx(3.0, rel=0.15)
    assert {row["method"] for row in same} == {*METHODS, "cov-ik", "paper"}
    lines = (out / "splits.csv").read_text().splitlines()
    assert len(lines) == 1 + 10 * len(same) and lines[0].startswith("design,held_out,method,")
    assert lines[-1].startswith("other,near,paper,")
    shown = RUNNER.invoke(cli, asked).output
    assert "far/take2.bvh was left out:" in shown and "(EXP2)" in shown and "x2.00" in shown


def test_a_static_trial_scales_its_own_folder_else_the_one_above_does(tmp_path):
    for name in ("static.trc", "a/one.trc", "b/static_b.trc", "b/two.trc", ".hidden/three.trc"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("PathFileType\t4\t(X/Y/Z)\tone.trc\n")
    found = recordings_in(tmp_path)
    assert {name: [t.motion.name for t in takes] for name, takes in found.items()} == {
        "a": ["a/one.trc"],
        "b": ["b/two.trc"],
    }
    assert found["a"][0].static.path == tmp_path / "static.trc"
    assert found["b"][0].static.path == tmp_path / "b" / "static_b.trc"


def test_recordings_of_different_people_are_refused(folder, tmp_path):
    model = generate_model(Subject(1.95, 95.0, "male"))
    rng = np.random.default_rng(5)
    motion = simulate_reaching(
        model, operator("average", rng, model), rng, movements=1, rate_hz=10.0
    ).motion
    write_bvh(tmp_path / "two.bvh", model, motion)
    (tmp_path / "one.bvh").write_bytes((folder / "one.bvh").read_bytes())
    result = RUNNER.invoke(cli, ["benchmark", "prediction", str(tmp_path), *PERSON])
    assert isinstance(result.exception, InvalidRequest)
    assert "different bodies" in str(result.exception)
