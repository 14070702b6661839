"""`ergocast estimate` on laboratories' own files: plates found under feet, nothing implausible."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.app.cli.running import Capture, run


def estimate(capsys: Capture, *arguments: object) -> dict[str, Any]:
    assert run("estimate", *arguments, "--json") == 0
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


def test_squats_on_two_plates(recordings_dir: Path, capsys: Capture) -> None:
    here = recordings_dir / "opencap_subject4"
    found = estimate(
        capsys, f"static:{here / 'static1.trc'}", here / "squats1.trc",
        f"grf:{here / 'squats1_grf.mot'}", f"grf:{here / 'static1_grf.mot'}", "--height", 1.68,
    )  # fmt: skip
    # The plates of the static trial say 60.03 kg; plate 1 is under the right foot.
    assert found["person"]["mass_kg"] == pytest.approx(60.03, abs=0.1)
    assert {(one["plate"], one["foot"]) for one in found["feet"]["stances"]} >= {
        ("1", "right"),
        ("2", "left"),
    }
    assert found["balance"]["share"]["known"] > 0.95
    efforts = {one["joint"]: one["peak_nm"]["p50"] for one in found["efforts"]}
    assert 60.0 < efforts["jL5S1"] < 160.0 and 40.0 < efforts["jRightKnee"] < 120.0
    assert found["fit"]["marker_rms_m"] < 0.02


@pytest.mark.parametrize(
    ("file", "height", "mass"),
    [
        ("rehazenter_gait/2014001_C1_01.c3d", 1.70, 65.0),
        ("cmu_c3d/cmu_02_05.c3d", 1.75, 70.0),
        ("xsens_bvh_box/MotionBox_XSens.bvh", 1.78, 75.0),
        ("opensim_walking_c3d/walking5.c3d", 1.75, 70.0),
    ],
)
def test_no_joint_bears_what_no_joint_can(
    recordings_dir: Path, capsys: Capture, file: str, height: float, mass: float
) -> None:
    found = estimate(capsys, recordings_dir / file, "--height", height, "--mass", mass)
    assert found["efforts"]
    # Nothing these people do is near three newton metres for each kilogram they weigh.
    assert all(one["peak_nm"]["p50"] < 3.0 * mass for one in found["efforts"])
