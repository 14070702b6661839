"""The readers and the fit on real recordings; `benchmarks/recordings.py` prints the figures."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.recordings import FILES, PERSON, figures
from human.pose import fit_recording
from human.readers import inspect_recording, read_recording


def test_every_figure_meets_its_bar(recordings_dir: Path) -> None:
    measured = list(figures(recordings_dir))
    assert len(measured) >= 20
    assert not [figure.line() for figure in measured if not figure.passed]


@pytest.mark.parametrize(
    ("name", "version", "rate", "frames", "height"),
    [
        (FILES[0], "3 (MVN 4.2.4)", 240.0, 4, 1.68),
        (FILES[1], "4 (MVN 2019.0.0)", 60.0, 112, 1.64),
        (FILES[2], "Xsens skeleton", 60.0, 111, 1.63),
        (FILES[3], "Xsens skeleton", 60.0, 1149, 1.63),
    ],
)
def test_what_the_files_hold(
    recordings_dir: Path, name: str, version: str, rate: float, frames: int, height: float
) -> None:
    found = inspect_recording(recordings_dir / name)
    assert found.version == version
    assert found.rate_hz == pytest.approx(rate)
    assert found.frames == frames
    assert found.subject["skeleton_height_m"] == pytest.approx(height, abs=0.01)
    assert found.gaps == []
    assert len(found.segments) == 23


def test_legs_of_the_upper_body_recording_are_not_taken_for_measured(recordings_dir: Path) -> None:
    recording = read_recording(recordings_dir / FILES[1])
    assert "unmeasured-segments" in [f.code for f in recording.report.findings]
    twin = read_recording(recordings_dir / FILES[2])
    for name in ("LeftUpperLeg", "RightFoot", "LeftToe"):
        assert recording.segment_status[name] == twin.segment_status[name] == "unmeasured"
    assumed = fit_recording(recording, PERSON).motion.provenance.assumed
    assert assumed["LeftUpperLeg"] == "not measured in the recording"


def test_the_box_mover_stands_on_the_ground_and_walks(recordings_dir: Path) -> None:
    """Height, gravity and heading right: the lower foot stays near one level while he walks 2 m."""
    fitted = fit_recording(read_recording(recordings_dir / FILES[3]), PERSON, within_limits=False)
    recording = read_recording(recordings_dir / FILES[3])
    feet = [recording.segment_names.index(f"{side}Toe") for side in ("Right", "Left")]
    lowest = np.min(recording.position[:, feet, 2], axis=1)
    assert np.percentile(lowest, 95) - np.percentile(lowest, 5) < 0.06
    pelvis = fitted.motion.q[:, :2]
    assert 1.0 < np.max(np.linalg.norm(pelvis - pelvis[0], axis=1)) < 5.0
    # Forward in the pelvis's own axes is where he walks, most of the time.
    moving = np.linalg.norm(fitted.motion.v[:, :2], axis=1) > 0.5
    assert np.mean(fitted.motion.v[moving, 0] > 0.0) > 0.6
