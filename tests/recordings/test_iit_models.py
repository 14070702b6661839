"""The published human models load and behave as Pinocchio says, and as the papers report."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from human import (
    HumanModel,
    Wrench,
    forward_kinematics,
    from_urdf,
    inverse_dynamics,
    joint_loads,
    to_urdf,
)

FILES = (
    "humanSubject01_48dof.urdf",
    "humanSubject01_66dof.urdf",
    "humanSubject02_66dof.urdf",
    "humanSubject03_48dof.urdf",
    "humanSubject03_66dof.urdf",
    "humanSubject04_66dof.urdf",
    "humanSubject05_66dof.urdf",
    "humanSubject06_66dof.urdf",
    "humanSubject07_66dof.urdf",
    "humanSubject08_66dof.urdf",
)
ARM = ("jRightShoulder", "jRightElbow", "jRightWrist")


@pytest.fixture(params=FILES)
def path(request: pytest.FixtureRequest, recordings_dir: Path) -> Path:
    return recordings_dir / "human-gazebo" / request.param


def effort(model: HumanModel, wrenches: tuple[Wrench, ...] = ()) -> np.ndarray:
    """Norm of the moment at shoulder, elbow and wrist in the T-pose, N m."""
    loads = joint_loads(model, model.neutral(), wrenches=wrenches, joints=ARM)
    return np.linalg.norm(loads.moment, axis=-1)


def test_mass_effort_and_kinematics_are_pinocchios(path: Path) -> None:
    model = from_urdf(path.read_bytes())
    peer = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    data = peer.createData()
    order = np.array([peer.idx_vs[peer.getJointId(name)] for name in model.dof_names])
    assert sorted(order) == list(range(6, peer.nv))
    assert model.total_mass_kg == pytest.approx(pin.computeTotalMass(peer), abs=1e-12)
    rng = np.random.default_rng(7)
    rest = model.neutral()
    bent = np.concatenate([rng.normal(size=7), rng.uniform(-2.0, 2.0, model.n_dof)])
    bent[3:7] /= np.linalg.norm(bent[3:7])
    for q in (rest, bent):
        v, a = (
            (np.zeros(model.nv), np.zeros(model.nv))
            if q is rest
            else rng.normal(size=(2, model.nv))
        )
        theirs, their_v, their_a = q.copy(), v.copy(), a.copy()
        theirs[order + 1], their_v[order], their_a[order] = q[7:], v[6:], a[6:]
        expected = pin.rnea(peer, data, theirs, their_v, their_a)
        got = inverse_dynamics(model, q, v, a)
        np.testing.assert_allclose(got[6:], expected[order], atol=1e-9)
        np.testing.assert_allclose(got[:6], expected[:6], atol=1e-9)
        pin.framesForwardKinematics(peer, data, theirs)
        poses = forward_kinematics(model, q)
        for name in model.segment_names:
            place = data.oMf[peer.getFrameId(name)]
            np.testing.assert_allclose(poses.of(name)[0], place.rotation, atol=1e-12)
            np.testing.assert_allclose(poses.of(name)[1], place.translation, atol=1e-12)


def test_written_and_read_again_is_the_same(path: Path) -> None:
    model = from_urdf(path.read_bytes())
    back = from_urdf(to_urdf(model))
    np.testing.assert_array_equal(back.masses, model.masses)
    np.testing.assert_array_equal(back.inertias, model.inertias)
    np.testing.assert_array_equal(back.offsets, model.offsets)
    assert back.dof_names == model.dof_names


@pytest.mark.parametrize("dofs", [48, 66])
def test_t_pose_effort_of_subject_3(recordings_dir: Path, dofs: int) -> None:
    # N m, computed independently; then the same with 5 kg in the hand. The 48-DoF model locks axes,
    # which the whole moment does not notice.
    file = recordings_dir / "human-gazebo" / f"humanSubject03_{dofs}dof.urdf"
    model = from_urdf(file.read_bytes())
    np.testing.assert_allclose(effort(model), [12.94, 3.462, 0.427], atol=6e-3)
    weight = (Wrench("RightHandCOM", (0.0, 0.0, -5.0 * 9.81)),)
    np.testing.assert_allclose(effort(model, weight), [45.57, 20.76, 5.146], atol=6e-3)


def test_t_pose_effort_of_subject_1(recordings_dir: Path) -> None:
    file = recordings_dir / "human-gazebo" / "humanSubject01_66dof.urdf"
    model = from_urdf(file.read_bytes())
    np.testing.assert_allclose(effort(model), [9.231, 2.478, 0.306], atol=6e-4)
    weight = (Wrench("RightHandCOM", (0.0, 0.0, -5.0 * 9.81)),)
    np.testing.assert_allclose(effort(model, weight), [38.10, 18.11, 5.025], atol=6e-3)
