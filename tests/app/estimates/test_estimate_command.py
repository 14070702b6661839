"""``ergocast estimate`` on files of a simulated laboratory, held to the truth behind them."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from app.estimates.schemas import EstimateOptions
from app.estimates.series import Series
from app.estimation import estimate_take
from app.takes import takes_of
from human.readers import write_plates
from tests.app.cli.running import Capture, failed, run
from tests.app.estimates.conftest import PERSON
from tests.app.estimates.lifting import BOX_KG, EMPTY_S, HELD_S, Lifting, lifting_plates

Estimated = tuple[dict[str, Any], Path]


def inside(time_s: np.ndarray, stretch: tuple[float, float]) -> np.ndarray:
    return (time_s >= stretch[0]) & (time_s < stretch[1])


def test_the_box_is_weighed_while_it_is_held_and_only_then(estimated: Estimated) -> None:
    summary, folder = estimated
    states = [hold["state"] for hold in summary["holds"]]
    assert states == ["free", "loaded", "free"]
    held = summary["holds"][1]
    assert held["start_s"] < HELD_S[0] and held["end_s"] > HELD_S[1]
    mass = held["mass_kg"]
    assert mass["p05"] <= BOX_KG <= mass["p95"]
    assert mass["p50"] == pytest.approx(BOX_KG, abs=0.3)
    # Two hands on one box: only their sum shows, and no share is made up.
    assert held["split_kg"] is None
    series = Series(folder / "series.parquet")
    assert np.all(np.isnan(series["right_hand_payload_kg"][inside(series["time_s"], HELD_S)]))
    empty = inside(series["time_s"], EMPTY_S)
    assert abs(np.median(series["payload_p50_kg"][empty])) < 0.3
    assert set(series.words("left_hand_state")[empty]) == {"free"}


def test_torques_are_those_of_the_truth_within_their_bands(
    estimated: Estimated, lifting: Lifting
) -> None:
    _, folder = estimated
    series = Series(folder / "series.parquet")
    time_s = series["time_s"]
    truth = lifting.truth.truth.dynamics.effort[:, 6:]
    calm = inside(time_s, HELD_S) | inside(time_s, EMPTY_S)
    at = np.searchsorted(lifting.truth.motion.time_s, time_s - 1e-6)
    names = [n for n in lifting.model.dof_names if f"{n}_torque_nm" in series.names]
    errors, sds = [], []
    for name in names:
        true = truth[at, lifting.model.dof_names.index(name)]
        errors.append((series[f"{name}_torque_nm"] - true)[calm])
        sds.append(series[f"{name}_torque_sd_nm"][calm])
    error, sd = np.array(errors), np.array(sds)
    known = np.isfinite(error)
    # With both hands on a box nobody knows what either arm bears; the toes have no markers.
    arms = [any(word in name for word in ("Shoulder", "Elbow", "Wrist")) for name in names]
    rest = known[~np.array(arms) & ["BallFoot" not in name for name in names]]
    empty = inside(time_s[calm], EMPTY_S)
    assert rest[:, empty].all() and known[arms][:, empty].all()
    legs = [any(word in name for word in ("Hip", "Knee", "Ankle")) for name in names]
    assert known[legs].all()
    assert np.sqrt(np.mean(error[known] ** 2)) < 1.0
    # With errors of the body model in the bands, nearly all of the truth lies inside.
    assert np.mean(np.abs(error[known]) < 2.0 * sd[known]) > 0.9


def test_columns_state_si_units_and_what_cannot_be_told_is_empty(
    estimated: Estimated, lifting: Lifting
) -> None:
    summary, folder = estimated
    file = pq.ParquetFile(folder / "series.parquet")
    schema = file.schema_arrow
    units = {field.name: field.metadata[b"unit"].decode() for field in schema}
    assert units["time_s"] == "s" and units["jRightElbow_rotz_torque_nm"] == "N m"
    assert units["right_foot_force_z_n"] == "N" and units["payload_p50_kg"] == "kg"
    assert units["jRightElbow_rotz_angle_rad"] == "rad"
    assert list(schema.names) == summary["columns"]
    said = {key.decode(): value.decode() for key, value in schema.metadata.items()}
    assert json.loads(said["options"])["mass_kg"] == 72.0 and "empty cell" in said["conventions"]
    files = {one["role"]: one for one in json.loads(said["files"])}
    assert set(files) == {"motion", "static", "grf"} and len(files["grf"]["sha256"]) == 64
    # No marker is on the toes: their torques are nobody's guess.
    assert file.read(["jRightBallFoot_roty_torque_nm"]).column(0).null_count == len(
        Series(folder / "series.parquet")["time_s"]
    )
    assert any("RightToe" in text for text in summary["assumed"])
    assert (folder / "body.urdf").read_text().startswith("<?xml")


def test_without_forces_arms_are_known_and_legs_and_payload_are_not(
    lifting: Lifting, tmp_path: Path, capsys: Capture
) -> None:
    assert run("estimate", lifting.motion, *PERSON, "--json", "--out", tmp_path) == 0
    summary = json.loads(capsys.readouterr().out)
    known = {one["joint"] for one in summary["efforts"]}
    assert "jRightElbow" in known and not known & {"jRightKnee", "jLeftHip", "jLeftAnkle"}
    assert (summary["feet"], summary["holds"], summary["payload"]["max_kg"]) == (None, [], None)
    assert summary["balance"]["share"] == {"unknown": 1.0}
    assert any("no foot forces" in text for text in summary["findings"])
    # What nothing measured is no number: neither the feet's share of the weight nor the hands'.
    series = Series(tmp_path / "lift.trc.estimate" / "series.parquet")
    assert np.all(np.isnan(series["right_foot_force_z_n"]))


def test_people_read_the_same(estimated: Estimated, lifting: Lifting, capsys: Capture) -> None:
    from app.cli.estimate import print_summary

    summary, _ = estimated
    print_summary(summary)
    shown = capsys.readouterr().out
    for words in ("Payload by hold", "sum only", "Joint effort", "Assumed, not measured"):
        assert " ".join(words.split()) in " ".join(shown.split())
    assert f"{summary['holds'][1]['mass_kg']['p50']:.2f}" in shown


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--height", 17, "--mass", 72], "/height_m"),
        (["--height", 1.75], "/mass_kg"),
        (["--height", 1.75, "--mass", "nan"], "/mass_kg"),
        (["--height", 1.75, "--mass", 72, "--tare", "3:1"], "/tare_s: expected"),
        (["--height", 1.75, "--mass", 72, "--tare", "soon"], "START:END"),
        (["--height", 1.75, "--mass", 72, "--assign", "1=middle"], "--assign 1=middle"),
        (["--height", 1.75, "--mass", 72, "--clock-offset", "nan"], "/clock_offset_s"),
    ],
)
def test_what_cannot_be_is_named(
    lifting: Lifting, tmp_path: Path, capsys: Capture, options: list[object], words: str
) -> None:
    said = failed(capsys, "estimate", lifting.motion, *options, "--out", tmp_path / "out")
    assert words in said
    assert not list(tmp_path.rglob("*.parquet"))


def test_a_mass_weighed_with_one_foot_beside_the_plate_is_not_believed(
    lifting: Lifting, tmp_path: Path, capsys: Capture
) -> None:
    plates = lifting_plates(lifting.truth)
    one = replace(
        plates,
        plates=plates.plates[:1],
        force=plates.force[:, :1],
        moment=plates.moment[:, :1],
    )
    write_plates(tmp_path / "static_grf.mot", one)
    files = [f"static:{lifting.static}", f"grf:{tmp_path / 'static_grf.mot'}", lifting.motion]
    said = failed(capsys, "estimate", *files, "--height", 1.75, "--out", tmp_path / "out")
    assert "/mass_kg" in said and "kg on the plates" in said and "a foot may stand" in said


def test_a_file_in_the_wrong_role_is_named(lifting: Lifting, capsys: Capture) -> None:
    said = failed(capsys, "estimate", lifting.grf, *PERSON)
    assert "lift_grf.mot" in said and "grf:lift_grf.mot" in said
    said = failed(capsys, "estimate", lifting.motion, f"grf:{lifting.motion}", *PERSON)
    assert "lift.trc" in said and "force plates" in said
    said = failed(capsys, "estimate", f"static:{lifting.grf}", lifting.motion, *PERSON)
    assert "lift_grf.mot" in said and "markers" in said


def test_what_stops_half_way_leaves_nothing(lifting: Lifting, tmp_path: Path) -> None:
    take = takes_of([f"static:{lifting.static}", str(lifting.motion), f"grf:{lifting.grf}"])[0]
    options = EstimateOptions(height_m=1.75, mass_kg=72.0, bands="noise")

    def stop(what: str, done: int, total: int) -> None:
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        estimate_take(take, options, tmp_path / "out", stop)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_ctrl_c_says_so_and_leaves_nothing(
    lifting: Lifting, tmp_path: Path, capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> dict[str, Any]:
        raise KeyboardInterrupt

    monkeypatch.setattr("app.estimation.summarised", interrupted)
    assert run("estimate", lifting.motion, *PERSON, "--bands", "noise", "--out", tmp_path) == 130
    assert "nothing half-written" in capsys.readouterr().err
    assert not [path for path in tmp_path.rglob("*") if path.is_file() and "part" in path.name]
    assert not list(tmp_path.rglob("summary.json"))


def test_motions_of_one_name_do_not_write_over_each_other(
    lifting: Lifting, tmp_path: Path, capsys: Capture
) -> None:
    twin = tmp_path / "twin" / lifting.motion.name
    twin.parent.mkdir()
    twin.write_bytes(lifting.motion.read_bytes())
    said = failed(capsys, "estimate", lifting.motion, twin, *PERSON, "--out", tmp_path / "out")
    assert "lift.trc 2 times" in said and not (tmp_path / "out").exists()


def test_accelerations_that_no_frames_show_are_not_taken_to_be_zero(
    lifting: Lifting, tmp_path: Path, capsys: Capture
) -> None:
    few = tmp_path / "few.trc"
    head_and_two_frames = lifting.motion.read_text().splitlines()[:8]
    few.write_text("\n".join(head_and_two_frames) + "\n")
    said = failed(capsys, "estimate", few, *PERSON, "--out", tmp_path / "out")
    assert "few.trc" in said and "too few frames in a row to derive accelerations" in said
    assert not list(tmp_path.rglob("*.parquet"))


def test_what_is_wrong_in_a_file_itself_is_said(
    lifting: Lifting, tmp_path: Path, capsys: Capture
) -> None:
    cut = tmp_path / "cut.trc"
    lines = lifting.motion.read_text().splitlines()
    cut.write_text("\n".join(lines[:100] + lines[120:200]) + "\n")
    assert run("estimate", cut, *PERSON, "--bands", "noise", "--json") == 0
    found = json.loads(capsys.readouterr().out)["findings"]
    assert any(text.startswith("cut.trc, line 3, NumFrames") for text in found)
    assert any("20 frames are missing" in text for text in found)


def test_one_bad_recording_does_not_cost_the_others_theirs(
    lifting: Lifting, tmp_path: Path, capsys: Capture
) -> None:
    bad = tmp_path / "bad.trc"
    bad.write_text("PathFileType\t4\n")
    options = [*PERSON, "--bands", "noise", "--json"]
    assert run("estimate", bad, lifting.motion, *options) == 2
    captured = capsys.readouterr()
    first, second = json.loads(captured.out)
    assert first["problem"]["type"] == "/problems/unreadable-file" and "bad.trc" in captured.err
    assert second["source"] == "lift.trc" and second["frames"] > 300
