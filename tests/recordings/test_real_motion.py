"""Joint moments of a real walk against those that Vicon left in its file."""

from pathlib import Path

from benchmarks.estimation.real_motion.comparison import compare
from benchmarks.estimation.real_motion.trials import vicon_trial


def test_markers_and_plates_alone_give_vicons_moments(recordings_dir: Path) -> None:
    trial = vicon_trial(recordings_dir)
    rows = compare(trial.user.found, trial.theirs, "gait")
    assert len(rows) == 6
    assert {row.joint: row.passed for row in rows} == {row.joint: True for row in rows}
    # One foot or both are beside the plates in half of the frames: left out, not wrong.
    assert all(90 < len(row.time_s) < 170 for row in rows)
