"""Recordings that must not be trained on together, or at all."""

from pathlib import Path

import numpy as np
import pytest

from app.problems import InvalidRequest, Unreadable
from app.takes import takes_of
from app.training import motions_of, train
from app.unseen import unseen_finding
from human import Subject, generate_model, motion_from_configurations
from human.readers import write_bvh
from prediction import DemonstrationError, TrainingOptions, led_chain


def recording(folder: Path, name: str, subject: Subject) -> str:
    """Writes somebody who hardly moves."""
    body = generate_model(subject)
    q = np.tile(body.neutral(), (30, 1))
    q[:, 7:] += 0.01 * np.sin(np.arange(30) / 5.0)[:, None]
    file = folder / name
    write_bvh(file, body, motion_from_configurations(body.dof_names, np.arange(30) / 30.0, q))
    return str(file)


def test_two_people_are_told_apart(tmp_path: Path) -> None:
    tall, small = Subject(1.9, 85.0), Subject(1.6, 55.0)
    files = [recording(tmp_path, "tall.bvh", tall), recording(tmp_path, "small.bvh", small)]
    with pytest.raises(InvalidRequest, match=r"small\.bvh and tall\.bvh are of different bodies"):
        motions_of(takes_of(files), tall)
    with pytest.raises(InvalidRequest, match=r"small\.bvh and the model"):
        motions_of(takes_of(files[1:]), small, known=generate_model(tall))


def test_a_hand_that_nothing_measured_is_not_learned(tmp_path: Path) -> None:
    person = Subject(1.75, 70.0)
    body = generate_model(person)
    q = np.tile(body.neutral(), (30, 1))
    q[:, 7:] += 0.01 * np.sin(np.arange(30) / 5.0)[:, None]
    still = [7 + k for k, name in enumerate(body.dof_names) if name.startswith("jLeft")]
    q[:, still] = 0.0
    file = tmp_path / "right.bvh"
    write_bvh(file, body, motion_from_configurations(body.dof_names, np.arange(30) / 30.0, q))
    recorded = motions_of(takes_of([str(file)]), person)
    for hand, base in (("left", "pelvis"), ("both", "pelvis"), ("right", "feet")):
        with pytest.raises(DemonstrationError, match=r"right\.bvh: neither Left.* was measured"):
            train(recorded, hand, base, seed=0, options=TrainingOptions())
    right = led_chain(recorded.model, "right")
    assert unseen_finding(right, recorded.unobserved[0]) is None
    assert "T8 not measured" in str(unseen_finding(right, {"T8", "LeftHand"}))


def test_a_number_that_is_none_stops_the_reading(tmp_path: Path) -> None:
    file = Path(recording(tmp_path, "broken.bvh", Subject(1.75, 70.0)))
    lines = file.read_text().splitlines()
    lines[-5] = lines[-5].replace(lines[-5].split()[9], "nan", 1)
    file.write_text("\n".join(lines))
    with pytest.raises(Unreadable, match=r"broken\.bvh"):
        motions_of(takes_of([str(file)]), Subject(1.75, 70.0))
