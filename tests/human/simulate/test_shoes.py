from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from human import Wrench, frame_poses, inverse_dynamics
from human.kinematics import forward_kinematics
from human.simulate import (
    Dropouts,
    SensorNoise,
    SimulationError,
    Stance,
    shoe_sensors,
    simulate_shoes,
    simulate_walking,
)


@pytest.fixture(scope="module")
def walk(person, average):
    route = (Stance(), Stance(1.0, 0.2, 0.4))
    return simulate_walking(
        person, average, np.random.default_rng(0), route=route, load_kg=4.0, rate_hz=50
    )


def in_world(person, motion, reading):
    """Force (T, 3), moment about the world origin (T, 3) and origin (T, 3), by Pinocchio."""
    model, data, sensor = person.pinocchio(), person.pinocchio().createData(), reading.sensor
    frame = model.getFrameId(sensor.segment)
    out = np.empty((len(motion), 9))
    for i in range(len(motion)):
        pin.framesForwardKinematics(model, data, motion.q[i])
        place = data.oMf[frame] * pin.SE3(sensor.rotation, sensor.position)
        wrench = place.act(pin.Force(reading.wrench[i]))
        out[i] = np.r_[wrench.linear, wrench.angular, place.translation]
    return out[:, :3], out[:, 3:6], out[:, 6:]


@pytest.mark.parametrize("per_foot", [1, 2, 3])
def test_the_sensors_of_a_foot_bear_all_of_it(person, walk, per_foot):
    sensors = shoe_sensors(person, per_foot)
    readings = simulate_shoes(person, walk, sensors, np.random.default_rng(0))
    assert len({sensor.name for sensor in sensors}) == 2 * per_foot
    for foot, side in zip(walk.truth.dynamics.feet, ("RightFoot", "LeftFoot"), strict=True):
        parts = [in_world(person, walk.motion, r) for r in readings if r.sensor.segment == side]
        np.testing.assert_allclose(sum(part[0] for part in parts), foot[:, :3], atol=1e-9)
        np.testing.assert_allclose(sum(part[1] for part in parts), foot[:, 3:], atol=1e-8)
        # Soles push: no sensor pulls the foot down.
        assert min(part[0][:, 2].min() for part in parts) >= 0.0
        if per_foot > 1:
            assert all(part[0][:, 2].max() > 100.0 for part in parts)


def test_shoes_and_loads_leave_the_base_nothing_to_bear(person, walk):
    readings = simulate_shoes(person, walk, shoe_sensors(person), np.random.default_rng(0))
    motion, hands = walk.motion, walk.truth.dynamics.hands
    poses = forward_kinematics(person, motion.q)
    wrenches = [Wrench(name, force) for name, force in hands.items()]
    for reading in readings:
        force, moment, _ = in_world(person, motion, reading)
        _, ankle = frame_poses(person, poses, reading.sensor.segment)
        wrenches.append(Wrench(reading.sensor.segment, force, moment - np.cross(ankle, force)))
    effort = inverse_dynamics(person, motion.q, motion.v, motion.a, wrenches)
    np.testing.assert_allclose(effort[:, :6], 0.0, atol=1e-8)
    np.testing.assert_allclose(effort, walk.truth.dynamics.effort, atol=1e-7)


def test_the_weight_goes_to_the_sensor_it_is_over(person, walk):
    heel, toe = simulate_shoes(person, walk, shoe_sensors(person)[:2], np.random.default_rng(0))
    (f_heel, _, at_heel), (f_toe, _, at_toe) = (
        in_world(person, walk.motion, reading) for reading in (heel, toe)
    )
    foot = walk.truth.dynamics.feet[0]
    both = (f_heel[:, 2] > 5.0) & (f_toe[:, 2] > 5.0)
    assert both.mean() > 0.2
    share = f_toe[both, 2] / foot[both, 2]
    weighted = (1.0 - share)[:, None] * at_heel[both] + share[:, None] * at_toe[both]
    # At the height of the sensors, in line with the sole, the pressure is where the shares say.
    height = weighted[:, 2]
    x = (height * foot[both, 0] - foot[both, 4]) / foot[both, 2]
    y = (height * foot[both, 1] + foot[both, 3]) / foot[both, 2]
    line = (at_toe - at_heel)[both, :2]
    off = (np.stack((x, y), axis=-1) - weighted[:, :2]) * line
    np.testing.assert_allclose(off.sum(axis=1), 0.0, atol=1e-9)


def test_sensors_stand_in_different_frames_and_err_on_their_own(person, walk):
    sensors = shoe_sensors(person, 3)
    turns = [sensor.rotation for sensor in sensors[:3]]
    assert np.abs(turns[0] - turns[1]).max() > 0.1
    assert np.abs(turns[1] - turns[2]).max() > 0.1
    rng = np.random.default_rng(0)
    exact = simulate_shoes(person, walk, sensors, rng)
    noise = SensorNoise(sd=(1, 1, 1, 0.15, 0.15, 0.15), offset_sd=2.0)
    noisy = simulate_shoes(
        person, walk, sensors, rng, noise=noise, dropouts=Dropouts(per_s=1.0, mean_s=0.1)
    )
    errors = [n.wrench - e.wrench - n.offset for n, e in zip(noisy, exact, strict=True)]
    for reading, error in zip(noisy, errors, strict=True):
        sd = error[reading.received].std(axis=0)
        np.testing.assert_allclose(sd, noise.sd, rtol=0.2)
        assert 0.7 < reading.received.mean() < 1.0
    both = noisy[0].received & noisy[1].received
    assert abs(np.corrcoef(errors[0][both, 2], errors[1][both, 2])[0, 1]) < 0.25


def test_what_no_shoe_can_be_is_refused(person, walk):
    sensors, rng = shoe_sensors(person), np.random.default_rng(0)
    with pytest.raises(SimulationError, match="1, 2 or 3"):
        shoe_sensors(person, 4)
    with pytest.raises(SimulationError, match="Strap"):
        stray = replace(sensors[0], name="Strap", segment="RightHand")
        simulate_shoes(person, walk, [*sensors, stray], rng)
    with pytest.raises(SimulationError, match="different names"):
        simulate_shoes(person, walk, [sensors[0], sensors[0]], rng)
    no_feet = replace(walk.truth, dynamics=replace(walk.truth.dynamics, feet=None))
    with pytest.raises(SimulationError, match="without feet"):
        simulate_shoes(person, replace(walk, truth=no_feet), sensors, rng)
