"""The benchmark of prediction: that its splits are what they say, and that no failure is lost."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from benchmarks.figure import Figure
from benchmarks.prediction import __main__ as every
from benchmarks.prediction.planar_operator import SAMPLES, SPLITS, score_truth, split
from human.simulate import simulate_planar


@pytest.fixture(scope="module")
def raw():
    return simulate_planar(np.random.default_rng(5), samples=SAMPLES)


@pytest.mark.parametrize("kind", SPLITS)
def test_splits_share_no_sample_and_blocks_keep_the_end_for_the_test(raw, kind):
    train, test, xdot = split(raw, kind, 5)
    assert (len(train), len(test)) == (700, 300)
    rows = {row.tobytes() for row in raw.q}
    seen = {row.tobytes() for row in train.q}
    kept = {row.tobytes() for row in test.q}
    assert seen | kept == rows and not seen & kept
    assert (train.time_s.max() < test.time_s.min()) == (kind == "block")
    assert np.abs(xdot - test.xdot).std() == pytest.approx(raw.sigma_x, rel=0.5)


def test_the_law_that_made_the_data_is_calibrated_and_moves_the_hand_as_led(raw):
    _, test, xdot = split(raw, "random", 5)
    truth = score_truth(raw, test, xdot)
    assert truth.coverage == pytest.approx(0.9, abs=0.03)
    assert truth.hand_worst < 1e-12
    # y has k = 3 numbers of sd .02, the hand two of .002: no better density can be had on average.
    hand = -np.log(2 * np.pi * raw.sigma_x**2) - 1
    assert truth.hand_nats == pytest.approx(hand, abs=0.2)


def test_a_missed_bar_and_a_broken_part_stand_in_the_end(monkeypatch, capsys):
    def part(name, options):
        if name == "training":
            raise RuntimeError("no gpytorch here")
        yield Figure("kept", 1.0, "x", most=2.0, beside="peer 3")
        yield Figure("missed", float("nan"), "x", least=2.0)

    monkeypatch.setattr(every, "part", part)
    assert every.main(["--only", "training", "planar"]) == 1
    lines = capsys.readouterr().out.splitlines()
    table = lines[-6:]
    assert any(line.startswith("pass  kept") and "peer 3" in line for line in table)
    assert any(line.startswith("FAIL  missed") and ">= 2" in line for line in table)
    assert "1 bars missed" in table and "broke off: training" in table


def test_every_part_that_the_command_runs_is_there():
    for name in (*every.PARTS, *every.REAL):
        place = f"{name}.every" if name == "paper_figures" else name
        spec = find_spec(f"benchmarks.prediction.{place}")
        assert "\ndef figures(" in Path(spec.origin).read_text("utf-8"), name
