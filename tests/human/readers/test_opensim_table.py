"""MOT and STO tables, and force plates by the names of their columns."""

from pathlib import Path

import numpy as np
import pytest

from human.readers.errors import MalformedRecordingError, TruncatedRecordingError
from human.readers.opensim_table import plate_forces, read_opensim_table

#: Spellings in use: of force, point and torque of one plate.
SPELLINGS = [
    ("ground_force_1_v", "ground_force_1_p", "ground_force_1_m"),
    ("1_ground_force_v", "1_ground_force_p", "1_ground_torque_"),
    ("ground_force_v", "ground_force_p", "ground_torque_"),
    ("ground_force_r_v", "ground_force_r_p", "ground_moment_r_m"),
]
FORCE, POINT, TORQUE = [30.0, 600.0, -20.0], [0.4, 0.0, 0.25], [0.0, 5.0, 0.0]


def mot(path: Path, columns: list[str], rows: list[list[float]], head: str = "") -> Path:
    lines = ["made", "version=1", f"nRows={len(rows)}", "inDegrees=yes", head, "endheader"]
    lines.append("\t".join(["time", *columns]))
    lines += ["\t".join(f"{v:.9g}" for v in [0.01 * k, *row]) for k, row in enumerate(rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def plate(path: Path, spelling: tuple[str, str, str], rows: list[list[float]]) -> Path:
    return mot(path, [part + axis for part in spelling for axis in "xyz"], rows)


def test_table_as_it_stands(tmp_path: Path) -> None:
    table = read_opensim_table(mot(tmp_path / "a.mot", ["knee", "hip"], [[1, 2], [3, 4]]))
    assert table.in_degrees is True
    assert table.columns == ("knee", "hip")
    np.testing.assert_array_equal(table.values, [[1, 2], [3, 4]])
    np.testing.assert_allclose(table.time_s, [0.0, 0.01])


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_point_and_torque_come_back_in_z_up_axes(
    tmp_path: Path, spelling: tuple[str, str, str]
) -> None:
    path = plate(tmp_path / "a.mot", spelling, [FORCE + POINT + TORQUE] * 3)
    forces = plate_forces(read_opensim_table(path))
    np.testing.assert_allclose(forces.force[0, 0], [30.0, 20.0, 600.0])
    point, free, valid = forces.centres_of_pressure()
    assert valid.all()
    np.testing.assert_allclose(point[:, 0], [[0.4, -0.25, 0.0]] * 3, atol=1e-12)
    np.testing.assert_allclose(free, 5.0)
    assert forces.supported_mass_kg() == pytest.approx(600.0 / 9.81)


def test_moment_is_about_the_origin(tmp_path: Path) -> None:
    path = plate(tmp_path / "a.mot", SPELLINGS[0], [FORCE + POINT + TORQUE] * 2)
    forces = plate_forces(read_opensim_table(path))
    about = np.add(np.cross([0.4, -0.25, 0.0], [30.0, 20.0, 600.0]), [0.0, 0.0, 5.0])
    np.testing.assert_allclose(forces.moment[1, 0], about)


def test_no_point_where_nothing_presses(tmp_path: Path) -> None:
    nan = float("nan")
    idle = [0.0, 0.0, 0.0, nan, nan, nan, 0.0, 0.0, 0.0]
    path = plate(tmp_path / "a.mot", SPELLINGS[0], [idle, FORCE + POINT + TORQUE])
    forces = plate_forces(read_opensim_table(path))
    assert forces.centres_of_pressure()[2].tolist() == [[False], [True]]
    lost = [1.0, 300.0, 0.0, nan, 0.0, 0.0, 0.0, 0.0, 0.0]
    path = plate(tmp_path / "b.mot", SPELLINGS[0], [FORCE + POINT + TORQUE, lost])
    with pytest.raises(MalformedRecordingError, match="row 1: expected a finite point"):
        plate_forces(read_opensim_table(path))


def test_plates_that_are_idle_or_incomplete(tmp_path: Path) -> None:
    path = plate(tmp_path / "a.mot", SPELLINGS[0], [[0.0] * 9] * 2)
    forces = plate_forces(read_opensim_table(path))
    assert forces.supported_mass_kg() is None
    assert [f.code for f in forces.report.findings] == ["idle-plate"]
    path = mot(tmp_path / "b.mot", ["ground_force_1_vx"], [[1.0]] * 2)
    with pytest.raises(MalformedRecordingError, match="no vy, vz"):
        plate_forces(read_opensim_table(path))
    path = mot(tmp_path / "c.mot", ["knee"], [[1.0]] * 2)
    with pytest.raises(MalformedRecordingError, match="ground_force_1_vx"):
        plate_forces(read_opensim_table(path))


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ("endheader", "", TruncatedRecordingError),
        ("nRows=3", "nRows=4", TruncatedRecordingError),
        ("time\t", "when\t", MalformedRecordingError),
        ("hip", "knee", MalformedRecordingError),
        ("0.01\t", "", MalformedRecordingError),
        ("0.01\t", "0\t", MalformedRecordingError),
        ("0.01\t", "much\t", MalformedRecordingError),
    ],
)
def test_damage_is_refused(tmp_path: Path, old: str, new: str, error: type[Exception]) -> None:
    path = mot(tmp_path / "a.mot", ["knee", "hip"], [[1, 2], [3, 4], [5, 6]])
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(error):
        read_opensim_table(path)
