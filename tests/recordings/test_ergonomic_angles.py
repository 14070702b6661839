"""Our angles on a real recording, against the ergonomic angles that the suit's software states."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from numpy.typing import NDArray

from ergonomics import back_angle, posture_angles
from human.readers import read_recording
from human.rotations import quaternion_to_matrix

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Recorded:
    """Poses as the reader gives them, and the file's own angles by name, degrees."""

    segment_names: tuple[str, ...]
    rotation: Floats
    position: Floats
    stated: dict[str, Floats]


@pytest.fixture(scope="module")
def recorded(recordings_dir: Path) -> Recorded:
    path = recordings_dir / "xsens_mvnx" / "test_mocap.mvnx"
    tree = etree.parse(path)
    ns = {"m": tree.getroot().nsmap[None]}
    frames = [f for f in tree.iterfind(".//m:frame", ns) if f.get("type") == "normal"]
    stated = {}
    for field, label in (("jointAngleErgo", "ergonomicJointAngle"), ("jointAngle", "joint")):
        names = [e.get("label") for e in tree.iterfind(f".//m:{label}", ns)]
        rows = [[float(x) for x in f.find(f"m:{field}", ns).text.split()] for f in frames]
        values = np.array(rows).reshape(len(rows), -1, 3)
        stated |= {name: values[:, i] for i, name in enumerate(names)}
    recording = read_recording(path)
    return Recorded(
        tuple(recording.segment_names),
        quaternion_to_matrix(recording.orientation_xyzw),
        recording.position,
        stated,
    )


def _close(got: Floats, stated: Floats, tolerance: float) -> None:
    # Both see the same movement, so a constant cannot pass for agreement.
    assert np.ptp(stated) > 0.5
    np.testing.assert_allclose(got, stated, atol=tolerance)


def test_head_and_back(recorded: Recorded) -> None:
    angles = posture_angles(recorded, recorded)
    head, back = recorded.stated["T8_Head"], recorded.stated["Pelvis_T8"]
    _close(angles.neck_flexion_deg, head[:, 2], 0.05)
    _close(-angles.neck_bend_deg, head[:, 0], 0.05)
    _close(angles.neck_twist_deg, head[:, 1], 1.0)
    _close(back_angle(recorded, recorded).signed_sum_deg, back[:, 2], 0.05)
    _close(-angles.trunk_bend_deg, back[:, 0], 0.05)
    _close(angles.trunk_twist_deg, back[:, 1], 1.0)


@pytest.mark.parametrize("side", ["left", "right"])
def test_upper_arms(recorded: Recorded, side: str) -> None:
    arm = posture_angles(recorded, recorded).arms[side]
    sideways, _, forward = recorded.stated[f"T8_{side.capitalize()}UpperArm"].T
    _close(arm.upper_arm_sagittal_deg, forward, 0.05)
    _close(arm.abduction_deg, sideways, 0.05)
    cosine = np.cos(np.deg2rad(forward)) * np.cos(np.deg2rad(sideways))
    _close(arm.upper_arm_deg, np.rad2deg(np.arccos(cosine)), 0.05)


def test_forearm_twist_is_counted_from_the_middle(recorded: Recorded) -> None:
    # The suit counts pronation from palms forward, a quarter turn before the handshake.
    ours = posture_angles(recorded, recorded).arms["right"].pronation_deg
    theirs = recorded.stated["jRightElbow"][:, 1] - 90.0
    assert np.abs(ours - theirs).max() < 20.0
