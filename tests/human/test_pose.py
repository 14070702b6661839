"""Whole recordings fitted: exact where nothing hinders, honest where something does."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from human.differentiate import motion_from_configurations
from human.errors import ModelError
from human.kinematics import forward_kinematics
from human.model import Subject
from human.names import SEGMENTS
from human.pose import fit_recording
from human.readers import read_recording, write_bvh
from human.recording import Recording

from .readers.making import CMU_NAMES, PERSON, walker, write_other_bvh


def recorded(folder: Path, q_change=None, **options) -> tuple[Recording, np.ndarray]:
    """A recording of the walker and the configurations it was made from."""
    model, motion = walker(**options)
    q = motion.q.copy()
    if q_change is not None:
        q_change(model, q)
        motion = motion_from_configurations(model.dof_names, motion.time_s, q)
    write_bvh(folder / "a.bvh", model, motion)
    return read_recording(folder / "a.bvh"), q


def test_without_active_limits_orientations_are_exact(tmp_path: Path) -> None:
    recording, q = recorded(tmp_path)
    fitted = fit_recording(recording, PERSON)
    d = fitted.diagnostics
    assert not np.any(d.limited)
    assert np.rad2deg(np.max(d.orientation_error_rad)) < 1e-6
    assert np.rad2deg(np.max(d.pair_error_rad)) < 1e-6
    np.testing.assert_allclose(fitted.motion.q, q, atol=2e-7)
    assert d.summary()["joints_at_limits"] == {}


def test_masses_are_the_subjects_and_lengths_the_recordings(tmp_path: Path) -> None:
    recording, _ = recorded(tmp_path)
    other = Subject(1.80, 90.0, "female")
    fitted = fit_recording(recording, other)
    assert fitted.model.total_mass_kg == pytest.approx(90.0, abs=1e-12)
    np.testing.assert_allclose(
        fitted.model.offsets[SEGMENTS.index("RightFoot") - 1], recording.joint_offset["RightFoot"]
    )


def test_a_joint_beyond_its_limit_is_held_there_and_the_rest_is_untouched(tmp_path: Path) -> None:
    def overbent(model, q: np.ndarray) -> None:
        q[:, 7 + model.dof_names.index("jLeftWrist_roty")] = np.deg2rad(60.0)  # limit 20

    recording, q = recorded(tmp_path, overbent)
    fitted = fit_recording(recording, PERSON)
    model, d = fitted.model, fitted.diagnostics
    k = model.joint_names.index("jLeftWrist")
    assert np.all(d.limited[:, k])
    assert np.all(fitted.motion.flags["limit_active"])
    angles = fitted.motion.joint_angles
    assert np.all(angles >= model.lower - 1e-12)
    assert np.all(angles <= model.upper + 1e-12)
    others = [i for i, joint in enumerate(model.dof_joints) if joint != k]
    np.testing.assert_allclose(angles[:, others], q[:, 7:][:, others], atol=2e-7)
    assert "calibration" in " ".join(d.notes)
    free = fit_recording(recording, PERSON, within_limits=False)
    np.testing.assert_allclose(free.motion.q, q, atol=2e-7)


def test_an_arm_through_ninety_degrees_stays_continuous_and_is_flagged(tmp_path: Path) -> None:
    def through(model, q: np.ndarray) -> None:
        column = 7 + model.dof_names.index("jRightShoulder_roty")
        q[:, column] = np.deg2rad(np.linspace(-80.0, -100.0, len(q)))

    recording, q = recorded(tmp_path, through, frames=61)
    fitted = fit_recording(recording, PERSON)
    k = fitted.model.joint_names.index("jRightShoulder")
    crossing = np.abs(np.abs(q[:, 7 + 3 * k + 1]) - np.pi / 2) < np.deg2rad(4.9)
    assert np.all(fitted.diagnostics.near_singular[crossing, k])
    assert np.all(fitted.motion.flags["near_singular"][crossing])
    arm = fitted.motion.joint_angles[:, 3 * k : 3 * k + 3]
    assert np.max(np.abs(np.diff(arm, axis=0))) < np.deg2rad(1.5)
    np.testing.assert_allclose(arm, q[:, 7 + 3 * k : 10 + 3 * k], atol=np.deg2rad(0.2))


def test_velocities_are_those_of_the_motion(tmp_path: Path) -> None:
    recording, q = recorded(tmp_path)
    fitted = fit_recording(recording, PERSON)
    expected = motion_from_configurations(fitted.model.dof_names, recording.time_s, q)
    np.testing.assert_allclose(fitted.motion.v, expected.v, atol=1e-4)
    assert fitted.motion.base == "measured"


def test_a_pelvis_that_stays_where_it_is_was_not_located(tmp_path: Path) -> None:
    def pinned(_, q: np.ndarray) -> None:
        q[:, :3] = [0.0, 0.0, 0.95]

    recording, _ = recorded(tmp_path, pinned)
    assert fit_recording(recording, PERSON).motion.base == "fixed"


def test_missing_spine_segments_share_the_bend(tmp_path: Path) -> None:
    """The CMU skeleton has no L3; where the spine bends evenly, sharing finds the very posture."""
    model, motion = walker()
    q = motion.q.copy()
    for name in ("jL4L3", "jL1T12"):
        at = 7 + model.dof_names.index(f"{name}_rotx")
        q[:, at : at + 3] = np.deg2rad([2.0, 6.0, 0.0]) if name == "jL4L3" else q[:, at - 3 : at]
    even = motion_from_configurations(model.dof_names, motion.time_s, q)
    write_other_bvh(tmp_path / "a.bvh", model, even, names=CMU_NAMES)
    fitted = fit_recording(read_recording(tmp_path / "a.bvh"), PERSON)
    assert fitted.diagnostics.filled_segments == ("L3",)
    assert "filled in" in fitted.motion.provenance.assumed["L3"]
    np.testing.assert_allclose(fitted.motion.q[:, 3:], q[:, 3:], atol=1e-6)
    # The file's spine is straight where the model's bends: 6 degrees over one vertebral block.
    assert np.median(fitted.diagnostics.position_error_m) < 0.02


def test_a_dummy_joint_without_length_does_not_break_the_skeleton(tmp_path: Path) -> None:
    model, motion = walker()
    offsets = np.array(model.offsets)
    offsets[3] += offsets[0] + offsets[1] + offsets[2]
    offsets[:3] = 0.0  # L5, L3 and T12 sit in the hips
    squashed = dataclasses.replace(model, offsets=offsets)
    write_bvh(tmp_path / "a.bvh", squashed, motion)
    fitted = fit_recording(read_recording(tmp_path / "a.bvh"), PERSON)
    assert np.all(np.linalg.norm(fitted.model.offsets[:4], axis=1) > 0.03)
    np.testing.assert_allclose(fitted.model.offsets[:4].sum(axis=0), offsets[3], atol=1e-6)
    np.testing.assert_allclose(fitted.motion.joint_angles, motion.joint_angles, atol=1e-6)


def test_missing_hands_clavicles_and_toes_move_with_their_parents(tmp_path: Path) -> None:
    model, motion = walker()
    names = {s: n for s, n in CMU_NAMES.items() if s[-4:] not in ("Hand", "lder", "tToe")}
    write_other_bvh(tmp_path / "a.bvh", model, motion, names=names)
    fitted = fit_recording(read_recording(tmp_path / "a.bvh"), PERSON)
    assert set(fitted.diagnostics.filled_segments) == {"L3"} | {
        side + part for side in ("Left", "Right") for part in ("Hand", "Shoulder", "Toe")
    }
    wrist = fitted.model.joint_names.index("jLeftWrist")
    np.testing.assert_allclose(
        fitted.motion.joint_angles[:, 3 * wrist : 3 * wrist + 3], 0.0, atol=1e-12
    )
    poses = forward_kinematics(fitted.model, fitted.motion.q)
    assert poses.position.shape[1] == len(SEGMENTS)


def test_a_stature_that_does_not_fit_the_skeleton_is_said(tmp_path: Path) -> None:
    recording, _ = recorded(tmp_path)
    notes = fit_recording(recording, Subject(1.40, 50.0)).diagnostics.notes
    assert any("check height and units" in note for note in notes)
    assert fit_recording(recording, PERSON).diagnostics.notes == ()


def test_a_skeleton_that_is_no_body_is_refused(tmp_path: Path) -> None:
    recording, _ = recorded(tmp_path)
    stretched = dict(recording.joint_offset) | {"RightHand": np.array([0.0, -1.5, 0.0])}
    with pytest.raises(ModelError, match="jRightWrist"):
        fit_recording(dataclasses.replace(recording, joint_offset=stretched), PERSON)
