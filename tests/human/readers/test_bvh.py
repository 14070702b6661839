"""BVH of several makes, written from one known motion, gives that motion back."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from human.differentiate import motion_from_configurations
from human.kinematics import forward_kinematics
from human.names import SEGMENTS
from human.pose import fit_recording
from human.readers import (
    AmbiguousRecordingError,
    MalformedRecordingError,
    read_recording,
    write_bvh,
)
from human.readers.axes import UNITS_M

from .making import CMU_NAMES, PERSON, X_UP, Y_UP, Z_UP, walker, write_other_bvh

HOUSE_NAMES = {name: name for name in SEGMENTS}


def orientation_error_deg(recording, model, motion) -> float:
    poses = forward_kinematics(model, motion.q)
    at = [SEGMENTS.index(name) for name in recording.segment_names]
    made = Rotation.from_matrix(poses.rotation[:, at].reshape(-1, 3, 3))
    read = Rotation.from_quat(recording.orientation_xyzw.reshape(-1, 4))
    return float(np.rad2deg(np.max((made.inv() * read).magnitude())))


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    model, motion = walker()
    write_bvh(tmp_path / "a.bvh", model, motion)
    recording = read_recording(tmp_path / "a.bvh")
    assert recording.segment_names == SEGMENTS
    assert recording.rate_hz == pytest.approx(60.0)
    assert orientation_error_deg(recording, model, motion) < 1e-5
    poses = forward_kinematics(model, motion.q)
    np.testing.assert_allclose(recording.position, poses.position, atol=1e-7)
    np.testing.assert_allclose(recording.joint_offset["RightForeArm"], model.offsets[8], atol=1e-7)


def test_the_reference_pose_in_front_is_left_out_and_said(tmp_path: Path) -> None:
    model, motion = walker()
    write_bvh(tmp_path / "a.bvh", model, motion)
    recording = read_recording(tmp_path / "a.bvh")
    assert recording.frames == len(motion.time_s)
    assert [f.code for f in recording.report.findings] == ["first-frame"]
    # Times are the file's: the motion starts one frame after the reference pose.
    np.testing.assert_allclose(recording.time_s, (np.arange(40) + 1) / 60.0)


def test_a_motion_that_starts_smoothly_keeps_its_first_frame(tmp_path: Path) -> None:
    model, motion = walker()
    write_other_bvh(tmp_path / "a.bvh", model, motion)
    assert read_recording(tmp_path / "a.bvh").frames == len(motion.time_s)


@pytest.mark.parametrize("unit", ["m", "cm", "mm", "in", "cmu"])
@pytest.mark.parametrize("axes", [Y_UP, Z_UP, X_UP], ids=["y-up", "z-up", "x-up"])
@pytest.mark.parametrize("order", ["ZYX", "ZXY"])
def test_cmu_style_files_in_any_unit_and_axes(
    tmp_path: Path, unit: str, axes: np.ndarray, order: str
) -> None:
    model, motion = walker()
    write_other_bvh(tmp_path / "a.bvh", model, motion, unit_m=UNITS_M[unit], axes=axes, order=order)
    recording = read_recording(tmp_path / "a.bvh")
    assert orientation_error_deg(recording, model, motion) < 1e-4
    np.testing.assert_allclose(recording.position[:, 0], motion.q[:, :3], atol=1e-6)
    assert f"lengths from {unit} to m" in " ".join(recording.report.conversions)
    assert recording.report.aliases["RightShoulder"] == "RightShoulder"  # the clavicle, here
    assert recording.report.aliases["RightArm"] == "RightUpperArm"


def test_the_same_name_is_another_segment_in_the_other_spelling(tmp_path: Path) -> None:
    model, motion = walker()
    write_bvh(tmp_path / "a.bvh", model, motion)
    assert read_recording(tmp_path / "a.bvh").report.aliases["RightShoulder"] == "RightUpperArm"


def test_name_spaces_and_separators_do_not_matter(tmp_path: Path) -> None:
    model, motion = walker()
    names = {s: f"mixamorig:{n.replace('Left', 'Left_')}" for s, n in CMU_NAMES.items()}
    write_other_bvh(tmp_path / "a.bvh", model, motion, names=names, unit_m=0.01, dummies=False)
    assert orientation_error_deg(read_recording(tmp_path / "a.bvh"), model, motion) < 1e-4


def test_another_rest_pose_is_turned_to_the_t_pose(tmp_path: Path) -> None:
    """Legs splayed by 20 degrees as in CMU files, arms hanging as in others."""
    model, motion = walker()
    rest = {}
    for side, sign in (("Right", -1.0), ("Left", 1.0)):
        legs = Rotation.from_euler("x", 20.0 * sign, degrees=True)
        arms = Rotation.from_euler("x", -90.0 * sign, degrees=True)
        rest |= {side + part: legs for part in ("UpperLeg", "LowerLeg")}
        rest |= {side + part: arms for part in ("UpperArm", "ForeArm", "Hand")}
    write_other_bvh(tmp_path / "a.bvh", model, motion, rest=rest)
    recording = read_recording(tmp_path / "a.bvh")
    assert orientation_error_deg(recording, model, motion) < 1e-4
    np.testing.assert_allclose(recording.joint_offset["LeftFoot"], model.offsets[20], atol=1e-6)
    said = " ".join(recording.report.conversions)
    assert "RightUpperLeg rests 20 deg from the T-pose" in said
    assert "LeftForeArm rests 90 deg from the T-pose" in said


def test_frames_standing_along_another_axis_than_the_rest_skeleton(tmp_path: Path) -> None:
    model, motion = walker()
    write_other_bvh(tmp_path / "a.bvh", model, motion, axes=Z_UP, rest_axes=Y_UP)
    recording = read_recording(tmp_path / "a.bvh")
    head = recording.position[:, recording.segment_names.index("Head"), 2]
    assert np.all(head > 1.2)
    assert "rest skeleton stands along +y" in " ".join(recording.report.conversions)
    # Up to heading, which is not the reader's to choose, the motion is the one written.
    fitted = fit_recording(recording, PERSON)
    np.testing.assert_allclose(
        fitted.motion.joint_angles[:, -30:], motion.joint_angles[:, -30:], atol=1e-5
    )


def test_a_skeleton_of_no_known_unit_is_asked_about(tmp_path: Path) -> None:
    model, motion = walker()
    write_other_bvh(tmp_path / "a.bvh", model, motion, unit_m=0.2)
    with pytest.raises(AmbiguousRecordingError, match=r"units tall.*Pass units='cm'") as caught:
        read_recording(tmp_path / "a.bvh")
    assert caught.value.parameter == "units"
    # 30 units could be the CMU's, but only in a CMU skeleton.
    write_other_bvh(tmp_path / "b.bvh", model, motion, dummies=False)
    with pytest.raises(AmbiguousRecordingError):
        read_recording(tmp_path / "b.bvh")
    settled = read_recording(tmp_path / "b.bvh", units="cmu")
    np.testing.assert_allclose(settled.position[:, 0], motion.q[:, :3], atol=1e-6)


def test_a_person_lying_down_is_asked_about(tmp_path: Path) -> None:
    model, motion = walker()
    q = motion.q.copy()
    tilt = Rotation.from_euler("YX", [70.0, 45.0], degrees=True)
    q[:, 3:7] = (tilt * Rotation.from_quat(q[:, 3:7])).as_quat()
    lying = motion_from_configurations(model.dof_names, motion.time_s, q)
    write_other_bvh(tmp_path / "a.bvh", model, lying)
    with pytest.raises(AmbiguousRecordingError, match="which way is up") as caught:
        read_recording(tmp_path / "a.bvh")
    assert caught.value.parameter == "up"
    settled = read_recording(tmp_path / "a.bvh", up="y")
    assert orientation_error_deg(settled, model, lying) < 1e-4


@pytest.mark.parametrize(("argument", "value"), [("units", "furlong"), ("up", "w")])
def test_an_unknown_unit_or_axis_is_refused(tmp_path: Path, argument: str, value: str) -> None:
    model, motion = walker()
    write_other_bvh(tmp_path / "a.bvh", model, motion)
    with pytest.raises(AmbiguousRecordingError, match=value):
        read_recording(tmp_path / "a.bvh", **{argument: value})


def test_a_skeleton_without_arms_is_refused_by_name(tmp_path: Path) -> None:
    model, motion = walker()
    names = {s: n for s, n in CMU_NAMES.items() if "ForeArm" not in s and "Hand" not in s}
    write_other_bvh(tmp_path / "a.bvh", model, motion, names=names)
    with pytest.raises(MalformedRecordingError, match="no joint for RightForeArm, LeftForeArm"):
        read_recording(tmp_path / "a.bvh")


def test_limbs_that_never_move_are_named(tmp_path: Path) -> None:
    model, motion = walker()
    q = motion.q.copy()
    q[:, 7 + model.dof_names.index("jRightHip_rotx") :] = 0.0
    write_bvh(
        tmp_path / "a.bvh", model, motion_from_configurations(model.dof_names, motion.time_s, q)
    )
    recording = read_recording(tmp_path / "a.bvh")
    assert recording.segment_status["LeftFoot"] == "unmeasured"
    assert recording.segment_status["LeftHand"] == "measured"
    fitted = fit_recording(recording, PERSON)
    assert fitted.motion.provenance.assumed["LeftFoot"] == "not measured in the recording"


def test_a_jump_inside_the_motion_is_a_warning_with_its_time(tmp_path: Path) -> None:
    model, motion = walker()
    q = motion.q.copy()
    q[25:, 7 + model.dof_names.index("jRightShoulder_rotx")] -= 1.0
    jumping = motion_from_configurations(model.dof_names, motion.time_s, q)
    write_other_bvh(tmp_path / "a.bvh", model, jumping)
    (finding,) = read_recording(tmp_path / "a.bvh").report.findings
    assert (finding.code, finding.severity) == ("jumps", "warning")
    assert finding.place == f"frames before {25 / 60:.3f} s"
    assert "up to 58 deg" in finding.message  # 57.3 and what the arm moved anyway


def test_a_pelvis_that_jumps_is_a_warning_with_its_time(tmp_path: Path) -> None:
    model, motion = walker()
    q = motion.q.copy()
    q[25:, 0] += 0.5
    jumping = motion_from_configurations(model.dof_names, motion.time_s, q)
    write_other_bvh(tmp_path / "a.bvh", model, jumping)
    (finding,) = read_recording(tmp_path / "a.bvh").report.findings
    assert (finding.code, finding.severity) == ("jumps", "warning")
    assert finding.place == f"frames before {25 / 60:.3f} s"
    assert "pelvis" in finding.message


@pytest.mark.parametrize("below", [(), ("L5",), ("L5", "T12"), ("L5", "L3", "T12")])
def test_spines_of_any_length_keep_the_chest(tmp_path: Path, below: tuple[str, ...]) -> None:
    """Whatever lies between pelvis and chest, the chest, head and limbs are where they were."""
    model, motion = walker()
    names = {"Pelvis": "Hips"} | {s: f"Spine{k}" for k, s in enumerate((*below, "T8"))}
    names |= {s: n for s, n in CMU_NAMES.items() if s not in SEGMENTS[:5]}
    write_other_bvh(tmp_path / "a.bvh", model, motion, names=names, unit_m=0.01)
    recording = read_recording(tmp_path / "a.bvh")
    assert recording.segment_names[1 : len(below) + 2] == (*below, "T8")
    assert orientation_error_deg(recording, model, motion) < 1e-4
    assert fit_recording(recording, PERSON).model.n_dof == 66


def test_the_model_s_own_segment_names_are_read(tmp_path: Path) -> None:
    model, motion = walker()
    write_other_bvh(tmp_path / "a.bvh", model, motion, names=HOUSE_NAMES, unit_m=0.01)
    recording = read_recording(tmp_path / "a.bvh")
    assert recording.segment_names == SEGMENTS
    assert orientation_error_deg(recording, model, motion) < 1e-4
