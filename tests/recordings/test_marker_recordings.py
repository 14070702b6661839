"""Markers and force plates of real recordings."""

from pathlib import Path

import numpy as np
import pytest

from human.readers.opensim_table import plate_forces, read_opensim_table
from human.readers.trc import read_trc


@pytest.mark.parametrize(
    ("trial", "frames", "markers", "mass"),
    [("static1", 517, 55, 60.03), ("squats1", 1346, 51, 60.96)],
)
def test_opencap(recordings_dir: Path, trial: str, frames: int, markers: int, mass: float) -> None:
    folder = recordings_dir / "opencap_subject4"
    read = read_trc(folder / f"{trial}.trc")
    assert (read.frames, len(read.marker_names), read.rate_hz) == (frames, markers, 100.0)
    assert read.missing() == {}
    head = np.max(read.position[..., 2], axis=1)
    assert 1.4 < np.percentile(head, 90) < 2.3
    plates = plate_forces(read_opensim_table(folder / f"{trial}_grf.mot"))
    assert plates.supported_mass_kg() == pytest.approx(mass, abs=0.01)
    # The right foot stands on plate 1, the left on plate 2; x is forward, y to the left.
    point, _, valid = plates.centres_of_pressure()
    assert valid[:, :2].all()
    for plate, side in enumerate("rL"):
        at = read.marker_names.index("r_toe" if side == "r" else "L_toe")
        near = point[:, plate, :2] - read.position[: len(point), at, :2]
        assert np.median(np.linalg.norm(near, axis=-1)) < 0.25
    left, right = (read.marker_names.index(name) for name in ("L.ASIS", "r.ASIS"))
    across = read.position[:, left] - read.position[:, right]
    assert np.median(across[:, 1] / np.linalg.norm(across, axis=-1)) > 0.9


def test_opencap_walking_says_which_markers_are_lost(recordings_dir: Path) -> None:
    read = read_trc(recordings_dir / "opencap_subject4" / "walking1.trc")
    assert read.missing() == {"L_HJC": 1, "r_thigh3": 3, "r_thigh5": 121}
