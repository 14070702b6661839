import numpy as np
import pinocchio as pin
import pytest

from human import Chain
from human.simulate import (
    SimulationError,
    minimum_jerk_path,
    operator,
    simulate_following,
    simulate_reaching,
    standing_configuration,
)

_HAND = "RightHandCOM"


def _integral_error(motion):
    """Largest difference between q and what v integrates to, from sample to sample.

    The trapezoid with end correction (Euler-Maclaurin), exact for cubic v where a is its slope.
    """
    h = np.diff(motion.time_s)[:, None]
    trapezoid = 0.5 * h * (motion.v[1:] + motion.v[:-1])
    step = trapezoid + h * h / 12.0 * (motion.a[:-1] - motion.a[1:])
    return np.abs(np.diff(motion.joint_angles, axis=0) - step[:, 6:]).max()


def test_the_hand_is_exactly_where_the_robot_leads_it(reaching, person):
    hand = reaching.truth.hands[_HAND]
    model, data = person.pinocchio(), person.pinocchio().createData()
    for i in range(0, len(reaching.motion), 10):
        pin.framesForwardKinematics(model, data, reaching.motion.q[i])
        placed = data.oMf[model.getFrameId(_HAND)]
        np.testing.assert_allclose(placed.translation, hand.position[i], atol=1e-9)
        np.testing.assert_allclose(placed.rotation, hand.rotation[i], atol=1e-9)


def test_joint_velocity_obeys_the_law_with_the_projects_own_jacobian(reaching, person):
    motion, truth = reaching.motion, reaching.truth
    chain = Chain(person, _HAND)
    np.testing.assert_array_equal(np.sort(chain.dof_indices), truth.dof)
    q, qdot = motion.joint_angles[:, chain.dof_indices], motion.joint_rates[:, chain.dof_indices]
    J = chain.jacobian(q)
    W = truth.operator.mobility[chain.dof_indices]
    z = truth.null_velocity(motion) + truth.noise
    z = z[:, np.argsort(np.argsort(chain.dof_indices))]
    JW = J * W
    inverse = np.swapaxes(np.linalg.solve(JW @ np.swapaxes(J, -1, -2), JW), -1, -2)
    twist = truth.hands[_HAND].twist
    law = np.einsum("tij,tj->ti", inverse, twist) + z
    law -= np.einsum("tij,tj->ti", inverse @ J, z)
    np.testing.assert_allclose(qdot, law, atol=1e-9)
    np.testing.assert_allclose(np.einsum("tij,tj->ti", J, qdot), twist, atol=1e-10)


def test_velocity_integrates_to_posture_and_acceleration_to_velocity(reaching):
    motion = reaching.motion
    assert _integral_error(motion) < 5e-6
    h = motion.time_s[1]
    change = (motion.v[2:] - motion.v[:-2]) / (2 * h)
    mean = (motion.a[2:] + 4 * motion.a[1:-1] + motion.a[:-2]) / 6
    assert np.sqrt(np.mean((change - mean) ** 2)) < 0.01 * np.sqrt(np.mean(motion.a**2))


def test_everyone_stays_within_the_joint_limits_and_stands_still(reaching, person):
    q = reaching.motion.joint_angles
    assert np.all((q >= person.lower) & (q <= person.upper))
    assert np.ptp(reaching.motion.q[:, :7], axis=0).max() == 0.0
    assert reaching.truth.contact_right.all()
    assert reaching.truth.contact_left.all()


def test_movements_are_numbered_and_bring_the_hand_back(reaching):
    truth, hand = reaching.truth, reaching.truth.hands[_HAND]
    assert set(truth.segment_id) == {-1, 0, 1, 2}
    home = hand.position[0]
    resting = hand.position[truth.segment_id == -1]
    np.testing.assert_allclose(resting, np.tile(home, (len(resting), 1)), atol=1e-12)
    for k in range(3):
        away = np.linalg.norm(hand.position[truth.segment_id == k] - home, axis=1)
        assert 0.15 < away.max() < 0.7


def test_ground_carries_weight_and_every_change_of_momentum(reaching, person):
    motion, dynamics = reaching.motion, reaching.truth.dynamics
    model, data = person.pinocchio(), person.pinocchio().createData()
    for i in range(0, len(motion), 25):
        q, v, a = motion.q[i], motion.v[i], motion.a[i]
        pin.centerOfMass(model, data, q, v, a)
        force = person.total_mass_kg * (data.acom[0] - model.gravity.linear)
        np.testing.assert_allclose(dynamics.ground[i, :3], force, atol=1e-8)
        pin.computeCentroidalMomentumTimeVariation(model, data, q, v, a)
        about_com = dynamics.ground[i, 3:] - np.cross(data.com[0], dynamics.ground[i, :3])
        np.testing.assert_allclose(about_com, data.dhg.angular, atol=1e-8)
    np.testing.assert_allclose(dynamics.effort[:, :6], 0.0, atol=1e-9)
    np.testing.assert_allclose(dynamics.feet.sum(axis=0), dynamics.ground, atol=1e-9)


def test_each_kind_of_person_answers_the_same_robot_with_another_posture(person):
    postures = []
    for kind in ("stooper", "arm-reacher"):
        one = operator(kind, np.random.default_rng(0), person, spread=0.0, noise=0.0)
        q = standing_configuration(person, one)
        data = person.pinocchio().createData()
        pin.framesForwardKinematics(person.pinocchio(), data, q)
        hand = data.oMf[person.pinocchio().getFrameId(_HAND)]
        goal = hand.translation + np.array([0.25, 0.05, -0.15])
        path = minimum_jerk_path([0, 2], [hand.translation, goal], hand.rotation)
        led = simulate_following(person, one, path, np.random.default_rng(0), rate_hz=30)
        postures.append(led.motion.joint_angles[-1])
    bend = [person.dof_names.index(f"{j}_roty") for j in ("jL5S1", "jL4L3", "jL1T12", "jT9T8")]
    stooper, reacher = (np.rad2deg(p[bend].sum()) for p in postures)
    assert stooper > reacher + 10.0


def test_a_load_in_the_hand_is_felt(person, average):
    q = standing_configuration(person, average)
    data = person.pinocchio().createData()
    pin.framesForwardKinematics(person.pinocchio(), data, q)
    hand = data.oMf[person.pinocchio().getFrameId(_HAND)]
    path = minimum_jerk_path([0, 1], [hand.translation, hand.translation + 0.1], hand.rotation)
    loaded, empty = (
        simulate_following(person, average, path, np.random.default_rng(0), load_kg=m, rate_hz=20)
        for m in (5.0, 0.0)
    )
    np.testing.assert_array_equal(loaded.motion.q, empty.motion.q)
    more = loaded.truth.dynamics.ground - empty.truth.dynamics.ground
    # Another route to the same: the load as a part of the hand's inertia.
    model = person.pinocchio().copy()
    frame = model.frames[model.getFrameId(_HAND)]
    point = pin.Inertia(5.0, np.zeros(3), np.zeros((3, 3)))
    model.inertias[frame.parentJoint] += frame.placement.act(point)
    heavy = model.createData()
    motion = loaded.motion
    for i in range(len(motion)):
        tau = pin.rnea(model, heavy, motion.q[i], motion.v[i], motion.a[i])
        np.testing.assert_allclose(loaded.truth.dynamics.effort[i, 6:30], tau[6:30], atol=1e-9)
    assert np.mean(more[:, 2]) == pytest.approx(5.0 * 9.81, rel=0.02)


def test_seeds_repeat_and_targets_out_of_reach_are_refused(person, average):
    one, two = (
        simulate_reaching(person, average, np.random.default_rng(3), movements=1, rate_hz=20)
        for _ in range(2)
    )
    np.testing.assert_array_equal(one.motion.q, two.motion.q)
    far = [(np.array([2.0, 0.0, 1.0]), np.eye(3))]
    with pytest.raises(SimulationError, match=r"not reached|beyond its limit"):
        simulate_reaching(person, average, np.random.default_rng(0), targets=far)
    with pytest.raises(SimulationError, match="'right' or 'left'"):
        simulate_reaching(person, average, np.random.default_rng(0), hand="Right")


def test_the_left_hand_can_be_led_too(person, average):
    led = simulate_reaching(
        person, average, np.random.default_rng(0), movements=1, hand="left", rate_hz=20
    )
    names = [person.dof_names[i] for i in led.truth.dof]
    assert len(names) == 24
    assert not any("Right" in name for name in names)
    assert list(led.truth.hands) == ["LeftHandCOM"]
