"""The log of IIT's bowing experiment, by the column map that the readers' README shows."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from estimation import configuration_from_link
from estimation.required_wrench import required_wrench
from human import Subject, generate_model, motion_from_configurations
from human.readers import read_table

README = Path(__file__).parents[2] / "human" / "readers" / "README.md"


def shown_map() -> dict[str, object]:
    (shown,) = re.findall(r"```json\n(.*?)```", README.read_text(), re.DOTALL)
    return dict(json.loads(shown))


@pytest.mark.parametrize(("rate", "codes"), [(100, []), (50, ["rates"])])
def test_bowing(recordings_dir: Path, tmp_path: Path, rate: int, codes: list[str]) -> None:
    map_file = tmp_path / "map.json"
    map_file.write_text(json.dumps(shown_map() | {"rate_hz": rate}))
    log = read_table(recordings_dir / "iit_bowing" / "ExperimentDataset.mat", map_file).joints
    assert log is not None
    assert log.position.shape == (1465, 2) and log.joint_names == ("ankle", "hip")
    assert [finding.code for finding in log.report.findings] == codes
    # Bows to nearly 60 degrees; the plate bears one person, and gravity is on the chest.
    assert np.rad2deg(log.position[:, 1].max()) == pytest.approx(56.7, abs=0.1)
    assert np.median(log.wrenches["plate"].values[:, 2]) / 9.81 == pytest.approx(61.7, abs=0.5)
    gravity = np.linalg.norm(log.accelerometers["chest"].values, axis=1)
    assert np.median(gravity) == pytest.approx(9.81, abs=0.3)


def test_the_model_moved_by_the_log_needs_what_the_plate_measured(
    recordings_dir: Path, tmp_path: Path
) -> None:
    """Rate, signs and units together: one of them wrong, and the two have nothing in common."""
    # The log's two hinges are both ankles and both hips; flexion turns the farther part back.
    joints = {
        f"j{side}{joint}_roty": f"-joints.q[{row}]"
        for side in ("Right", "Left")
        for joint, row in (("Ankle", 1), ("Hip", 2))
    }
    map_file = tmp_path / "map.json"
    map_file.write_text(json.dumps(shown_map() | {"joints": joints}))
    log = read_table(recordings_dir / "iit_bowing" / "ExperimentDataset.mat", map_file).joints
    assert log is not None
    plate = log.wrenches["plate"].values
    model = generate_model(Subject(1.70, float(np.mean(plate[:, 2])) / 9.81))
    angles = log.to_motion(model).joint_angles.copy()
    for side, sign in (("Right", 1.0), ("Left", -1.0)):
        angles[:, model.dof_names.index(f"j{side}Shoulder_rotx")] = sign * 1.5
    q = configuration_from_link(model, angles, "RightFoot", [0.0, 0.0, 0.07], [0, 0, 0, 1])
    motion = motion_from_configurations(model.dof_names, log.time_s, q, window_s=0.4)
    needed = required_wrench(model, motion)
    # Forward, upward, and the moment that bowing and swaying take.
    for component, least in ((0, 0.9), (2, 0.95), (4, 0.95)):
        assert np.corrcoef(needed[:, component], plate[:, component])[0, 1] > least
    assert np.std(needed[:, 2] - plate[:, 2]) < 2.5
