"""The log of IIT's bowing experiment, by the column map that the readers' README shows."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from estimation import feet_from_plates
from estimation.feet.required_wrench import required_wrench
from human import JointLog, Subject, generate_model
from human.marker_recording import PlateForces
from human.readers import read_table

README = Path(__file__).parents[2] / "human" / "readers" / "README.md"


def read(recordings_dir: Path, folder: Path, **changes: object) -> tuple[JointLog, PlateForces]:
    (shown,) = re.findall(r"```json\n(.*?)```", README.read_text(), re.DOTALL)
    (folder / "map.json").write_text(json.dumps(json.loads(shown) | changes))
    table = read_table(recordings_dir / "iit_bowing" / "ExperimentDataset.mat", folder / "map.json")
    assert table.joints is not None and table.plates is not None
    return table.joints, table.plates


@pytest.mark.parametrize(("rate", "codes"), [(100, []), (50, ["rates"])])
def test_bowing(recordings_dir: Path, tmp_path: Path, rate: int, codes: list[str]) -> None:
    log, plates = read(recordings_dir, tmp_path, rate_hz=rate)
    assert log.position.shape == (1465, 4)
    assert [finding.code for finding in log.report.findings] == codes
    # Bows to nearly 60 degrees; the plate bears one person, and gravity is on the chest.
    assert np.rad2deg(-log.position[:, 2].min()) == pytest.approx(56.7, abs=0.1)
    assert plates.supported_mass_kg() == pytest.approx(61.7, abs=0.2)
    gravity = np.linalg.norm(log.accelerometers["chest"].values, axis=1)
    assert np.median(gravity) == pytest.approx(9.81, abs=0.3)


def test_the_model_moved_by_the_log_needs_what_the_plate_measured(
    recordings_dir: Path, tmp_path: Path
) -> None:
    """Rate, signs and units together: one of them wrong, and the two have nothing in common."""
    log, plates = read(recordings_dir, tmp_path)
    mass = plates.supported_mass_kg()
    assert mass is not None
    model = generate_model(Subject(1.70, mass))
    motion = log.to_motion(model)
    needed = required_wrench(model, motion)
    plate = np.concatenate([plates.force[:, 0], plates.moment[:, 0]], axis=1)
    # Forward, upward, and the moment that bowing and swaying take.
    for component, least in ((0, 0.85), (2, 0.9), (4, 0.95)):
        assert np.corrcoef(needed[:, component], plate[:, component])[0, 1] > least
    assert np.std(needed[:, 2] - plate[:, 2]) < 3.0
    # The origin of the log's foot frame is under the middle of the foot: so the README has it.
    assert abs(np.mean(needed[:, 4] - plate[:, 4])) / (9.81 * mass) < 0.01
    feet = feet_from_plates(model, motion, plates)
    assert [stance.foot for stance in feet.stances] == ["both"]
