import math
import pickle

import numpy as np
import pinocchio as pin
import pytest

from human import (
    ConfigurationError,
    UnknownNameError,
    Wrench,
    forward_kinematics,
    frame_poses,
    inverse_dynamics,
    joint_forces,
    joint_loads,
    joint_moments,
)
from human.dynamics import CHUNK


def pinocchio_rnea(model, q, v, a, wrenches=()):
    """One frame of Pinocchio's recursion; wrenches ``(name, force, moment)`` in world axes."""
    peer = model.pinocchio()
    data = peer.createData()
    pin.framesForwardKinematics(peer, data, q)
    loads = [pin.Force.Zero() for _ in range(peer.njoints)]
    for name, force, moment in wrenches:
        frame = peer.frames[peer.getFrameId(name)]
        turn = data.oMf[peer.getFrameId(name)].rotation.T
        loads[frame.parentJoint] += frame.placement.act(pin.Force(turn @ force, turn @ moment))
    external = pin.StdVec_Force()
    external.extend(loads)
    return pin.rnea(peer, data, q, v, a, external)


@pytest.fixture
def motion(model, configurations, rng):
    return (
        configurations(model, 30),
        rng.normal(size=(30, model.nv)),
        rng.normal(size=(30, model.nv)),
    )


def test_equals_pinocchio_with_wrenches(model, motion, rng):
    q, v, a = motion
    hand, foot = rng.normal(size=(2, 30, 6)) * 100.0
    tau = inverse_dynamics(
        model,
        q,
        v,
        a,
        [
            Wrench("RightHandCOM", hand[:, :3], hand[:, 3:]),
            Wrench("LeftFoot", foot[:, :3], foot[:, 3:]),
        ],
    )
    for row in range(30):
        expected = pinocchio_rnea(
            model,
            q[row],
            v[row],
            a[row],
            [
                ("RightHandCOM", hand[row, :3], hand[row, 3:]),
                ("LeftFoot", foot[row, :3], foot[row, 3:]),
            ],
        )
        np.testing.assert_allclose(
            tau[row], expected, rtol=0, atol=1e-12 * np.max(np.abs(expected))
        )


@pytest.mark.parametrize("rates", ["none", "v", "a"])
def test_missing_rates_are_zero(model, motion, rates):
    q, v, a = motion
    zero = np.zeros_like(v)
    v, a = {"none": (None, None), "v": (v, None), "a": (None, a)}[rates]
    full = inverse_dynamics(model, q, zero if v is None else v, zero if a is None else a)
    np.testing.assert_allclose(inverse_dynamics(model, q, v, a), full, atol=1e-10)


def test_torque_is_the_moment_along_its_axis(model, motion):
    q, v, a = motion
    loads = joint_loads(model, q, v, a, [Wrench("LeftHandCOM", (10.0, -20.0, 30.0))])
    np.testing.assert_allclose(
        loads.torque,
        inverse_dynamics(model, q, v, a, [Wrench("LeftHandCOM", (10.0, -20.0, 30.0))])[:, 6:],
    )
    rotation = forward_kinematics(model, q).rotation
    for joint in range(len(model.joint_names)):
        # The first axis of a joint is fixed in the parent, the last in the child.
        parent = rotation[:, model.parents[joint + 1]]
        first, last = model.joint_dofs(joint)[[0, -1]]
        moment = loads.moment[:, joint]
        np.testing.assert_allclose(
            loads.torque[:, first], np.sum(parent[..., 0] * moment, axis=1), atol=1e-9
        )
        child = rotation[:, joint + 1]
        np.testing.assert_allclose(
            loads.torque[:, last], np.sum(child[..., 2] * moment, axis=1), atol=1e-9
        )


def test_known_mass_on_a_known_lever(model):
    q = model.neutral()
    kilograms = 5.0
    weight = [Wrench("RightHandCOM", (0.0, 0.0, -kilograms * 9.81))]
    extra = joint_moments(model, q, wrenches=weight) - joint_moments(model, q)
    hand = frame_poses(model, forward_kinematics(model, q), "RightHandCOM")[1]
    for joint in ("jRightShoulder", "jRightElbow", "jRightWrist", "jL5S1"):
        index = model.joint_names.index(joint)
        center = forward_kinematics(model, q).position[index + 1]
        # The parent must push the hand's load back up over the lever to it.
        expected = np.cross(hand - center, [0.0, 0.0, kilograms * 9.81])
        np.testing.assert_allclose(extra[index], expected, atol=1e-12)
    hips = model.joint_names.index("jLeftHip")
    np.testing.assert_allclose(extra[hips], 0.0, atol=1e-12)


def test_hanging_arm_needs_no_moment(model):
    q = model.neutral()
    q[7 + model.dof_names.index("jRightShoulder_rotx")] = np.pi / 2
    moment = joint_moments(model, q)[model.joint_names.index("jRightShoulder")]
    # All of the arm's centres of mass lie on one line below the joint.
    np.testing.assert_allclose(moment, 0.0, atol=1e-12)
    force = joint_forces(model, q)[model.joint_names.index("jRightShoulder")]
    arm = sum(
        model.masses[model.segment_names.index(f"Right{part}")]
        for part in ("UpperArm", "ForeArm", "Hand")
    )
    np.testing.assert_allclose(force, [0.0, 0.0, 9.81 * arm], atol=1e-12)


def test_base_bears_the_whole_weight(model, configurations):
    q = configurations(model, 6)
    tau = inverse_dynamics(model, q)
    np.testing.assert_allclose(
        np.linalg.norm(tau[:, :3], axis=1), 9.81 * model.total_mass_kg, rtol=1e-12
    )


def test_power_is_the_rate_of_energy(model, configurations, rng):
    # Along any path, generalized force times velocity is the rate of kinetic plus potential energy.
    peer = model.pinocchio()
    data = peer.createData()
    q, v, a = configurations(model), rng.normal(size=model.nv), rng.normal(size=model.nv)
    step = 1e-5

    def energy(time):
        there = pin.integrate(peer, q, v * time + 0.5 * a * time**2)
        return pin.computeMechanicalEnergy(peer, data, there, v + a * time)

    rate = (energy(step) - energy(-step)) / (2 * step)
    assert inverse_dynamics(model, q, v, a) @ v == pytest.approx(rate, rel=1e-6)


def test_turning_the_world_turns_the_moments(model, motion, rng):
    q, v, a = motion
    force = rng.normal(size=3) * 50.0
    turn = pin.Quaternion(pin.exp3(np.array([0.0, 0.0, 1.1])))
    turned = q.copy()
    for row in range(len(q)):
        turned[row, :3] = turn.matrix() @ q[row, :3]
        turned[row, 3:7] = (turn * pin.Quaternion(q[row, 3:7])).coeffs()
    here = joint_moments(model, q, v, a, [Wrench("RightHandCOM", force)])
    there = joint_moments(model, turned, v, a, [Wrench("RightHandCOM", turn.matrix() @ force)])
    np.testing.assert_allclose(there, here @ turn.matrix().T, atol=1e-9)


def test_some_joints_are_the_same_as_all(model, motion):
    q, v, a = motion
    loads = [Wrench("RightHandCOM", (0.0, 0.0, -50.0)), Wrench("RightFoot", (0.0, 0.0, 700.0))]
    whole = joint_loads(model, q, v, a, loads)
    some = joint_loads(model, q, v, a, loads, joints=["jRightElbow", "jL5S1"])
    assert some.joint_names == ("jL5S1", "jRightElbow")
    rows = [whole.joint_names.index(name) for name in some.joint_names]
    np.testing.assert_array_equal(some.moment, whole.moment[:, rows])
    np.testing.assert_array_equal(some.force, whole.force[:, rows])
    dofs = [whole.dof_names.index(name) for name in some.dof_names]
    assert len(dofs) == 6
    np.testing.assert_array_equal(some.torque, whole.torque[:, dofs])


def test_batches_and_chunks_do_not_show(model, configurations, rng):
    count = CHUNK + 3
    q = np.tile(configurations(model, 1), (count, 1))
    v = np.tile(rng.normal(size=model.nv), (count, 1))
    tau = inverse_dynamics(model, q, v)
    np.testing.assert_allclose(tau, np.broadcast_to(tau[0], tau.shape), atol=1e-9)
    shaped = inverse_dynamics(model, q[:6].reshape(2, 3, -1), v[0])
    np.testing.assert_allclose(shaped, tau[:6].reshape(2, 3, -1), atol=1e-9)
    assert joint_moments(model, np.empty((0, model.nq))).shape == (0, 22, 3)


def test_gravity_can_be_turned_off(model, configurations):
    tau = inverse_dynamics(model, configurations(model, 3), gravity=(0.0, 0.0, 0.0))
    np.testing.assert_allclose(tau, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"v": np.zeros(3)}, "v: expected shape"),
        ({"a": np.full(72, np.nan)}, "a: expected finite"),
        (
            {"wrenches": [Wrench("RightHandCOM", (0.0, 1.0))]},
            "force on RightHandCOM: expected shape",
        ),
        (
            {"wrenches": [Wrench("RightHandCOM", (0, 0, 0), (np.inf, 0, 0))]},
            "moment on RightHandCOM",
        ),
        ({"gravity": (0.0, 9.81)}, "gravity"),
    ],
)
def test_malformed_inputs_are_refused(model, arguments, message):
    with pytest.raises(ConfigurationError, match=message):
        inverse_dynamics(model, model.neutral(), **arguments)


def test_unknown_places_are_refused(model):
    with pytest.raises(UnknownNameError, match="Tail"):
        inverse_dynamics(model, model.neutral(), wrenches=[Wrench("Tail", (0, 0, 0))])
    with pytest.raises(UnknownNameError, match="jTail"):
        joint_loads(model, model.neutral(), joints=["jTail"])


def test_model_survives_another_process(model, configurations):
    q = configurations(model, 2)
    there = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(inverse_dynamics(there, q), inverse_dynamics(model, q))
    assert there.pinocchio().nv == model.nv
    with pytest.raises(ValueError, match="read-only"):
        there.masses[0] = 1.0


def test_pinocchio_twin_has_the_same_mass_and_names(model):
    peer = model.pinocchio()
    assert pin.computeTotalMass(peer) == pytest.approx(model.total_mass_kg, rel=1e-15)
    assert tuple(peer.names[2:]) == model.dof_names
    assert math.isclose(peer.upperPositionLimit[7], model.upper[0])
    assert model.pinocchio() is peer
