"""The command line: results for people and machines, errors in words with an exit code."""

import io
import json
import socket
from pathlib import Path
from typing import Any

import pytest

from app.files import write_json
from prediction import load_model
from tests.app.cli.running import Capture, failed, run
from tests.app.conftest import Scene


def test_inspect_for_people_and_machines(bvh: Path, capsys: Capture) -> None:
    assert run("inspect", bvh) == 0
    assert "rate_hz" in capsys.readouterr().out
    assert run("inspect", bvh, "--json") == 0
    record = json.loads(capsys.readouterr().out)
    assert (record["format"], record["rate_hz"]) == ("bvh", pytest.approx(20.0, rel=1e-3))


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "no such file"), (b"", "expected"), (b"hello", "expected"), (b"HIERARCHY\n", "line")],
)
def test_inspect_says_what_is_wrong_with_a_file(
    tmp_path: Path, capsys: Capture, content: bytes | None, words: str
) -> None:
    file = tmp_path / "mine.bvh"
    if content is not None:
        file.write_bytes(content)
    said = failed(capsys, "inspect", file)
    assert said.startswith("Error: ") and words in said.lower() and "mine.bvh" in said
    problem = json.loads(failed(capsys, "inspect", file, "--json"))
    assert problem["status"] == 422


SHEET: dict[str, Any] = {
    "input": {
        "upper_arm": {"flexion_deg": 85},
        "lower_arm": {"flexion_deg": 50},
        "wrist": {"flexion_deg": 10, "twist": "mid"},
        "neck": {"flexion_deg": 0},
        "trunk": {"flexion_deg": 0},
        "legs": {"supported_balanced": True},
    }
}


def test_one_worksheet_or_a_list_of_them(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "sheets.json"
    write_json(file, [SHEET, {**SHEET, "id": "b"}])
    assert run("worksheet", "rula", file) == 0
    results = json.loads(capsys.readouterr().out)
    assert [one["final"] for one in results] == [3, 3]
    assert results[1]["id"] == "b"
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(json.dumps(SHEET).encode())))
    assert run("worksheet", "rula", "-") == 0
    assert json.loads(capsys.readouterr().out)["final"] == 3


def test_a_file_of_worked_cases_gives_those_of_the_method(tmp_path: Path, capsys: Capture) -> None:
    cases = [{"id": "a", "method": "rula", **SHEET}, {"id": "b", "method": "reba", "input": {}}]
    file = tmp_path / "cases.json"
    write_json(file, {"schema_version": 1, "cases": cases})
    assert run("worksheet", "rula", file) == 0
    assert [one["id"] for one in json.loads(capsys.readouterr().out)] == ["a"]


def test_a_bad_worksheet_is_named_by_its_place(tmp_path: Path, capsys: Capture) -> None:
    file = tmp_path / "sheets.json"
    write_json(file, [SHEET, {"input": {**SHEET["input"], "neck": {"flexion_deg": "x"}}}])
    assert "/1/input/neck/flexion_deg" in failed(capsys, "worksheet", "rula", file)
    file.write_text('[{"input": }]')
    assert "line 1, column 12" in failed(capsys, "worksheet", "rula", file)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"{\n", "line 2"),
        (b"[" * 100_000, "nested too deeply"),
        (b"[\n1,\xff]", "line 2"),
        (b"9" * 5000, "too many digits"),
    ],
)
def test_what_is_no_json_is_named_by_its_place(
    tmp_path: Path, scene: Scene, capsys: Capture, content: bytes, words: str
) -> None:
    file = tmp_path / "sent.json"
    file.write_bytes(content)
    assert words in failed(capsys, "worksheet", "rula", file)
    said = failed(capsys, "assess", "--model", scene.file, file)
    assert "sent.json" in said and words in said


@pytest.mark.parametrize("candidates", [None, 5, "abc", {"id": "a"}])
def test_candidates_that_are_no_list_are_refused(
    tmp_path: Path, scene: Scene, capsys: Capture, candidates: Any
) -> None:
    file = tmp_path / "request.json"
    file.write_text(json.dumps({**scene.request("x"), "candidates": candidates}))
    assert "/candidates" in failed(capsys, "assess", "--model", scene.file, file)
    only = tmp_path / "one.json"
    only.write_text("[]")
    said = failed(capsys, "assess", "--model", scene.file, "--context", file, only)
    assert "/candidates" in said


def test_a_name_with_brackets_is_shown_as_it_is(
    tmp_path: Path, scene: Scene, capsys: Capture
) -> None:
    good = {**scene.candidates()[0], "id": "[/red]"}
    bad = {**scene.candidates()[1], "id": "[/bold]", "frame_id": "moon"}
    file = tmp_path / "request.json"
    write_json(file, scene.request("x", candidates=[good, bad]))
    assert run("assess", "--model", scene.file, file) == 0
    shown = capsys.readouterr().out
    assert "[/red]" in shown and "[/bold] not assessed" in shown


@pytest.mark.parametrize(
    ("options", "place"),
    [
        (("--height", 17), "/height_m"),
        (("--mass", "nan"), "/mass_kg"),
        (("--load", -1), "_load_kg"),
    ],
)
def test_score_refuses_what_no_person_is(
    bvh: Path, capsys: Capture, options: tuple[object, ...], place: str
) -> None:
    assert place in failed(capsys, "score", bvh, *options)


def test_serve_says_in_a_line_what_keeps_it_from_starting(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "a-file"
    file.write_text("no folder")
    assert "--data" in failed(capsys, "serve", "--port", 0, "--data", file / "below")
    monkeypatch.setenv("ERGOCAST_WORKERS", "many")
    assert "ERGOCAST_WORKERS=many" in failed(capsys, "serve", "--port", 0)


def test_assess_ranks_candidates_in_one_file_or_many(
    tmp_path: Path, scene: Scene, capsys: Capture
) -> None:
    request = scene.request("left out")
    candidates = request.pop("candidates")
    write_json(tmp_path / "context.json", request)
    for one in candidates:
        write_json(tmp_path / f"{one['id']}.json", one)
    write_json(tmp_path / "all.json", {**request, "candidates": candidates})
    whole = ["assess", "--model", scene.file, tmp_path / "all.json", "--json"]
    assert run(*whole) == 0
    first = json.loads(capsys.readouterr().out)
    assert sorted(one["rank"] for one in first["candidates"]) == [1, 2, 3]
    files = [tmp_path / f"{one['id']}.json" for one in candidates]
    out = tmp_path / "answer.json"
    context = ["--context", tmp_path / "context.json"]
    assert run("assess", "--model", scene.file, *context, *files, "--json", "--out", out) == 0
    second = json.loads(capsys.readouterr().out)
    assert first == second == json.loads(out.read_text())
    assert run("assess", "--model", scene.file, tmp_path / "all.json") == 0
    table = capsys.readouterr().out
    assert "rank" in table and "Assumed, not measured" in table


def test_assess_says_what_is_missing(tmp_path: Path, scene: Scene, capsys: Capture) -> None:
    write_json(tmp_path / "one.json", scene.candidates()[0])
    said = failed(capsys, "assess", "--model", scene.file, tmp_path / "one.json")
    assert "--context" in said
    write_json(tmp_path / "bad.json", {**scene.request("x"), "payload_kg": -1})
    assert "/payload_kg" in failed(capsys, "assess", "--model", scene.file, tmp_path / "bad.json")
    not_model = failed(capsys, "assess", "--model", tmp_path / "one.json", tmp_path / "bad.json")
    assert "not an operator model" in not_model


def test_score_a_recording(tmp_path: Path, bvh: Path, capsys: Capture) -> None:
    person = ["--height", 1.72, "--mass", 68, "--sex", "female"]
    assert run("score", bvh, *person, "--json", "--out", tmp_path / "out") == 0
    result = json.loads(capsys.readouterr().out)
    assert result["summary"]["rula"]["max"] >= 3
    written = json.loads((tmp_path / "out" / "box.bvh.score.json").read_text())
    assert written["rula"] == result["rula"]
    assert run("score", f"motion:{bvh}", *person) == 0
    assert "worst moments" in capsys.readouterr().out
    said = failed(capsys, "score", bvh, "--height", 0.4, "--mass", 68)
    assert "height" in said and "0.4" in said


def test_train_writes_a_model_that_assesses(
    tmp_path: Path, bvh: Path, scene: Scene, capsys: Capture
) -> None:
    out = tmp_path / "mine.safetensors"
    person = ["--height", 1.72, "--mass", 68, "--sex", "female"]
    paper = ["--criterion", "marginal", "--weights", "diagonal", "--kernel", "paper"]
    assert run("train", bvh, *person, "--out", out, "--method", "cov-ik", *paper, "--json") == 0
    options = load_model(out).training["options"]
    assert [options[name[2:]] for name in paper[::2]] == paper[1::2]
    told = json.loads(capsys.readouterr().out)
    assert told["method"] == "cov-ik"
    scores = {one["method"]: one for one in told["metrics"]["scores"]}
    assert set(scores) == {"cov-ik", "minimum-norm"}
    for one in scores.values():
        assert one["rmse_rad_s"] > 0 and 0 < one["coverage90_one_step"] <= 1
    write_json(tmp_path / "request.json", scene.request("x"))
    assert run("assess", "--model", out, tmp_path / "request.json", "--json") == 0
    assert json.loads(capsys.readouterr().out)["methods"] == ["cov-ik", "minimum-norm"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--height", 0.2, "--mass", 70], "height"),
        (["--height", 1.7, "--mass", 900], "mass"),
    ],
)
def test_train_refuses_an_impossible_person_and_leaves_nothing(
    tmp_path: Path, bvh: Path, capsys: Capture, options: list[object], words: str
) -> None:
    out = tmp_path / "mine.safetensors"
    assert words in failed(capsys, "train", bvh, *options, "--out", out)
    assert list(tmp_path.iterdir()) == []


def test_train_refuses_other_roles_and_folders(tmp_path: Path, bvh: Path, capsys: Capture) -> None:
    person = ["--height", 1.72, "--mass", 68]
    said = failed(capsys, "train", bvh, f"grf:{bvh}", *person, "--out", tmp_path / "m")
    assert "motion alone" in said
    assert "Expected a motion" in failed(
        capsys, "train", f"static:{bvh}", *person, "--out", tmp_path / "m"
    )
    said = failed(capsys, "train", bvh, *person, "--out", tmp_path / "no" / "m")
    assert "does not exist" in said


def test_serve_refuses_an_open_address_and_a_taken_port(
    tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ERGOCAST_API_KEYS", raising=False)
    said = failed(capsys, "serve", "--host", "0.0.0.0", "--data", tmp_path)
    assert "ERGOCAST_API_KEYS" in said
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        said = failed(capsys, "serve", "--port", port, "--data", tmp_path)
    assert f"Port {port}" in said and "taken" in said


def test_help_and_version(capsys: Capture) -> None:
    assert run("--help") == 0
    said = capsys.readouterr().out
    for command in (
        "inspect",
        "estimate",
        "train",
        "assess",
        "score",
        "worksheet",
        "demo",
        "serve",
    ):
        assert command in said
    assert run("--version") == 0
    assert capsys.readouterr().out.startswith("ergocast ")
