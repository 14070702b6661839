"""The command that runs the papers' experiments, on a short task, so that it cannot rot."""

import numpy as np
import pytest

from benchmarks.estimation.papers.__main__ import main
from benchmarks.estimation.papers.catalogue import EXPERIMENTS, Scenes
from benchmarks.estimation.papers.loads import RIGHT, mass_kg, ours, swept, without_ncwe
from benchmarks.estimation.papers.measuring import foot_wrenches
from benchmarks.estimation.papers.reports import Report, Table
from benchmarks.estimation.papers.scenes import TPOSE
from estimation import TPOSE_LOAD

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def scenes() -> Scenes:
    return Scenes(length=0.1)


def test_an_experiment_runs_from_readings_to_a_picture(tmp_path, capsys):
    assert main(["moments", "--out", str(tmp_path), "--length", "0.1"]) == 0
    said = capsys.readouterr().out
    assert "all bars passed" in said
    for moment in ("unloaded", "loaded, standing", "walking, left foot", "walking, right foot"):
        assert moment in said
    (picture,) = tmp_path.iterdir()
    assert picture.name in said
    assert picture.read_bytes().startswith(PNG)


def test_an_unknown_experiment_is_refused_by_name(capsys):
    with pytest.raises(SystemExit):
        main(["tea"])
    said = capsys.readouterr().err
    assert "tea" in said
    assert all(name in said for name in EXPERIMENTS)


def test_a_failed_bar_is_said_and_counted():
    table = Table("A table", ("what", "value", ""), [("good", 1.0, True), ("bad", 2.0, False)])
    report = Report("An experiment", (table, table))
    assert report.failed == 2
    assert report.text().count("FAIL") == 2
    assert report.text().count("pass") == 2


def test_zeros_for_accelerations_make_the_load_that_the_paper_blames_on_one_step(scenes):
    task = scenes.tpose_loaded
    held = task.simulated.truth.segment_id == TPOSE
    free = swept(TPOSE_LOAD, 1e4)
    fed = mass_kg(without_ncwe(task, free, accelerations=False), RIGHT)[held].mean()
    measured = mass_kg(without_ncwe(task, free), RIGHT)[held].mean()
    assert fed > 25.0
    assert measured == pytest.approx(5.0, abs=0.4)
    assert mass_kg(ours(task), RIGHT)[held].mean() == pytest.approx(5.0, abs=0.4)


@pytest.mark.parametrize("kind", ["shoes", "plates"])
def test_what_the_feet_read_together_is_what_the_ground_does(scenes, kind):
    task = scenes.tpose_exact if kind == "plates" else scenes.tasks["T1"]
    read, true = foot_wrenches(task)
    bound = 1e-9 if kind == "plates" else 6.0
    assert np.abs(read - true)[:, task.arrived].max() < bound
    assert np.abs(true).max() > 300.0
