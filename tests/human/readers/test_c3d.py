"""C3D files: markers, plates and events as put in; damage refused before the parser sees it."""

import random
from pathlib import Path

import numpy as np
import pytest

from human.readers.c3d import read_c3d
from human.readers.c3d_layout import check_layout
from human.readers.errors import (
    AmbiguousRecordingError,
    MalformedRecordingError,
    RecordingFileError,
    TruncatedRecordingError,
    UnsafeRecordingError,
)

from .making_c3d import FORCES, FRAMES, FREE, NAMES, POINTS, STANDING, write_c3d


def test_markers_in_metres(tmp_path: Path) -> None:
    read = read_c3d(write_c3d(tmp_path / "a.c3d"))
    assert read.marker_names == tuple(NAMES)
    assert (read.frames, read.rate_hz) == (FRAMES, 100.0)
    np.testing.assert_allclose(read.time_s, np.arange(FRAMES) / 100.0)
    np.testing.assert_allclose(read.position[3], STANDING / 1000.0, atol=1e-6)
    assert read.valid.all() and not read.report.findings
    assert read.report.channels == {"markers": 5, "analog": 12}


def test_plates_return_the_wrench_that_entered(tmp_path: Path) -> None:
    plates = read_c3d(write_c3d(tmp_path / "a.c3d")).plates
    assert plates is not None
    assert plates.force.shape == (4 * FRAMES, 2, 3)
    np.testing.assert_allclose(plates.time_s, np.arange(4 * FRAMES) / 400.0)
    np.testing.assert_allclose(plates.force[5], FORCES, atol=1e-4)
    point, free, valid = plates.centres_of_pressure()
    assert valid.all()
    np.testing.assert_allclose(point[5], POINTS, atol=1e-6)
    np.testing.assert_allclose(free[5], FREE, atol=1e-5)
    assert plates.supported_mass_kg() == pytest.approx(700.0 / 9.81, rel=1e-6)
    assert plates.plates[0].corners is not None
    np.testing.assert_allclose(plates.plates[0].origin, [0.3, -0.25, 0.0], atol=1e-7)


def test_y_up_files_are_turned_with_their_plates(tmp_path: Path) -> None:
    turned = np.repeat(STANDING[:, None, [0, 2, 1]] * [1, 1, -1], FRAMES, axis=1)
    path = write_c3d(tmp_path / "a.c3d", position=turned, up="+Y", plates=False)
    np.testing.assert_allclose(read_c3d(path).position[0], STANDING / 1000.0, atol=1e-6)
    path = write_c3d(tmp_path / "b.c3d", position=turned, up=None, plates=False)
    read = read_c3d(path)
    np.testing.assert_allclose(read.position[0], STANDING / 1000.0, atol=1e-6)
    assert "up is +y: along it the markers stand" in read.report.conversions


def test_an_axis_that_the_markers_contradict_is_reported(tmp_path: Path) -> None:
    read = read_c3d(write_c3d(tmp_path / "a.c3d", up="+Y", plates=False))
    assert [(f.code, f.severity) for f in read.report.findings] == [("up", "warning")]


def test_forces_that_point_down_are_reported(tmp_path: Path) -> None:
    read = read_c3d(write_c3d(tmp_path / "a.c3d"), up="-z")
    assert [f.code for f in read.report.findings] == ["plates"]


def test_unseen_markers_are_masked(tmp_path: Path) -> None:
    position = np.repeat(STANDING[:, None], FRAMES, axis=1)
    position[2, 1:3] = np.nan
    position[4, 5] = 0.0
    read = read_c3d(write_c3d(tmp_path / "a.c3d", position=position))
    assert read.missing() == {"RHip": 2, "Head": 1}
    assert np.all(read.position[~read.valid] == 0.0)


def test_events_count_minutes(tmp_path: Path) -> None:
    events = read_c3d(write_c3d(tmp_path / "a.c3d")).events
    assert [(e.label, e.context) for e in events] == [("Foot Strike", "Right"),
                                                      ("Foot Off", "Left")]  # fmt: skip
    np.testing.assert_allclose([e.time_s for e in events], [0.02, 62.5], atol=1e-5)


def test_what_cannot_be_told_is_asked_for(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "a.c3d", units="barleycorn", plates=False)
    with pytest.raises(AmbiguousRecordingError, match="barleycorn"):
        read_c3d(path)
    assert read_c3d(path, units="mm").position[0, 4, 2] == pytest.approx(1.7)
    lying = np.repeat(STANDING[:, None] + np.array([0, 0, 5000]), FRAMES, axis=1)
    path = write_c3d(tmp_path / "b.c3d", position=lying, up=None, plates=False)
    with pytest.raises(AmbiguousRecordingError, match="up='z'"):
        read_c3d(path)


def test_plates_of_other_types_give_no_forces_but_say_so(tmp_path: Path) -> None:
    read = read_c3d(write_c3d(tmp_path / "a.c3d", plate_type=9))
    assert read.plates is None
    assert [f.code for f in read.report.findings] == ["plates"]
    assert read.frames == FRAMES


def test_a_name_twice_is_refused(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "a.c3d", names=["RToe", "LToe", "RHip", "RHip", "Head"])
    with pytest.raises(MalformedRecordingError, match="RHip more than once"):
        read_c3d(path)


def test_every_cut_is_noticed(tmp_path: Path) -> None:
    whole = write_c3d(tmp_path / "a.c3d").read_bytes()
    assert check_layout(whole, "a").frames == FRAMES
    cut = tmp_path / "cut.c3d"
    for size in [0, 1, 511, 1024, len(whole) // 2, *range(1030, len(whole) - 512, 301)]:
        cut.write_bytes(whole[:size])
        with pytest.raises((TruncatedRecordingError, MalformedRecordingError)):
            read_c3d(cut)


def test_lengths_that_lie_are_refused(tmp_path: Path) -> None:
    whole = bytearray(write_c3d(tmp_path / "a.c3d").read_bytes())
    rate = whole.index(b"RATE")
    longer = whole.copy()
    longer[rate + 4] = 2  # the record ends before its content does
    with pytest.raises(UnsafeRecordingError, match="RATE"):
        check_layout(bytes(longer), "a")
    more = whole.copy()
    more[2] += 1
    with pytest.raises(MalformedRecordingError, match="POINT:USED"):
        check_layout(bytes(more), "a")
    late = whole.copy()
    late[8] = 200
    with pytest.raises(TruncatedRecordingError, match="cut off"):
        check_layout(bytes(late), "a")


def test_a_file_that_ends_the_parser_is_an_error_like_any_other(tmp_path: Path) -> None:
    whole = bytearray(write_c3d(tmp_path / "a.c3d").read_bytes())
    # More channels stated than the header has.
    whole[whole.index(b"USED", whole.index(b"ALOG\x03")) + len(b"USED") + 4] = 200
    path = tmp_path / "b.c3d"
    path.write_bytes(whole)
    check_layout(bytes(whole), "b")
    with pytest.raises(MalformedRecordingError, match=r"b\.c3d: expected a C3D file"):
        read_c3d(path)


def test_no_junk_passes_the_layout_with_another_error(tmp_path: Path) -> None:
    whole = write_c3d(tmp_path / "a.c3d").read_bytes()
    chance = random.Random(0)
    refused = 0
    for _ in range(400):
        junk = bytearray(whole)
        for _ in range(8):
            junk[chance.randrange(2560)] = chance.randrange(256)
        try:
            check_layout(bytes(junk), "a")
        except RecordingFileError:
            refused += 1
    assert refused > 40
