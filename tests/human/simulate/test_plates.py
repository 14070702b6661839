from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from human.simulate import (
    Dropouts,
    SensorNoise,
    SimulationError,
    Stance,
    plate_pair,
    simulate_plates,
    simulate_still,
    simulate_walking,
)

LONG = (8.0, 0.6)


@pytest.fixture(scope="module")
def walk(person, average):
    return simulate_walking(
        person,
        average,
        np.random.default_rng(0),
        route=(Stance(0.2, -0.1, 0.3), Stance(1.4, 0.27, 0.3)),
        load_kg=9.55,
        rate_hz=50,
    )


@pytest.fixture(scope="module")
def treadmill(walk):
    plates = plate_pair(Stance(0.8, 0.08, 0.3), size=LONG, gap_m=0.0)
    return simulate_plates(walk, plates, np.random.default_rng(0))


def test_plates_and_loads_together_are_the_rate_of_momentum(person, walk, treadmill):
    """Newton-Euler of the whole body, by Pinocchio's centroidal dynamics."""
    assert not treadmill.beside.any()
    world = sum(reading.world() for reading in treadmill.readings)
    model, data, motion = person.pinocchio(), person.pinocchio().createData(), walk.motion
    for i in range(0, len(motion), 10):
        q, v, a = motion.q[i], motion.v[i], motion.a[i]
        rate = pin.computeCentroidalMomentumTimeVariation(model, data, q, v, a)
        com = pin.centerOfMass(model, data, q)
        pin.framesForwardKinematics(model, data, q)
        force = world[i, :3] + person.total_mass_kg * model.gravity.linear
        moment = world[i, 3:] - np.cross(com, world[i, :3])
        for name, carried in walk.truth.dynamics.hands.items():
            at = data.oMf[model.getFrameId(name)].translation
            force = force + carried[i]
            moment = moment + np.cross(at - com, carried[i])
        np.testing.assert_allclose(force, rate.linear, atol=1e-8)
        np.testing.assert_allclose(moment, rate.angular, atol=1e-8)


def test_each_plate_bears_the_foot_that_stands_on_it(walk, treadmill):
    for reading, foot in zip(treadmill.readings, walk.truth.dynamics.feet, strict=True):
        np.testing.assert_allclose(reading.world(), foot, atol=1e-9)
    right, left = treadmill.readings
    assert right.wrench[:, 2].min() >= 0.0
    assert left.wrench[:, 2].max() <= 0.0
    assert left.plate.rotation[2, 2] == -1.0


def test_the_center_of_pressure_carries_no_moment_but_the_free_one(walk, treadmill):
    for reading, foot in zip(treadmill.readings, walk.truth.dynamics.feet, strict=True):
        point, loaded = reading.center_of_pressure()
        free = reading.free_moment()
        plate = reading.plate
        at = plate.center + np.column_stack((point, np.zeros(len(point)))) @ plate.rotation.T
        left = foot[:, 3:] - np.cross(at, foot[:, :3])
        turned = free[:, None] * plate.rotation[:, 2]
        np.testing.assert_allclose(left[loaded], turned[loaded], atol=1e-8)
        assert np.abs(free[loaded]).max() > 1.0
        np.testing.assert_array_equal(point[~loaded], 0.0)
        np.testing.assert_array_equal(free[~loaded], 0.0)
        assert 0.4 < loaded.mean() < 0.95


def test_a_foot_beside_the_plates_is_felt_by_none(walk):
    short = plate_pair(Stance(0.2, -0.1, 0.3))
    recording = simulate_plates(walk, short, np.random.default_rng(0))
    assert not recording.beside[:40].any()
    assert recording.beside[-40:].all()
    total = sum(reading.world()[:, 2] for reading in recording.readings)
    np.testing.assert_array_equal(total[-40:], 0.0)
    lacking = np.abs(total - walk.truth.dynamics.ground[:, 2]) > 1e-6
    np.testing.assert_array_equal(lacking, recording.beside)


def test_noise_offset_limit_and_lost_frames(person, average):
    still = simulate_still(person, average, duration_s=30.0)
    noise = SensorNoise(
        sd=(1.0, 1.0, 2.0, 0.1, 0.1, 0.05),
        offset_sd=(3.0, 3.0, 3.0, 0.3, 0.3, 0.3),
    )
    (exact, _), (noisy, _), (again, _), (lossy, _), (full, _) = (
        simulate_plates(still, plate_pair(), np.random.default_rng(4), **given).readings
        for given in (
            {},
            {"noise": noise},
            {"noise": noise},
            {"noise": noise, "dropouts": Dropouts(per_s=0.5, mean_s=0.2)},
            {"noise": SensorNoise(limit=(np.inf, np.inf, 200.0, np.inf, np.inf, np.inf))},
        )
    )
    error = noisy.wrench - exact.wrench
    np.testing.assert_allclose(error.std(axis=0), noise.sd, rtol=0.05)
    np.testing.assert_allclose(error.mean(axis=0), noisy.offset, atol=0.15)
    assert np.abs(noisy.offset[:3]).max() > 0.5
    np.testing.assert_array_equal(noisy.wrench, again.wrench)
    assert noisy.received.all()
    assert 0.82 < lossy.received.mean() < 0.97
    for i in np.flatnonzero(~lossy.received):
        np.testing.assert_array_equal(lossy.wrench[i], lossy.wrench[i - 1])
    assert np.ptp(lossy.wrench[lossy.received, 2]) > 5.0
    np.testing.assert_array_equal(full.wrench[:, 2], 200.0)
    assert exact.wrench[0, 2] > 300.0


def test_standing_with_a_load_weighs_what_it_should(person, average):
    held = simulate_still(person, average, load_kg={"RightHandCOM": 5.0})
    recording = simulate_plates(held, plate_pair(), np.random.default_rng(0))
    weight = sum(reading.world()[:, 2] for reading in recording.readings)
    np.testing.assert_allclose(weight, 9.81 * (person.total_mass_kg + 5.0), rtol=1e-12)
    bare = simulate_still(person, average)
    shoulder = person.dof_names.index("jRightShoulder_rotx")
    hand = person.frames["RightHandCOM"].position
    arm = np.abs(person.offsets[person.joint_names.index("jRightElbow")][1])
    arm += np.abs(person.offsets[person.joint_names.index("jRightWrist")][1]) + np.abs(hand[1])
    more = held.truth.dynamics.effort[0, 6 + shoulder] - bare.truth.dynamics.effort[0, 6 + shoulder]
    assert abs(more) == pytest.approx(5.0 * 9.81 * arm, rel=1e-9)


def test_on_one_foot_the_other_bears_nothing(person, average):
    one = simulate_still(person, average, on_left=False)
    right, left = one.truth.dynamics.feet
    assert np.all(right[:, 2] == pytest.approx(9.81 * person.total_mass_kg))
    np.testing.assert_array_equal(left, 0.0)
    np.testing.assert_allclose(one.truth.dynamics.effort[:, :6], 0.0, atol=1e-9)
    with pytest.raises(SimulationError, match="standing foot"):
        simulate_still(person, average, on_left=False, on_right=False)


@pytest.mark.parametrize("setting", [{"sd": -1.0}, {"offset_sd": np.nan}, {"limit": -1.0}])
def test_impossible_noise_is_refused(setting):
    with pytest.raises(SimulationError, match=next(iter(setting))):
        SensorNoise(**setting)


def test_motions_without_feet_are_refused(walk):
    no_feet = replace(walk.truth, dynamics=replace(walk.truth.dynamics, feet=None))
    with pytest.raises(SimulationError, match="without feet"):
        simulate_plates(replace(walk, truth=no_feet), plate_pair(), np.random.default_rng(0))
