"""The written file is Xsens's: joint names, units, axes, channel order."""

from pathlib import Path

import numpy as np
import pytest

from human.differentiate import motion_from_configurations
from human.pose import fit_recording
from human.readers import MalformedRecordingError, read_recording, write_bvh
from human.readers.bvh_file import parse_bvh

from .making import PERSON, walker


def test_names_units_and_channels_are_those_of_xsens(tmp_path: Path) -> None:
    model, motion = walker()
    write_bvh(tmp_path / "a.bvh", model, motion)
    file = parse_bvh(tmp_path / "a.bvh")
    assert [joint.name for joint in file.joints][:9] == [
        "Hips", "Chest", "Chest2", "Chest3", "Chest4", "Neck", "Head", "RightCollar",
        "RightShoulder",
    ]  # fmt: skip
    assert file.joints[1].channels == ("Yrotation", "Xrotation", "Zrotation")
    # Centimetres, y up, x to the left, z forward.
    elbow = next(joint for joint in file.joints if joint.name == "LeftElbow")
    x, y, z = model.offsets[model.joint_names.index("jLeftElbow")] * 100.0
    np.testing.assert_allclose(elbow.offset, [y, z, x], atol=1e-6)
    np.testing.assert_allclose(file.values[1:, 1], motion.q[:, 2] * 100.0, atol=1e-6)


def test_configurations_survive_the_round_trip(tmp_path: Path) -> None:
    model, motion = walker(frames=30)
    write_bvh(tmp_path / "a.bvh", model, motion)
    fitted = fit_recording(read_recording(tmp_path / "a.bvh"), PERSON)
    assert not np.any(fitted.diagnostics.limited)
    np.testing.assert_allclose(fitted.motion.q, motion.q, atol=2e-7)
    np.testing.assert_allclose(fitted.model.offsets, model.offsets, atol=1e-7)
    assert np.max(fitted.diagnostics.position_error_m) < 1e-7


def test_uneven_times_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    model, motion = walker()
    time = motion.time_s.copy()
    time[20:] += 0.01
    uneven = motion_from_configurations(model.dof_names, time, motion.q)
    with pytest.raises(MalformedRecordingError, match="evenly sampled"):
        write_bvh(tmp_path / "a.bvh", model, uneven)
    assert not (tmp_path / "a.bvh").exists()


def test_a_posture_at_the_file_format_singularity_survives(tmp_path: Path) -> None:
    """The middle channel is about the file's x: a thigh lifted by 90 degrees."""
    model, motion = walker(frames=5)
    q = motion.q.copy()
    q[:, 7 + model.dof_names.index("jRightHip_roty")] = -np.pi / 2
    q[:, 7 + model.dof_names.index("jRightHip_rotx")] = 0.0
    q[:, 7 + model.dof_names.index("jRightHip_rotz")] = np.linspace(0.0, 0.2, 5)
    locked = motion_from_configurations(model.dof_names, motion.time_s, q)
    write_bvh(tmp_path / "a.bvh", model, locked)
    recording = read_recording(tmp_path / "a.bvh")
    fitted = fit_recording(recording, PERSON)
    assert np.max(fitted.diagnostics.orientation_error_rad) < np.deg2rad(1e-3)
