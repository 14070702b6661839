"""The estimator on the published human models: the papers' T-pose, and the load in the hand."""

from pathlib import Path

import numpy as np
import pytest

from estimation import (
    Accelerometer,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    estimate,
    joint_efforts,
    payload,
    real_tree,
)
from human import HumanModel, Wrench, forward_kinematics, from_urdf, inverse_dynamics

ARM = ("jRightShoulder", "jRightElbow", "jRightWrist")
#: The 2021 paper's subject, by deterministic inverse dynamics; N m.
BASELINE = {0.0: (12.94, 3.46, 0.43), 5.0: (45.57, 20.76, 5.15)}


def standing(model: HumanModel, load_kg: float) -> list[object]:
    """What sensors read of a T-pose whose feet share what balance asks."""
    q = model.neutral()
    held = [Wrench("RightHandCOM", (0.0, 0.0, -9.81 * load_kg))]
    needed = inverse_dynamics(model, q, None, None, held)[:6]
    poses = forward_kinematics(model, q)
    sensors: list[object] = [
        JointAcceleration(np.zeros((1, model.n_dof)), 0.05**2),
        FreeWrench("RightHandCOM"),
    ]
    moment = needed[3:]
    for foot in ("RightFoot", "LeftFoot"):
        moment = moment - np.cross(poses.of(foot)[1], needed[:3] / 2.0)
    for foot in ("RightFoot", "LeftFoot"):
        value = np.r_[needed[:3] / 2.0, moment / 2.0][None]
        sensors.append(ForceTorque(foot, value, [1.0] * 3 + [0.15**2] * 3))
    for segment in model.segment_names[:17]:
        sensors.append(Accelerometer(segment, np.array([[0.0, 0.0, 9.81]]), 0.033**2))
    return sensors


@pytest.mark.parametrize("load_kg", BASELINE)
def test_t_pose_efforts_of_subject_three_are_the_papers(
    recordings_dir: Path, load_kg: float
) -> None:
    path = recordings_dir / "human-gazebo" / "humanSubject03_66dof.urdf"
    model = from_urdf(path.read_bytes())
    q, still = model.neutral()[None], np.zeros((1, model.nv))
    found = estimate(real_tree(model), q, still, still, standing(model, load_kg))
    efforts = joint_efforts(found)
    columns = [efforts.joint_names.index(name) for name in ARM]
    np.testing.assert_allclose(efforts.effort_nm[0, columns], BASELINE[load_kg], atol=0.01)
    assert payload(found).mass_kg[0] == pytest.approx(load_kg, abs=0.02)
