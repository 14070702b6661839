"""Whole-body fits of real optical recordings."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from human import Subject
from human.markers import FittedMarkers, body_from_static, fit_markers
from human.readers import read_markers

ISB = "rehazenter_gait/2014001"
#: Static trial, motion, height (m), mass (kg), frames fitted, residual allowed (RMS, mm).
TRIALS = {
    "squats": ("opencap_subject4/static1.trc", "opencap_subject4/squats1.trc", 1.73, 60, 1346, 11),
    "sit": ("opencap_subject4/static1.trc", "opencap_subject4/STS1.trc", 1.73, 60, 1399, 12),
    "walk": ("opencap_subject4/static1.trc", "opencap_subject4/walking1.trc", 1.73, 60, 131, 8),
    "vicon": ("walk.c3d", "walk.c3d", 1.64, 73.4, 221, 9),
    "isb": (
        "rehazenter_gait/2014001_ST.c3d",
        "rehazenter_gait/2014001_C1_01.c3d",
        1.7,
        65,
        387,
        10,
    ),
    "cmu": ("cmu_c3d/cmu_02_05.c3d", "cmu_c3d/cmu_02_05.c3d", 1.75, 75, 1854, 10),
}


@pytest.fixture(scope="module")
def fitted(recordings_dir: Path, tmp_path_factory) -> dict[str, FittedMarkers]:
    unpacked = tmp_path_factory.mktemp("vicon")
    with zipfile.ZipFile(recordings_dir / "ktk_walk" / "walk.c3d.zip") as archive:
        archive.extractall(unpacked)
    out = {}
    for name, (static, motion, height, mass, _, _) in TRIALS.items():
        folder = unpacked if name == "vicon" else recordings_dir
        body = body_from_static(read_markers(folder / static), Subject(height, mass))
        out[name] = fit_markers(body, read_markers(folder / motion))
    return out


@pytest.mark.parametrize("name", TRIALS)
def test_every_frame_is_met_within_skin(fitted, name: str) -> None:
    fit, (*_, frames, most_mm) = fitted[name], TRIALS[name]
    assert len(fit.motion) == frames
    assert 1e3 * fit.rms_m < most_mm
    assert np.mean(fit.outlier) < 1e-3


def segment_speed(fit: FittedMarkers, segment: str) -> tuple[np.ndarray, np.ndarray]:
    """Angular velocity by the motion's rates, and by differences of the postures; world axes."""
    import pinocchio as pin

    model = fit.model.pinocchio()
    data, frame = model.createData(), model.getFrameId(segment)
    stated, turned, last = [], [], None
    for q, v in zip(fit.motion.q, fit.motion.v, strict=True):
        pin.forwardKinematics(model, data, q, v)
        stated.append(pin.getFrameVelocity(model, data, frame, pin.LOCAL_WORLD_ALIGNED).angular)
        here = pin.updateFramePlacement(model, data, frame).rotation.copy()
        if last is not None:
            turned.append(pin.log3(here @ last.T))
        last = here
    step = np.diff(fit.motion.time_s)[:, None]
    return np.array(stated)[1:], np.array(turned) / step


def test_a_deep_squat_has_the_thigh_s_own_speed_through_the_hip_s_singular_posture(fitted) -> None:
    fit = fitted["squats"]
    # The outer angles swing by more than a right angle, as they only do past that posture.
    hip = fit.motion.joint_angles[:, fit.model.dof_names.index("jRightHip_rotx")]
    assert np.ptp(hip) > np.pi / 2
    stated, turned = segment_speed(fit, "RightUpperLeg")
    assert np.sqrt(np.mean((stated - turned) ** 2)) < 0.1 * np.sqrt(np.mean(turned**2))


def test_a_walk_bends_hip_knee_and_ankle_as_walks_do(fitted) -> None:
    for name in ("walk", "vicon", "isb"):
        fit = fitted[name]
        angles = np.rad2deg(fit.motion.joint_angles)
        for side in ("Right", "Left"):
            hip, knee, ankle = (
                np.ptp(angles[:, fit.model.dof_names.index(f"j{side}{joint}_roty")])
                for joint in ("Hip", "Knee", "Ankle")
            )
            assert 30 < hip < 55
            assert 40 < knee < 70
            assert 18 < ankle < 45


def test_what_a_set_does_not_show_is_named(fitted) -> None:
    assert {"jL5S1_roty", "jRightElbow_rotz"} <= set(fitted["vicon"].unobserved_dofs)
    assert not any("Hip" in n or "Knee" in n for n in fitted["vicon"].unobserved_dofs)
    assert not any("Elbow" in n for n in fitted["squats"].unobserved_dofs)
