"""An operator without recordings, from the command line to an assessment that says so."""

import json
from pathlib import Path

import numpy as np

from app.models.operator import open_operator
from human import Subject, generate_model, motion_from_configurations
from human.readers import write_bvh
from human.simulate import operator, simulate_reaching
from tests.app.cli.running import Capture, failed, run
from tests.app.conftest import Scene

BODY = ("--height", 1.72, "--mass", 68, "--sex", "female")


def test_no_recordings_make_a_model_that_says_so(
    scene: Scene, tmp_path: Path, capsys: Capture
) -> None:
    out = tmp_path / "generic.safetensors"
    assert run("train", *BODY, "--out", out) == 0
    assert "no demonstrations" in capsys.readouterr().out.replace("\n", " ")
    assert open_operator(out).content.is_generic

    request = tmp_path / "request.json"
    request.write_text(json.dumps({**scene.request("", samples=12), "model_id": "mdl_x"}))
    assert run("assess", "--model", out, "--json", request) == 0
    answer = json.loads(capsys.readouterr().out)
    assert set(answer["methods"]) == {"w-ik", "minimum-norm"}
    for one in answer["candidates"]:
        assert one["problem"] is None
        assert one["out_of_distribution"]["flag"]
        assert one["out_of_distribution"]["familiarity_min"] == 0.0
        (assumed,) = [a for a in one["assumed"] if a["what"] == "demonstrations"]
        assert "not seen" in assumed["value"] and "RULA mean" in assumed["effect"]

    # Bands of a person nobody has seen are wider than of one who showed how they move.
    assert run("assess", "--model", scene.file, "--json", request) == 0
    known = json.loads(capsys.readouterr().out)

    def spread(result: dict) -> float:  # type: ignore[type-arg]
        return float(
            np.mean(
                [
                    np.array(one["back_angle_deg"]["p95"]) - np.array(one["back_angle_deg"]["p05"])
                    for one in result["candidates"]
                ]
            )
        )

    assert spread(answer) > 1.5 * spread(known)


def test_a_recording_of_the_other_hand_is_told(tmp_path: Path, capsys: Capture) -> None:
    body = generate_model(Subject(1.72, 68.0, "female"))
    rng = np.random.default_rng(4)
    person = operator("average", rng, body)
    motion = simulate_reaching(body, person, rng, movements=2, hand="left", rate_hz=30.0).motion
    file, out = tmp_path / "left.bvh", tmp_path / "model.safetensors"
    # an arm to which nothing at all happens would count as not measured
    q = motion.q.copy()
    right = [7 + k for k, name in enumerate(body.dof_names) if name.startswith("jRight")]
    q[:, right] += 0.01 * np.sin(motion.time_s[:, None] + np.arange(len(right)))
    write_bvh(file, body, motion_from_configurations(body.dof_names, motion.time_s, q))
    train = ("train", file, *BODY, "--method", "cov-ik", "--out", out, "--json")
    assert run(*train) == 0
    notes = json.loads(capsys.readouterr().out)["notes"]
    assert any(one.startswith("left.bvh: the left hand goes") for one in notes)
    assert any("left hand goes" in one for one in open_operator(out).content.training["findings"])


def test_standing_still_teaches_nothing(tmp_path: Path, capsys: Capture) -> None:
    body = generate_model(Subject(1.72, 68.0, "female"))
    rng = np.random.default_rng(4)
    q = body.neutral() + 1e-3 * rng.standard_normal((200, 73))
    q[:, 3:7] = [0.0, 0.0, 0.0, 1.0]
    motion = motion_from_configurations(body.dof_names, np.arange(200) / 30.0, q)
    file = tmp_path / "still.bvh"
    write_bvh(file, body, motion)
    said = failed(capsys, "train", file, *BODY, "--out", tmp_path / "model")
    assert "hand stays within" in " ".join(said.split())
    assert not (tmp_path / "model").exists()


def test_what_is_read_is_never_overwritten(scene: Scene, tmp_path: Path, capsys: Capture) -> None:
    recording = tmp_path / "only_copy.bvh"
    recording.write_text("HIERARCHY")
    assert "not overwritten" in failed(capsys, "train", recording, *BODY, "--out", recording)
    request = tmp_path / "request.json"
    request.write_text(json.dumps(scene.request("mdl_x")))
    said = failed(capsys, "assess", "--model", scene.file, request, "--out", request)
    assert "not overwritten" in said
    assert recording.read_text() == "HIERARCHY" and "candidates" in request.read_text()
