"""CSV and .mat files mean what their column map says, in house units and axes."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.io import savemat

from human import RecordingError, Subject, forward_kinematics, generate_model
from human.readers import (
    MalformedRecordingError,
    RecordingFileError,
    UnknownFormatError,
    inspect_file,
    read_markers,
    read_plates,
    read_table,
)

RATE = 50.0
FRAMES = 60
TIME = np.arange(FRAMES) / RATE
ANGLE = 0.4 * np.sin(2.0 * TIME)
RATE_OF_ANGLE = 0.8 * np.cos(2.0 * TIME)
#: Two markers of someone standing 1.5 m tall along y, x forward, z to the right; m.
MARKERS = np.stack([np.stack([TIME, 0 * TIME, 0 * TIME], 1),
                    np.stack([TIME, 1.5 + 0 * TIME, 0.2 + 0 * TIME], 1)], 1)  # fmt: skip
FORCE = np.tile([10.0, 600.0, -5.0], (FRAMES, 1))
POINT = np.tile([0.3, 0.0, 0.1], (FRAMES, 1))
TORQUE = np.tile([0.0, 2.0, 0.0], (FRAMES, 1))

UNITS = {"length": "mm", "angle": "deg", "force": "N", "moment": "N mm"}
MAP: dict[str, Any] = {
    "time": "t", "time_unit": "ms", "up": "y", "units": UNITS,
    "markers": "{name}_{axis}",
    "joints": {"jRightKnee_roty": {"position": "-knee", "velocity": "-knee_rate"}},
    "plates": {"left": {"force": ["fx", "fy", "fz"], "moment": ["mx", "my", "mz"],
                        "point": ["px", "py", "pz"]}},
}  # fmt: skip


def table() -> dict[str, NDArray[np.float64]]:
    out = {"t": 1e3 * TIME, "knee": -np.rad2deg(ANGLE), "knee_rate": -np.rad2deg(RATE_OF_ANGLE)}
    for k, name in enumerate(("heel", "head")):
        out |= {f"{name}_{axis}": 1e3 * MARKERS[:, k, i] for i, axis in enumerate("xyz")}
    for kind, values in (("f", FORCE), ("p", 1e3 * POINT), ("m", 1e3 * TORQUE)):
        out |= {kind + axis: values[:, i] for i, axis in enumerate("xyz")}
    return out


def write_csv(path: Path, columns: dict[str, NDArray[np.float64]], mark: str = ",") -> Path:
    rows = ["note" + mark + mark.join(columns)]
    for values in zip(*columns.values(), strict=True):
        cells = ["" if np.isnan(x) else repr(float(x)) for x in values]
        rows.append("free text" + mark + mark.join(cells))
    path.write_text("\n".join(rows) + "\n")
    return path


def write_map(path: Path, **changes: object) -> Path:
    content = {k: v for k, v in {**MAP, **changes}.items() if v is not None}
    path.write_text(json.dumps(content))
    return path


def as_v5(path: Path) -> Path:
    savemat(path, {"log": dict(table())}, do_compression=True)
    return path


def as_v73(path: Path) -> Path:
    with h5py.File(path, "w", userblock_size=512) as out:
        for name, values in table().items():
            # A MATLAB column of n x 1 x time is stored in reverse order.
            out[f"log/{name}"] = values[:, None, None]
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file")
    return path


def as_csv(path: Path) -> Path:
    return write_csv(path, {f"log.{name}": values for name, values in table().items()})


def prefixed(value: object) -> object:
    """The map with every column inside the struct ``log``."""
    if isinstance(value, dict):
        return {k: prefixed(v) for k, v in value.items()}
    if isinstance(value, list):
        return [prefixed(v) for v in value]
    text = str(value)
    return f"-log.{text[1:]}" if text.startswith("-") else f"log.{text}"


@pytest.mark.parametrize("write", [as_csv, as_v5, as_v73])
def test_every_format_gives_the_same_records(tmp_path: Path, write: Any) -> None:
    named = {key: prefixed(MAP[key]) for key in ("time", "markers", "joints", "plates")}
    read = read_table(write(tmp_path / "odd.name"), write_map(tmp_path / "map.json", **named))
    assert read.markers is not None and read.plates is not None and read.joints is not None
    at = [read.markers.marker_names.index(name) for name in ("heel", "head")]
    assert read.markers.rate_hz == RATE
    np.testing.assert_allclose(read.markers.time_s, TIME, atol=1e-12)
    # y up, z to the right becomes z up, y to the left.
    np.testing.assert_allclose(
        read.markers.position[:, at], MARKERS[..., [0, 2, 1]] * [1, -1, 1], atol=1e-12
    )
    point, free, valid = read.plates.centres_of_pressure()
    assert valid.all()
    np.testing.assert_allclose(point[:, 0], [[0.3, -0.1, 0.0]] * FRAMES, atol=1e-12)
    np.testing.assert_allclose(free, 2.0, atol=1e-12)
    assert read.joints.joint_names == ("jRightKnee_roty",)
    np.testing.assert_allclose(read.joints.position[:, 0], ANGLE, atol=1e-12)
    np.testing.assert_allclose(read.joints.velocity[:, 0], RATE_OF_ANGLE, atol=1e-12)
    assert not read.joints.report.findings


def test_a_joint_log_becomes_a_motion_that_says_what_it_assumed(tmp_path: Path) -> None:
    changes = {"markers": None, "plates": None}
    log = read_table(write_csv(tmp_path / "a.csv", table()),
                     write_map(tmp_path / "m.json", **changes)).joints  # fmt: skip
    assert log is not None
    model = generate_model(Subject(1.7, 70.0))
    motion = log.to_motion(model)
    at = model.dof_names.index("jRightKnee_roty")
    np.testing.assert_allclose(motion.joint_angles[:, at], ANGLE, atol=1e-12)
    np.testing.assert_allclose(motion.joint_rates[:, at], RATE_OF_ANGLE, atol=1e-12)
    # Derived: the second derivative of the angle, to what a cubic over 0.2 s keeps of it.
    np.testing.assert_allclose(motion.a[5:-5, 6 + at], -4.0 * ANGLE[5:-5], atol=0.02)
    assert np.count_nonzero(np.any(motion.joint_angles != 0.0, axis=0)) == 1
    assert set(motion.provenance.assumed) == {"joints", "base"} and motion.base == "fixed"


def test_who_stands_on_the_floor_needs_no_base(tmp_path: Path) -> None:
    joints = {
        "jRightKnee_roty": "-knee", "jLeftKnee_roty": "-knee", "jRightAnkle_roty": "knee",
        "jLeftAnkle_roty": "knee", "jRightShoulder_rotx": 90,
    }  # fmt: skip
    standing = {"segment": "RightFoot", "position": [0.2, -0.1, 0.07]}
    changes = {"markers": None, "plates": None, "joints": joints, "standing_on": standing}
    path = write_csv(tmp_path / "a.csv", table())
    log = read_table(path, write_map(tmp_path / "m.json", **changes)).joints
    assert log is not None
    model = generate_model(Subject(1.7, 70.0))
    motion = log.to_motion(model)
    poses = forward_kinematics(model, motion.q)
    level, at = poses.of("RightFoot")
    np.testing.assert_allclose(at, np.tile([0.2, -0.1, 0.07], (FRAMES, 1)), atol=1e-12)
    np.testing.assert_allclose(level, np.tile(np.eye(3), (FRAMES, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(poses.of("LeftFoot")[1][:, [0, 2]], at[:, [0, 2]], atol=1e-12)
    # The arm hangs down: the hand is straight below the shoulder.
    arm = poses.of("RightHand")[1] - poses.of("RightUpperArm")[1]
    upper = poses.of("T8")[0]
    np.testing.assert_allclose((arm[:, None] @ upper)[:, 0, :2], 0.0, atol=1e-12)
    assert motion.base == "measured" and set(motion.provenance.assumed) == {
        "joints",
        "kept",
        "base",
    }


def test_a_wrong_rate_shows_in_the_velocities(tmp_path: Path) -> None:
    map_file = write_map(tmp_path / "m.json", time=None, rate_hz=2 * RATE, markers=None)
    log = read_table(write_csv(tmp_path / "a.csv", table()), map_file).joints
    assert log is not None
    assert [f.code for f in log.report.findings] == ["rates"]
    assert "0.5 times" in log.report.findings[0].message


def test_matrices_wrenches_and_accelerometers_of_a_log(tmp_path: Path) -> None:
    q = np.stack([ANGLE, 2 * ANGLE])
    wrench = np.concatenate([FORCE, TORQUE], axis=1).T
    savemat(tmp_path / "log.mat", {"joints": {"q": q}, "sensors": {"acc": MARKERS[:, 1].T,
                                                                  "fts": wrench}})  # fmt: skip
    content = {
        "rate_hz": RATE,
        "units": {"angle": "rad", "force": "N", "moment": "N m", "acceleration": "g"},
        "joints": {"ankle": "joints.q[1]", "hip": "joints.q[2]"},
        "accelerometers": {"chest": {"columns": "sensors.acc", "frame": "imu"}},
        "wrenches": {"plate": {"force": [f"sensors.fts[{k}]" for k in (1, 2, 3)],
                               "moment": [f"-sensors.fts[{k}]" for k in (4, 5, 6)],
                               "frame": "foot"}},
    }  # fmt: skip
    (tmp_path / "m.json").write_text(json.dumps(content))
    log = read_table(tmp_path / "log.mat", tmp_path / "m.json").joints
    assert log is not None
    np.testing.assert_allclose(log.position, q.T)
    np.testing.assert_allclose(log.accelerometers["chest"].values, 9.80665 * MARKERS[:, 1])
    assert log.wrenches["plate"].frame == "foot"
    np.testing.assert_allclose(log.wrenches["plate"].values, np.hstack([FORCE, -TORQUE]))
    with pytest.raises(
        RecordingError, match=r"degrees of freedom of the model such as.*got ankle, hip"
    ):
        log.to_motion(generate_model(Subject(1.7, 70.0)))
    inspected = inspect_file(tmp_path / "log.mat")
    assert inspected.frames is None
    assert (inspected.format, inspected.columns) == (
        "mat", ["joints.q", "sensors.acc", "sensors.fts"],
    )  # fmt: skip


def test_gaps_of_markers_and_decimal_commas(tmp_path: Path) -> None:
    columns = table()
    columns["head_y"][3] = np.nan
    text = write_csv(tmp_path / "a.csv", columns, ";").read_text()
    (tmp_path / "a.csv").write_text("made by hand\n" + text.replace(".", ","))
    changes = {"decimal": ",", "header_line": 2, "plates": None, "joints": None}
    read = read_table(tmp_path / "a.csv", write_map(tmp_path / "m.json", **changes))
    assert read.markers is not None and read.joints is None
    assert read.markers.missing() == {"head": 1}
    np.testing.assert_allclose(read.markers.position[4, 1], [TIME[4], -0.2, 1.5], atol=1e-12)


@pytest.mark.parametrize(
    ("changes", "columns", "message"),
    [
        ({"units": {"length": "mm"}}, {}, "units: expected .force.: one of N, kN, got nothing"),
        ({"units": {"length": "feet"}}, {}, "units, length: expected one of m, cm"),
        ({"up": None, "markers": None}, {}, "up: expected the vertical axis"),
        ({"rate_hz": 5}, {}, "either the time's column or rate_hz"),
        ({"markers": "{name}"}, {}, "a pattern with {name} and {axis}"),
        ({"markers": "{name}/{axis}"}, {}, "columns that fit"),
        ({"joints": {"knee": "elbow"}}, {}, "column 'elbow' once"),
        ({"joints": {"knee": {"velocity": "knee"}}}, {}, "a column for the position"),
        ({"joints": {"knee": 1}, "markers": None, "plates": None}, {}, "markers, joints, plates"),
        ({"base": {}, "standing_on": {}}, {}, "either it or the base|base, position"),
        ({"marker": {}}, {}, "keys among time.*got 'marker'"),
        ({}, {"t": TIME[::-1].copy()}, "times that increase"),
        ({}, {"knee": np.full(FRAMES, np.nan)}, "frame 0.*finite numbers"),
        ({}, {"px": np.full(FRAMES, np.nan)}, "a point wherever there is a force"),
        ({"delimiter": ";", "markers": None}, {}, "column 't' once"),
        ({"joints": {"knee": "note"}, "markers": None}, {}, "column note: expected a number"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(
    tmp_path: Path, changes: dict[str, Any], columns: dict[str, Any], message: str
) -> None:
    path = write_csv(tmp_path / "a.csv", table() | columns)
    with pytest.raises(RecordingFileError, match=message):
        read_table(path, write_map(tmp_path / "m.json", **changes))


def test_markers_and_plates_may_stand_in_files_of_their_own(tmp_path: Path) -> None:
    columns = table()
    forces = {kind + axis for kind in "fmp" for axis in "xyz"}
    one_map = tmp_path / "map.json"
    one_map.write_text(json.dumps(MAP))
    whole = write_csv(tmp_path / "all.csv", columns)
    seen = write_csv(
        tmp_path / "seen.csv", {k: v for k, v in columns.items() if k not in forces - {"t"}}
    )
    felt = write_csv(tmp_path / "felt.csv", {k: columns[k] for k in ("t", *forces)})
    markers = read_markers(seen, one_map, plates_apart=True)
    assert np.array_equal(markers.position, read_markers(whole, one_map).position)
    assert markers.plates is None
    apart, together = read_plates(felt, one_map), read_plates(whole, one_map)
    assert np.array_equal(apart.force, together.force)
    assert np.array_equal(apart.moment, together.moment)
    # Only where they are said to be elsewhere: a column that is written wrongly is still named.
    with pytest.raises(MalformedRecordingError, match="'fx' once"):
        read_markers(seen, one_map)
    one_map.write_text(json.dumps({k: v for k, v in MAP.items() if k != "plates"}))
    with pytest.raises(MalformedRecordingError, match=r"map\.json.*plates.*none"):
        read_plates(felt, one_map)


def test_damaged_files_and_other_formats(tmp_path: Path) -> None:
    good = as_v5(tmp_path / "a.mat").read_bytes()
    map_file = write_map(tmp_path / "m.json")
    (tmp_path / "cut.mat").write_bytes(good[: len(good) // 2])
    with pytest.raises(MalformedRecordingError, match=r"cut\.mat"):
        read_table(tmp_path / "cut.mat", map_file)
    with pytest.raises(MalformedRecordingError, match=r"array 't'.*log"):
        read_table(tmp_path / "a.mat", map_file)
    (tmp_path / "b.json").write_text('{"time": "t"')
    with pytest.raises(MalformedRecordingError, match="JSON"):
        read_table(tmp_path / "a.mat", tmp_path / "b.json")
    with pytest.raises(UnknownFormatError, match=r"CSV or \.mat"):
        read_table(map_file, map_file)
    with pytest.raises(RecordingFileError, match="no such file"):
        read_table(tmp_path / "none.csv", map_file)


#: As Motive 3 writes it; older versions have no words in the second column.
MOTIVE = """Format Version,1.24,Take Name,a,Capture Frame Rate,50,Length Units,{unit}

,Type,Bone,Bone,Bone,Marker,Marker,Marker,Marker,Marker,Marker,Marker,Marker,Marker
,Name,Box,Box,Box,S:Heel,S:Heel,S:Heel,S:Head,S:Head,S:Head,{last},{last},{last}
,ID,"1","1","1","2","2","2","3","3","3","4","4","4"
,Parent,,,,S,S,S,S,S,S,,,
,,Position,Position,Position,Position,Position,Position,Position,Position,Position{more}
Frame,Time (Seconds),X,Y,Z,X,Y,Z,X,Y,Z,X,Y,Z
"""


def motive(path: Path, unit: str = "Millimeters", last: str = "Unlabeled 1189", old: str = "",
           new: str = "") -> Path:  # fmt: skip
    rows = [f"{k},{t},9,9,9,0,0,0,{t},1500,200,,," for k, t in enumerate(TIME)]
    rows[2] = rows[2].replace("1500", "")
    head = MOTIVE.format(unit=unit, last=last, more=3 * ",Position").replace(old, new)
    path.write_text(head + "\n".join(rows))
    return path


@pytest.mark.parametrize(
    ("old", "new"),
    [("", ""), (",Type,", ",,"), (",Parent,,,,S,S,S,S,S,S,,,\n", "")],
)
def test_motive_needs_no_map(tmp_path: Path, old: str, new: str) -> None:
    found = inspect_file(motive(tmp_path / "a.csv", old=old, new=new))
    assert (found.format, found.markers, found.rate_hz) == ("motive-csv", ["S:Heel", "S:Head"], 50)
    # Heel at the very origin is a place like any other; an empty cell is a gap.
    assert found.unseen_frames == {"S:Head": 1}
    assert found.conversions[1] == "up is y by convention"
    assert "unlabelled" in [note.code for note in found.notes]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"unit": "Parsec"}, "Length Units"),
        ({"old": ",Marker", "new": ",Bone"}, "labelled markers"),
        ({"last": "S:Head"}, "S:Head more than once"),
        ({"old": "Frame,", "new": "Fame,"}, "as Motive writes them"),
    ],
)
def test_what_motive_does_not_write_is_refused(
    tmp_path: Path, changes: dict[str, str], message: str
) -> None:
    with pytest.raises(RecordingFileError, match=message):
        inspect_file(motive(tmp_path / "a.csv", **changes))
