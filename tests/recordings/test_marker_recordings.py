"""Markers and force plates of real recordings."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from human.marker_recording import PlateForces
from human.readers.c3d import read_c3d
from human.readers.inspect_markers import inspect_file
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


@pytest.mark.parametrize(
    ("name", "frames", "markers", "rate", "missing", "mass", "events"),
    [
        ("rehazenter_gait/2014001_C1_01.c3d", 387, 52, 100.0, 0, 66.6, 7),
        ("rehazenter_gait/2014001_ST.c3d", 1, 52, 100.0, 0, None, 0),
        ("opensim_walking_c3d/walking5.c3d", 1103, 40, 250.0, 20082, 64.4, 0),
        ("pyomeca_arm_box/markers_analogs.c3d", 580, 51, 100.0, 305, None, 0),
        ("cmu_c3d/cmu_02_05.c3d", 1854, 41, 120.0, 3, None, 0),
    ],
)
def test_c3d(
    recordings_dir: Path, name: str, frames: int, markers: int, rate: float, missing: int,
    mass: float | None, events: int,
) -> None:  # fmt: skip
    read = read_c3d(recordings_dir / name)
    assert (read.frames, len(read.marker_names), read.rate_hz) == (frames, markers, rate)
    assert sum(read.missing().values()) == missing
    assert len(read.events) == events
    assert not read.report.findings
    if mass is None:
        assert read.plates is None
        return
    assert read.plates is not None
    assert read.plates.supported_mass_kg() == pytest.approx(mass, abs=0.1)
    _enter_inside_the_corners(read.plates)


def test_c3d_of_four_plates_keeps_its_clock_and_leaves_out_results(
    recordings_dir: Path, tmp_path: Path
) -> None:
    with zipfile.ZipFile(recordings_dir / "ktk_walk" / "walk.c3d.zip") as archive:
        read = read_c3d(Path(archive.extract("walk.c3d", tmp_path)))
    assert read.time_s[0] == pytest.approx(1.52)
    assert read.report.channels == {"markers": 58, "analog": 248, "results": 38}
    assert not any(name.endswith("Moment") for name in read.marker_names)
    assert read.plates is not None and len(read.plates.plates) == 4
    assert read.plates.time_s[0] == pytest.approx(1.52)
    _enter_inside_the_corners(read.plates)
    strikes = [e.time_s for e in read.events if e.label == "Foot Strike"]
    assert all(read.time_s[0] <= t <= read.time_s[-1] for t in strikes)


def _enter_inside_the_corners(plates: PlateForces) -> None:
    point, _, valid = plates.centres_of_pressure(50.0)
    for k, plate in enumerate(plates.plates):
        assert plate.corners is not None
        low, high = plate.corners.min(axis=0) - 0.02, plate.corners.max(axis=0) + 0.02
        there = point[valid[:, k], k]
        assert not len(there) or np.mean(np.all((there >= low) & (there <= high), axis=1)) > 0.98


def test_inspection_hints_at_the_body_mass(recordings_dir: Path) -> None:
    static = inspect_file(recordings_dir / "opencap_subject4" / "static1_grf.mot").to_dict()
    assert static["supported_mass_kg"] == 60.03
    walk = inspect_file(recordings_dir / "opencap_subject4" / "walking1.trc").to_dict()
    assert walk["unseen_frames"] == {"L_HJC": 1, "r_thigh3": 3, "r_thigh5": 121}
