"""Prediction on real people: reaches where people make them; too little motion is refused."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.prediction.led_paths import FILE, drawn_paths
from benchmarks.prediction.real_motion import PEOPLE, compared, demonstrations_of, splits_for
from prediction import TrainingOptions, compare_on_splits, find_reaches

BY_NAME = {person.name: person for person in PEOPLE}


@pytest.fixture(scope="module")
def squatter(recordings_dir: Path):
    return demonstrations_of(recordings_dir, BY_NAME["opencap_subject4"])


def test_five_squats_are_ten_reaches_down_and_up(squatter):
    _, takes = squatter
    name, squats = takes[0]
    found = find_reaches(squats)
    assert name == "squats1" and len(found) == 10
    # The arms come forward and up as the body goes down, and back.
    rises = found.displacement[:, 2] > 0.0
    assert (rises[1:] != rises[:-1]).all()
    cycle = found.start[2:] - found.start[:-2]
    assert cycle.std() < 0.2 * cycle.mean()


def test_squats_seen_teach_the_next_ones(squatter):
    chain, takes = squatter
    split = next(
        s for s in splits_for(BY_NAME["opencap_subject4"], takes, full=False) if s.design == "block"
    )
    found = compare_on_splits(
        chain, [split], ["cov-ik"], seed=1, options=TrainingOptions(blocks=2), samples=10
    )[0]
    learned, floor = found.scores["cov-ik"], found.scores["minimum-norm"]
    assert learned.rollout_hand_mean_m <= 2e-4
    for horizon in ("0.25", "0.5", "1"):
        assert learned.rollout_rmse_deg_at[horizon] < 0.5 * floor.rollout_rmse_deg_at[horizon]


def test_two_seconds_of_motion_are_refused_in_words(recordings_dir):
    found = compared(recordings_dir, BY_NAME["xsens_mvnx"], False, lambda _: None)
    assert not found.scores and found.reaches == {"test_mocap": 2}
    assert "nothing remains to train on" in found.problem


def test_drawn_paths_are_as_their_makers_say(recordings_dir):
    paths = drawn_paths(recordings_dir / FILE)
    assert [path.name for path in paths] == ["rec0", "rec1", "rec2", "rec3"]
    for path in paths:
        width = np.ptp(path.position, axis=0)
        assert width[2] < 2e-3 and 0.05 < width[0] < 0.15 and 0.1 < width[1] < 0.2
        assert np.diff(path.time_s) == pytest.approx(1.0 / 30.0, rel=0.05)
