"""What is written comes back: the reader turns the axes the other way."""

from pathlib import Path

import numpy as np

from human.marker_recording import ForcePlate, MarkerRecording, PlateForces
from human.readers import read_markers, read_plates, write_plates, write_trc
from human.recording import ReadingReport


def test_markers_and_plates_come_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    standing = np.array([[0.1, -0.1, 0.0], [0.1, 0.1, 0.0], [0.0, -0.15, 0.9], [0.02, 0.1, 1.7]])
    position = standing + 0.01 * rng.normal(size=(6, 4, 3))
    valid = np.ones((6, 4), dtype=np.bool_)
    valid[2, 1] = valid[4, 3] = False
    position[~valid] = 0.0
    names = ("RToe", "LToe", "RHip", "Head")
    time_s = 3.0 + np.arange(6) / 100.0
    written = MarkerRecording(
        "a.trc", "trc", "4", time_s, 100.0, names, position, valid, (), None, ReadingReport(), ""
    )
    write_trc(tmp_path / "a.trc", written)
    read = read_markers(tmp_path / "a.trc")
    assert (read.marker_names, read.rate_hz, read.report.findings) == (names, 100.0, ())
    np.testing.assert_array_equal(read.valid, valid)
    np.testing.assert_allclose(read.position, position, atol=1e-7)
    np.testing.assert_allclose(read.time_s, time_s, atol=1e-9)

    plate = ForcePlate("1", np.array([0.3, -0.2, -0.04]), 0.0)
    force = np.array([10.0, -5.0, 400.0]) + rng.normal(size=(6, 1, 3))
    force[3] = 0.0
    moment = np.where(force == 0.0, 0.0, rng.normal(size=(6, 1, 3)))
    there = PlateForces(time_s, (plate,), force, moment, ReadingReport())
    write_plates(tmp_path / "a.mot", there)
    back = read_plates(tmp_path / "a.mot")
    np.testing.assert_allclose(back.force, force, atol=1e-6)
    about_origin = moment + np.cross(plate.origin, force)
    np.testing.assert_allclose(back.moment, about_origin, atol=1e-3)
