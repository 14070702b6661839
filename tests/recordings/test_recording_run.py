"""A run over real people on plates, with empty hands: what it must not make of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation import (
    Balance,
    HandState,
    ModelErrors,
    RunChunk,
    RunSettings,
    RunSummary,
    estimate_run,
    feet_from_plates,
)
from human import Subject
from human.markers import body_from_static, fit_markers
from human.readers import read_markers
from human.readers.opensim_table import plate_forces, read_opensim_table

#: Fewer draws than by default: quicker, and as good for what is asked here.
SETTINGS = RunSettings(model_errors=ModelErrors(feet_seen=True, pairs=4, grid_s=0.5))


@pytest.fixture(scope="module")
def run(recordings_dir: Path):
    """Estimates the first seconds of a trial of a person of 60 kg who is said to weigh 62.6 kg."""
    folder = recordings_dir / "opencap_subject4"
    body = body_from_static(read_markers(folder / "static1.trc"), Subject(1.70, 62.6, "female"))

    def estimated(name: str, seconds: float, **more) -> tuple[RunChunk, RunSummary]:
        recording = read_markers(folder / f"{name}.trc")
        keep = recording.time_s < seconds
        cut = {part: getattr(recording, part)[keep] for part in ("time_s", "position", "valid")}
        motion = fit_markers(body, replace(recording, **cut)).motion
        plates = plate_forces(read_opensim_table(folder / f"{name}_grf.mot"))
        feet = feet_from_plates(body.model, motion, plates)
        settings = replace(SETTINGS, unobserved=body.unobserved(), **more)
        return estimate_run(body.model, motion, feet, settings)

    return estimated


def test_squats_without_a_load_weigh_nothing_once_the_person_was_weighed(run) -> None:
    chunk, summary = run("squats1", 5.0, tare_s=(0.0, 0.6))
    assert summary.tare is not None
    assert summary.body_mass_kg == pytest.approx(60.1, abs=0.6)
    assert np.all(chunk.hands_state == HandState.FREE)
    assert len(summary.holds) == 1
    for hold in summary.holds:
        mass = hold.mass()
        assert abs(mass.mass_kg) < min(1.0, 3.0 * (mass.sd_kg or 0.0))
    assert np.all(chunk.balance == Balance.KNOWN)
    for joint in ("jL5S1", "jRightKnee", "jLeftHip", "jRightElbow"):
        assert summary.joint_known_share[joint] == 1.0
    # No marker was on the hands.
    assert summary.joint_known_share["jRightWrist"] == 0.0


def test_without_a_tare_the_wrong_mass_is_noticed(run) -> None:
    chunk, summary = run("squats1", 3.0)
    assert any("kg less than the body of 62.6 kg" in text for text in summary.findings) or (
        summary.plates_minus_model_kg is not None and summary.plates_minus_model_kg[1] < -1.5
    )
    assert not np.any(chunk.hands_state == HandState.LOADED)


def test_a_chair_is_noticed_and_no_payload_is_made_of_it(run) -> None:
    chunk, summary = run("STS1", 5.0)
    seated = chunk.balance == Balance.UNKNOWN
    assert 0.3 < np.mean(seated) < 0.7
    assert np.all(chunk.hands_state[seated] == HandState.UNKNOWN)
    assert not np.any(chunk.payload_known[seated])
    assert any("a chair, a table" in text for text in summary.findings)
    knee = list(summary.joint_names).index("jRightKnee")
    assert np.mean(chunk.effort_known[:, knee]) > 0.95
