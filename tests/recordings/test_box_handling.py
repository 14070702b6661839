"""The main job on real input: a person's posture from the path of their hand."""

import importlib.util
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "box_handling.py"


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("box_handling", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    import sys

    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def rows(example, recordings_dir):
    found, _ = example.compare(recordings_dir / "xsens_bvh_box" / "MotionBox_XSens.bvh", samples=50)
    print("\n" + example.table(found))
    return {row.method: row for row in found}


def test_the_hand_is_on_its_path(rows):
    for row in rows.values():
        assert row.hand_max_mm <= 5.0, row.method
        assert row.hand_mean_mm <= 0.2, row.method


def test_learning_from_the_person_beats_minimum_norm(rows):
    floor = rows["minimum-norm IK"].joint_rmse_deg
    assert min(row.joint_rmse_deg for row in rows.values()) < 0.6 * floor
    assert rows["MI-NsGP, as trained by default"].joint_rmse_deg < floor
    assert rows["Cov-IK"].rula_equal > rows["minimum-norm IK"].rula_equal


def test_the_band_holds_what_came(rows):
    best = min(rows.values(), key=lambda row: row.joint_rmse_deg)
    assert 0.75 <= best.coverage90 <= 0.98


def test_the_example_prints_its_table(rows, example):
    text = example.table(list(rows.values()))
    assert len(text.splitlines()) == 5 and "nan" not in text
