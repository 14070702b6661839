"""``ergocast estimate`` on a laboratory's log of joint angles, read with a column map."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.app.cli.running import Capture, failed, run
from tests.app.estimates.conftest import PERSON as WHO
from tests.app.estimates.lifting import BOX_KG, Lifting

BASE = ["x", "y", "z", "qx", "qy", "qz", "qw"]


@pytest.fixture
def log(lifting: Lifting, tmp_path: Path) -> tuple[Path, Path]:
    """The true motion as a CSV file with its map."""
    motion = lifting.truth.motion
    names = list(motion.model_dof_names)
    np.savetxt(
        tmp_path / "log.csv", np.column_stack([motion.time_s, motion.q]), delimiter=",",
        header=",".join(["t", *BASE, *names]), comments="",
    )  # fmt: skip
    content = {
        "time": "t",
        "up": "z",
        "units": {"angle": "rad", "length": "m"},
        "base": {"position": BASE[:3], "orientation_xyzw": BASE[3:]},
        "joints": {name: name for name in names},
    }
    (tmp_path / "map.json").write_text(json.dumps(content))
    return tmp_path / "log.csv", tmp_path / "map.json"


def test_angles_and_plates_weigh_the_box(
    log: tuple[Path, Path], lifting: Lifting, capsys: Capture
) -> None:
    file, columns = log
    assert run("estimate", file, f"grf:{lifting.grf}", *WHO, "--columns", columns, "--json") == 0
    summary = json.loads(capsys.readouterr().out)
    (held,) = [hold for hold in summary["holds"] if hold["state"] == "loaded"]
    assert held["mass_kg"]["p05"] <= BOX_KG <= held["mass_kg"]["p95"]
    assert held["mass_kg"]["p50"] == pytest.approx(BOX_KG, abs=0.3)
    assert any("lengths are those usual" in said for said in summary["assumed"])


def test_joints_that_the_model_has_not_are_named(log: tuple[Path, Path], capsys: Capture) -> None:
    file, columns = log
    content = json.loads(columns.read_text())
    content["joints"] = {"knee": next(iter(content["joints"]))}
    columns.write_text(json.dumps(content))
    said = failed(capsys, "estimate", file, "--columns", columns, *WHO)
    assert "degrees of freedom of the model" in said and "log.csv" in said
