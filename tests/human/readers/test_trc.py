"""TRC files as programs write them, ragged and with markers lost."""

from pathlib import Path

import numpy as np
import pytest

from human.readers.errors import (
    AmbiguousRecordingError,
    MalformedRecordingError,
    TruncatedRecordingError,
)
from human.readers.trc import read_trc

#: Four markers of someone standing, in y-up axes (x forward, z right), m.
STANDING = np.array([[0.1, 0.0, 0.1], [0.1, 0.0, -0.1], [0.0, 1.0, 0.15], [0.02, 1.7, -0.1]])


def trc(path: Path, units: str = "m", scale: float = 1.0, rows: list[str] | None = None) -> Path:
    names = "\t\t\t".join(["RToe", "LToe", "RHip", "LHead"])
    cells = "\t".join(f"{scale * v:.6f}" for v in STANDING.ravel())
    rows = rows or [f"{k + 1}\t{k / 100:.3f}\t{cells}" for k in range(5)]
    head = [
        "PathFileType\t4\t(X/Y/Z)\ta.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
        f"100\t100\t{len(rows)}\t4\t{units}",
        f"Frame#\tTime\t{names}",
        "\t\tX1\tY1\tZ1",
        "",
    ]
    path.write_text("\n".join(head + rows) + "\n")
    return path


@pytest.mark.parametrize(("units", "scale"), [("m", 1.0), ("mm", 1000.0), ("cm", 100.0)])
def test_positions_in_metres_and_z_up(tmp_path: Path, units: str, scale: float) -> None:
    read = read_trc(trc(tmp_path / "a.trc", units, scale))
    assert read.marker_names == ("RToe", "LToe", "RHip", "LHead")
    assert read.rate_hz == 100.0
    expected = np.stack([STANDING[:, 0], -STANDING[:, 2], STANDING[:, 1]], axis=-1)
    np.testing.assert_allclose(read.position, np.broadcast_to(expected, (5, 4, 3)), atol=1e-6)
    assert "up is +y: along it the markers stand" in read.report.conversions
    assert read.valid.all() and not read.report.findings


def test_lost_markers_are_masked_not_nan(tmp_path: Path) -> None:
    full = "1\t0.00\t" + "\t".join(f"{v}" for v in STANDING.ravel())
    short = "2\t0.01\t" + "\t".join(f"{v}" for v in STANDING[:3].ravel())
    holed = "3\t0.02\t\t\t\t" + "\t".join(f"{v}" for v in STANDING[1:].ravel()) + "\t\t"
    read = read_trc(trc(tmp_path / "a.trc", rows=[full, short, holed]))
    assert read.missing() == {"RToe": 1, "LHead": 1}
    assert np.all(read.position[~read.valid] == 0.0)
    np.testing.assert_allclose(read.position[2, 1:], read.position[0, 1:])


def test_requested_axis_wins_and_counts_are_compared(tmp_path: Path) -> None:
    path = trc(tmp_path / "a.trc")
    path.write_text(path.read_text().replace("100\t100\t5\t4", "100\t100\t9\t4"))
    read = read_trc(path, up="z")
    np.testing.assert_allclose(read.position[0], STANDING)
    assert [f.code for f in read.report.findings] == ["header"]


def test_a_lying_person_gets_the_convention_with_a_warning(tmp_path: Path) -> None:
    lying = "1\t0\t" + "\t".join(f"{v}" for v in (STANDING[:, [1, 0, 2]] + [5, 0, 0]).ravel())
    read = read_trc(trc(tmp_path / "a.trc", rows=[lying]))
    assert [(f.code, f.severity) for f in read.report.findings] == [("up", "warning")]


@pytest.mark.parametrize(
    ("old", "new", "error", "place"),
    [
        ("\tm\n", "\tfurlong\n", AmbiguousRecordingError, "units of length"),
        ("Frame#", "Bild", MalformedRecordingError, "line 4"),
        ("LToe", "RToe", MalformedRecordingError, "line 4"),
        ("3\t0.020", "3\t0.005", MalformedRecordingError, "frame 2"),
        ("3\t0.020", "3\tsoon", MalformedRecordingError, "line 9"),
        ("2\t0.010", "2\t0.010\t1\t1\t1", MalformedRecordingError, "line 8"),
    ],
)
def test_damage_is_named(
    tmp_path: Path, old: str, new: str, error: type[Exception], place: str
) -> None:
    path = trc(tmp_path / "a.trc")
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(error, match=place):
        read_trc(path)


def test_an_end_too_soon(tmp_path: Path) -> None:
    path = trc(tmp_path / "a.trc")
    path.write_text("\n".join(path.read_text().splitlines()[:6]))
    with pytest.raises(TruncatedRecordingError):
        read_trc(path)
