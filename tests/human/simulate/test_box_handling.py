import numpy as np
import pinocchio as pin
import pytest

from human import Chain, forward_kinematics
from human.simulate import (
    SimulationError,
    Stance,
    Station,
    operator,
    simulate_box_handling,
)
from human.simulate.legs import legs_of

_LOW_TO_TABLE = (Station((0.42, 0.0, 0.3)), Station((0.42, 0.1, 0.95)))


def _handle(person, kind, stations=_LOW_TO_TABLE, **settings):
    one = operator(kind, np.random.default_rng(0), person, spread=0.0)
    settings = {"rate_hz": 50.0, **settings}
    return simulate_box_handling(
        person, one, np.random.default_rng(1), stations=stations, **settings
    )


@pytest.fixture(scope="module")
def carried(person):
    return _carry(person)


def _carry(person):
    """With steps between the stations, and one hand."""
    stations = (Station((0.42, -0.1, 0.5)), Station((0.9, 0.5, 0.9), Stance(0.9, 0.1, np.pi / 2)))
    return _handle(person, "average", stations, hands="right", box_kg=4.0)


def test_the_box_goes_from_station_to_station_with_both_hands_on_it(person):
    simulated = _handle(person, "average")
    truth, motion = simulated.truth, simulated.motion
    right, left = (truth.hands[f"{side}HandCOM"] for side in ("Right", "Left"))
    middle = 0.5 * (right.position + left.position)
    loaded = truth.load_kg["RightHandCOM"] > 0.0
    np.testing.assert_allclose(middle[loaded][0], _LOW_TO_TABLE[0].box, atol=2e-3)
    np.testing.assert_allclose(middle[loaded][-1], _LOW_TO_TABLE[1].box, atol=2e-3)
    apart = np.linalg.norm(right.position - left.position, axis=1)[loaded]
    np.testing.assert_allclose(apart, 0.36, atol=1e-9)
    assert truth.load_kg["RightHandCOM"].max() == pytest.approx(2.5)
    data = person.pinocchio().createData()
    for i in range(0, len(motion), 20):
        pin.framesForwardKinematics(person.pinocchio(), data, motion.q[i])
        for tip, hand in truth.hands.items():
            placed = data.oMf[person.pinocchio().getFrameId(tip)]
            np.testing.assert_allclose(placed.translation, hand.position[i], atol=1e-9)
            np.testing.assert_allclose(placed.rotation, hand.rotation[i], atol=1e-9)


def test_with_one_hand_the_law_holds_in_the_moving_axes_of_the_pelvis(carried, person):
    motion, truth = carried.motion, carried.truth
    chain = Chain(person, "RightHandCOM")
    np.testing.assert_array_equal(chain.dof_indices, truth.dof)
    q, qdot = motion.joint_angles[:, truth.dof], motion.joint_rates[:, truth.dof]
    J = chain.jacobian(q)
    z = truth.null_velocity(motion) + truth.noise
    xdot = np.einsum("tij,tj->ti", J, qdot)
    JW = J * truth.mobility
    inverse = np.swapaxes(np.linalg.solve(JW @ np.swapaxes(J, -1, -2), JW), -1, -2)
    law = z + np.einsum("tij,tj->ti", inverse, xdot - np.einsum("tij,tj->ti", J, z))
    np.testing.assert_allclose(qdot, law, atol=1e-8)
    # That hand velocity in pelvis axes is the world's, seen from the moving pelvis.
    poses = forward_kinematics(person, motion.q)
    R, p = poses.of("Pelvis")
    hand = truth.hands["RightHandCOM"]
    v, w = motion.v[:, :3], motion.v[:, 3:6]
    arm = np.einsum("tji,tj->ti", R, hand.position - p)
    seen = np.einsum("tji,tj->ti", R, hand.linear) - v - np.cross(w, arm)
    np.testing.assert_allclose(xdot[:, :3], seen, atol=1e-8)


def test_feet_hold_still_and_bear_body_and_box(carried, person):
    motion, truth = carried.motion, carried.truth
    poses = forward_kinematics(person, motion.q)
    pressure = truth.dynamics.center_of_pressure
    floor = np.column_stack((pressure, np.zeros(len(pressure))))
    inside = np.zeros(len(motion), dtype=bool)
    for leg, stand in zip(legs_of(person), (truth.contact_right, truth.contact_left), strict=True):
        R, p = poses.of(f"{leg.side}Foot")
        resting = stand[1:] & stand[:-1]
        assert np.abs(np.diff(p, axis=0)[resting]).max() < 1e-9
        seen = np.einsum("tji,tj->ti", R, floor - p)
        along = (seen[:, 0] > leg.heel) & (seen[:, 0] < leg.toe)
        inside |= stand & along & (np.abs(seen[:, 1]) < leg.half_width)
    single = truth.contact_right ^ truth.contact_left
    assert single.any()
    assert np.all(inside[single])
    both = truth.contact_right & truth.contact_left
    assert np.all(np.abs(np.diff(truth.dynamics.ground[:, 2])) < 200.0)
    model, data = person.pinocchio(), person.pinocchio().createData()
    for i in np.flatnonzero(both)[::50]:
        pin.centerOfMass(model, data, motion.q[i], motion.v[i], motion.a[i])
        force = person.total_mass_kg * (data.acom[0] - model.gravity.linear)
        load = truth.dynamics.hands["RightHandCOM"][i]
        np.testing.assert_allclose(truth.dynamics.ground[i, :3] + load, force, atol=1e-7)
    np.testing.assert_allclose(truth.dynamics.effort[:, :6], 0.0, atol=1e-8)


def test_phases_follow_one_another(carried):
    ids = carried.truth.segment_id
    assert list(dict.fromkeys(ids[ids >= 0])) == [0, 1, 2, 3, 4]
    loaded = carried.truth.load_kg["RightHandCOM"] > 0.0
    assert loaded[(ids >= 1) & (ids <= 3)].all()
    assert not loaded[(ids == 0) | (ids == 4)].any()


def test_stoopers_bend_their_backs_and_squatters_their_knees(person):
    knee, back = {}, {}
    for kind in ("stooper", "squatter"):
        motion = _handle(person, kind).motion
        knee[kind] = motion.joint_angles[:, person.dof_names.index("jRightKnee_roty")].max()
        up = forward_kinematics(person, motion.q).of("T8")[0][:, :, 2]
        back[kind] = np.arccos(up[:, 2]).max()
    assert np.rad2deg(knee["squatter"] - knee["stooper"]) > 30.0
    assert np.rad2deg(back["stooper"] - back["squatter"]) > 20.0


def test_seeds_repeat(carried, person):
    np.testing.assert_array_equal(_carry(person).motion.q, carried.motion.q)


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"stations": (Station((0.4, 0, 1)),)}, "two or more stations"),
        ({"hands": "left"}, "'both' or 'right'"),
        ({"stations": (Station((2.5, 0, 1)), Station((0.4, 0, 1)))}, "not reached|beyond"),
    ],
)
def test_impossible_tasks_are_refused(person, average, settings, word):
    with pytest.raises(SimulationError, match=word):
        simulate_box_handling(person, average, np.random.default_rng(0), **settings)
