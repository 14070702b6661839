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
    floor = rows["minimum-norm"]
    (chosen,) = (row for name, row in rows.items() if name.startswith("auto took"))
    assert chosen.joint_rmse_deg < 0.6 * floor.joint_rmse_deg
    # Taken on the first 70 %; on the rest it may not be the best, but must not be far from it.
    assert chosen.joint_rmse_deg < 1.2 * min(row.joint_rmse_deg for row in rows.values())
    assert chosen.rula_equal > floor.rula_equal


def test_the_band_holds_what_came(rows):
    (chosen,) = (row for name, row in rows.items() if name.startswith("auto took"))
    assert 0.8 <= chosen.coverage90 <= 0.98


def test_the_example_prints_its_table(rows, example):
    text = example.table(list(rows.values()))
    assert len(text.splitlines()) == 1 + len(rows) and "nan" not in text
