"""The log of IIT's bowing experiment, by the column map that the readers' README shows."""

import re
from pathlib import Path

import numpy as np
import pytest

from human.readers import read_table

README = Path(__file__).parents[2] / "human" / "readers" / "README.md"


@pytest.mark.parametrize(("rate", "codes"), [(100, []), (50, ["rates"])])
def test_bowing(recordings_dir: Path, tmp_path: Path, rate: int, codes: list[str]) -> None:
    (shown,) = re.findall(r"```json\n(.*?)```", README.read_text(), re.DOTALL)
    map_file = tmp_path / "map.json"
    map_file.write_text(shown.replace('"rate_hz": 100', f'"rate_hz": {rate}'))
    log = read_table(recordings_dir / "iit_bowing" / "ExperimentDataset.mat", map_file).joints
    assert log is not None
    assert log.position.shape == (1465, 2) and log.joint_names == ("ankle", "hip")
    assert [finding.code for finding in log.report.findings] == codes
    # Bows to nearly 60 degrees; the plate bears one person, and gravity is on the chest.
    assert np.rad2deg(log.position[:, 1].max()) == pytest.approx(56.7, abs=0.1)
    assert np.median(log.wrenches["plate"].values[:, 2]) / 9.81 == pytest.approx(61.7, abs=0.5)
    gravity = np.linalg.norm(log.accelerometers["chest"].values, axis=1)
    assert np.median(gravity) == pytest.approx(9.81, abs=0.3)
