import numpy as np
import pinocchio as pin
import pytest

from human import Subject, forward_kinematics, generate_model
from human.simulate import SimulationError, Stance, operator, simulate_walking
from human.simulate.legs import legs_of


@pytest.fixture(scope="module")
def walk(person, average):
    route = (Stance(), Stance(x=1.5), Stance(1.8, 0.2, 0.9))
    return simulate_walking(
        person, average, np.random.default_rng(0), route=route, load_kg=6.0, rate_hz=60
    )


def _soles(model, simulated):
    """Yields each leg with the center of pressure seen from its foot, and whether it stands."""
    poses = forward_kinematics(model, simulated.motion.q)
    truth = simulated.truth
    pressure = truth.dynamics.center_of_pressure
    floor = np.column_stack((pressure, np.zeros(len(pressure))))
    stands = (truth.contact_right, truth.contact_left)
    for leg, stand in zip(legs_of(model), stands, strict=True):
        R, p = poses.of(f"{leg.side}Foot")
        yield leg, np.einsum("tji,tj->ti", R, floor - p), p, stand


def test_standing_feet_do_not_move_and_never_leave_the_floor(walk, person):
    for leg, _, ankle, stand in _soles(person, walk):
        edges = np.flatnonzero(np.diff(stand.astype(int))) + 1
        for piece in np.split(np.arange(len(stand)), edges):
            if stand[piece[0]]:
                assert np.ptp(ankle[piece], axis=0).max() < 1e-9
                np.testing.assert_allclose(ankle[piece, 2], leg.sole, atol=1e-9)
            else:
                assert ankle[piece, 2].min() > leg.sole - 1e-9


def test_the_ground_pushes_from_where_a_foot_stands(walk, person):
    inside = np.zeros(len(walk.motion), dtype=bool)
    for leg, pressure, _, stand in _soles(person, walk):
        along = (pressure[:, 0] > leg.heel) & (pressure[:, 0] < leg.toe)
        inside |= stand & along & (np.abs(pressure[:, 1]) < leg.half_width)
    single = walk.truth.contact_right ^ walk.truth.contact_left
    assert 0.3 < single.mean() < 0.8
    assert np.all(inside[single])
    vertical = walk.truth.dynamics.ground[:, 2]
    weight = (person.total_mass_kg + 6.0) * 9.81
    assert vertical.min() > 0.5 * weight
    assert vertical.max() < 1.6 * weight
    assert vertical.mean() == pytest.approx(weight, rel=0.01)


def test_each_foot_bears_its_part_and_a_lifted_one_none(walk):
    truth = walk.truth
    right, left = truth.dynamics.feet
    np.testing.assert_allclose(right + left, truth.dynamics.ground, atol=1e-9)
    np.testing.assert_array_equal(right[~truth.contact_right], 0.0)
    np.testing.assert_array_equal(left[~truth.contact_left], 0.0)
    assert np.all(right[:, 2] >= 0.0)
    assert np.all(left[:, 2] >= 0.0)
    # With the feet bearing all, nothing is left for the base to bear.
    np.testing.assert_allclose(truth.dynamics.effort[:, :6], 0.0, atol=1e-8)


def test_ground_reaction_is_the_rate_of_momentum_of_body_and_load(walk, person):
    model, data = person.pinocchio(), person.pinocchio().createData()
    motion, dynamics = walk.motion, walk.truth.dynamics
    for i in range(0, len(motion), 40):
        pin.centerOfMass(model, data, motion.q[i], motion.v[i], motion.a[i])
        force = person.total_mass_kg * (data.acom[0] - model.gravity.linear)
        load = sum(hand[i] for hand in dynamics.hands.values())
        np.testing.assert_allclose(dynamics.ground[i, :3] + load, force, atol=1e-7)


def test_velocity_and_acceleration_are_derivatives_of_the_motion(walk, person):
    motion, model = walk.motion, person.pinocchio()
    h = motion.time_s[1]
    for i in range(1, len(motion), 7):
        # Simpson over one step from both ends' derivatives (Euler-Maclaurin end correction).
        step = 0.5 * h * (motion.v[i - 1] + motion.v[i])
        step += h * h / 12.0 * (motion.a[i - 1] - motion.a[i])
        found = pin.difference(model, motion.q[i - 1], motion.q[i])
        np.testing.assert_allclose(found, step, atol=2e-4)


def test_arms_swing_against_the_legs(person, average):
    calm = operator("average", np.random.default_rng(0), person)
    walk = simulate_walking(person, calm, np.random.default_rng(0), rate_hz=30)
    q = walk.motion.joint_angles
    poses = forward_kinematics(person, walk.motion.q)
    foot_ahead = poses.of("RightFoot")[1][:, 0] - poses.of("LeftFoot")[1][:, 0]
    hand_ahead = poses.of("RightHand")[1][:, 0] - poses.of("LeftHand")[1][:, 0]
    assert np.corrcoef(foot_ahead, hand_ahead)[0, 1] < -0.7
    assert np.all((q >= person.lower) & (q <= person.upper))


@pytest.mark.parametrize("subject", [Subject(1.5, 45, "female"), Subject(1.98, 115, "male")])
def test_short_and_tall_people_walk(subject):
    model = generate_model(subject)
    one = operator("stooper", np.random.default_rng(0), model)
    walk = simulate_walking(
        model, one, np.random.default_rng(0), route=(Stance(), Stance(x=1.2)), rate_hz=25
    )
    assert walk.motion.q[-1, 0] - walk.motion.q[0, 0] == pytest.approx(1.2, abs=0.02)


def test_routes_of_one_place_are_refused(person, average):
    with pytest.raises(SimulationError, match="two or more places"):
        simulate_walking(person, average, np.random.default_rng(0), route=(Stance(),))
