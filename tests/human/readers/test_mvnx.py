"""MVNX of both versions, written from one known motion, gives that motion back."""

import re
from pathlib import Path

import numpy as np
import pytest

from human.readers import AmbiguousRecordingError, MalformedRecordingError, read_recording

from .making import walker, write_mvnx
from .test_bvh import orientation_error_deg


@pytest.mark.parametrize("version", [3, 4])
def test_both_versions_give_the_motion_back(tmp_path: Path, version: int) -> None:
    model, motion = walker()
    write_mvnx(tmp_path / "a.mvnx", model, motion, version=version, digits=9)
    recording = read_recording(tmp_path / "a.mvnx")
    assert recording.frames == len(motion.time_s)  # reference poses are not motion
    assert orientation_error_deg(recording, model, motion) < 1e-5
    np.testing.assert_allclose(recording.position[:, 0], motion.q[:, :3], atol=1e-8)
    np.testing.assert_allclose(recording.joint_offset["LeftToe"], model.offsets[21], atol=1e-8)
    turned = any("hanging arms" in step for step in recording.report.conversions)
    assert turned == (version == 3)
    assert ("jRightT4Shoulder" in recording.report.aliases) == (version == 4)


def test_arm_axes_are_told_by_the_positions_not_by_the_version(tmp_path: Path) -> None:
    model, motion = walker()
    text = write_mvnx(tmp_path / "a.mvnx", model, motion, version=3)
    (tmp_path / "b.mvnx").write_text(text.replace('version="3"', 'version="4"'))
    assert orientation_error_deg(read_recording(tmp_path / "b.mvnx"), model, motion) < 1e-3


def test_times_come_from_the_index_where_milliseconds_are_rounded(tmp_path: Path) -> None:
    model, motion = walker(rate_hz=240.0)
    write_mvnx(tmp_path / "a.mvnx", model, motion)
    recording = read_recording(tmp_path / "a.mvnx")
    np.testing.assert_allclose(recording.time_s, np.arange(40) / 240.0, rtol=0, atol=1e-12)


def test_stated_times_win_where_the_index_does_not_explain_them(tmp_path: Path) -> None:
    model, motion = walker()
    text = write_mvnx(tmp_path / "a.mvnx", model, motion)
    (tmp_path / "a.mvnx").write_text(text.replace('time="650" index="39"', 'time="690" index="39"'))
    assert read_recording(tmp_path / "a.mvnx").time_s[-1] == pytest.approx(0.690)


def test_missing_frames_are_reported_as_a_gap(tmp_path: Path) -> None:
    model, motion = walker()
    text = write_mvnx(tmp_path / "a.mvnx", model, motion)
    lines = [line for line in text.splitlines() if not re.search(r' index="2[012]"', line)]
    (tmp_path / "a.mvnx").write_text("\n".join(lines))
    (gap,) = read_recording(tmp_path / "a.mvnx").report.gaps
    assert gap.missing_frames == 3
    assert (gap.start_s, gap.end_s) == pytest.approx((19 / 60, 23 / 60))


def test_limbs_without_sensors_are_unmeasured_not_measured(tmp_path: Path) -> None:
    model, motion = walker()
    upper_body = ("Pelvis", "T8", "Head", "RightShoulder", "RightUpperArm", "RightForeArm",
                  "RightHand", "LeftShoulder", "LeftUpperArm", "LeftForeArm",
                  "LeftHand")  # fmt: skip
    write_mvnx(tmp_path / "a.mvnx", model, motion, sensors=upper_body)
    status = read_recording(tmp_path / "a.mvnx").segment_status
    assert status["T8"] == "measured"
    assert status["L3"] == status["Neck"] == "interpolated"
    assert {status[s] for s in status if "Leg" in s or "Foot" in s or "Toe" in s} == {"unmeasured"}


def test_props_and_other_extra_segments_are_left_aside(tmp_path: Path) -> None:
    model, motion = walker()
    text = write_mvnx(tmp_path / "a.mvnx", model, motion)
    text = text.replace(
        "</segments>", '<segment label="Prop1" id="24"><points/></segment></segments>'
    )
    text = text.replace("</orientation>", " 1 0 0 0</orientation>")
    text = text.replace("</position>", " 0 0 0</position>")
    (tmp_path / "a.mvnx").write_text(text)
    assert orientation_error_deg(read_recording(tmp_path / "a.mvnx"), model, motion) < 1e-3


def test_what_the_format_fixes_cannot_be_overridden(tmp_path: Path) -> None:
    write_mvnx(tmp_path / "a.mvnx", *walker())
    with pytest.raises(AmbiguousRecordingError, match="'m', which MVNX fixes"):
        read_recording(tmp_path / "a.mvnx", units="cm")


def test_a_file_in_millimetres_is_refused(tmp_path: Path) -> None:
    model, motion = walker()
    text = write_mvnx(tmp_path / "a.mvnx", model, motion)
    grown = re.sub(
        r"<pos_b>([^<]*)</pos_b>",
        lambda m: "<pos_b>" + " ".join(str(1000 * float(v)) for v in m[1].split()) + "</pos_b>",
        text,
    )
    (tmp_path / "a.mvnx").write_text(grown)
    with pytest.raises(MalformedRecordingError, match=r"MVNX is in metres.*got 1\d\d\d"):
        read_recording(tmp_path / "a.mvnx")
