"""Files of markers and forces are inspected by content; `read_recording` still refuses them."""

import json
from pathlib import Path

import numpy as np
import pytest

from human.readers import UnknownFormatError, read_recording, write_bvh
from human.readers.errors import RecordingFileError
from human.readers.inspect_markers import inspect_file

from .making import walker
from .making_c3d import FRAMES, NAMES, write_c3d
from .test_opensim_table import FORCE, POINT, SPELLINGS, TORQUE, mot, plate
from .test_trc import trc


def test_c3d(tmp_path: Path) -> None:
    path = write_c3d(tmp_path / "a.c3d").rename(tmp_path / "odd.name")
    found = json.loads(json.dumps(inspect_file(path).to_dict()))
    assert (found["format"], found["frames"], found["rate_hz"]) == ("c3d", FRAMES, 100.0)
    assert (found["markers"], found["unseen_frames"]) == (NAMES, {})
    assert (found["plates"], found["plate_rate_hz"]) == (["1", "2"], 400.0)
    assert found["supported_mass_kg"] == pytest.approx(700.0 / 9.81, abs=0.01)
    assert [event["label"] for event in found["events"]] == ["Foot Strike", "Foot Off"]
    assert found["problems"] == [] and len(found["sha256"]) == 64
    with pytest.raises(UnknownFormatError, match="C3D"):
        read_recording(path)


def test_trc(tmp_path: Path) -> None:
    found = inspect_file(trc(tmp_path / "a.trc")).to_dict()
    assert (found["format"], found["frames"], found["plates"]) == ("trc", 5, [])
    assert found["supported_mass_kg"] is None
    assert found["duration_s"] == pytest.approx(0.04)


def test_the_marker_set_and_what_it_lacks_are_said(tmp_path: Path) -> None:
    names = "LASI RASI LPSI RPSI LKNE RKNE LANK RANK LHEE box".split()
    position = np.random.default_rng(1).uniform(1.0, 900.0, (len(names), FRAMES, 3))
    found = inspect_file(write_c3d(tmp_path / "a.c3d", names=names, position=position)).to_dict()
    assert found["marker_set"] == "cgm"
    (said,) = (note["message"] for note in found["notes"] if note["code"] == "marker-set")
    assert "RHEE" in said and "Not in the set: box." in said
    found = inspect_file(write_c3d(tmp_path / "b.c3d")).to_dict()
    assert found["marker_set"] is None
    assert "mapping file" in next(n["message"] for n in found["notes"] if n["code"] == "marker-set")


def test_tables_with_and_without_plates(tmp_path: Path) -> None:
    rows = [FORCE + POINT + TORQUE] * 3
    found = inspect_file(plate(tmp_path / "a.mot", SPELLINGS[0], rows)).to_dict()
    assert (found["format"], found["plates"]) == ("opensim-table", ["1"])
    assert found["supported_mass_kg"] == pytest.approx(600.0 / 9.81, abs=0.01)
    found = inspect_file(mot(tmp_path / "b.sto", ["knee", "hip"], [[1, 2]] * 3)).to_dict()
    assert (found["columns"], found["plates"]) == (["knee", "hip"], [])
    assert found["rate_hz"] == pytest.approx(100.0)


def test_motions_and_what_is_neither(tmp_path: Path) -> None:
    write_bvh(tmp_path / "b.bvh", *walker())
    assert inspect_file(tmp_path / "b.bvh").format == "bvh"
    with pytest.raises(RecordingFileError, match="no such file"):
        inspect_file(tmp_path / "none.c3d")
    (tmp_path / "c.c3d").write_bytes(b"\x02\x50\x00\x00\x01")
    with pytest.raises(RecordingFileError, match="1024 bytes"):
        inspect_file(tmp_path / "c.c3d")
