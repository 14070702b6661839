import numpy as np
import pytest

from human import UnknownNameError, forward_kinematics
from human.rotations import (
    matrix_to_rotation_vector,
    quaternion_to_matrix,
    rotation_vector_to_matrix,
)
from human.simulate import (
    IMU_SEGMENTS,
    Dropouts,
    ImuMount,
    ImuNoise,
    SensorNoise,
    Stance,
    imu_mounts,
    simulate_imus,
    simulate_still,
    simulate_walking,
)


@pytest.fixture(scope="module")
def motion(person, average):
    route = (Stance(), Stance(0.5, 0.1, 0.3))
    walk = simulate_walking(person, average, np.random.default_rng(0), route=route, rate_hz=200)
    return walk.motion


@pytest.fixture(scope="module")
def mounts(person):
    return imu_mounts(person, np.random.default_rng(1))


@pytest.fixture(scope="module")
def readings(person, motion, mounts):
    return simulate_imus(person, motion, mounts, np.random.default_rng(0))


def test_a_suit_has_seventeen_sensors(mounts):
    assert len(mounts) == len(set(IMU_SEGMENTS)) == 17
    assert [mount.segment for mount in mounts] == list(IMU_SEGMENTS)


def test_accelerometers_feel_the_second_derivative_of_where_they_are_and_gravity(
    person, motion, readings
):
    poses = forward_kinematics(person, motion.q)
    h = motion.time_s[1]
    for reading in readings:
        R, p = poses.of(reading.mount.segment)
        at = p + R @ reading.mount.position
        second = (at[2:] - 2.0 * at[1:-1] + at[:-2]) / h**2
        felt = second + np.array([0.0, 0.0, 9.81])
        R_sensor = R[1:-1] @ reading.mount.rotation
        expected = np.einsum("tji,tj->ti", R_sensor, felt)
        error = np.abs(reading.acceleration[1:-1] - expected).max(axis=1)
        # Jerk jumps where a step begins or ends, and the difference smears it.
        assert np.quantile(error, 0.9) < 0.05
        assert np.abs(expected - reading.acceleration.mean(axis=0)).max() > 0.3


def test_gyroscopes_and_attitudes_follow_the_segments(person, motion, readings):
    poses = forward_kinematics(person, motion.q)
    h = motion.time_s[1]
    for reading in readings:
        R, _ = poses.of(reading.mount.segment)
        R_sensor = R @ reading.mount.rotation
        np.testing.assert_allclose(
            quaternion_to_matrix(reading.orientation_xyzw), R_sensor, atol=1e-12
        )
        turned = matrix_to_rotation_vector(R_sensor[:-2].swapaxes(-1, -2) @ R_sensor[2:])
        error = np.abs(reading.angular_velocity[1:-1] - turned / (2.0 * h)).max(axis=1)
        assert np.quantile(error, 0.95) < 0.01


def test_at_rest_a_sensor_feels_the_floor_push_up(person, average):
    still = simulate_still(person, average, duration_s=0.05).motion
    mount = ImuMount("T8", np.zeros(3), rotation_vector_to_matrix(np.array([0.0, np.pi / 2, 0.0])))
    (reading,) = simulate_imus(person, still, [mount], np.random.default_rng(0))
    np.testing.assert_allclose(reading.acceleration, [[-9.81, 0.0, 0.0]] * 6, atol=1e-9)
    np.testing.assert_allclose(reading.angular_velocity, 0.0, atol=1e-12)


def test_noise_bias_and_dropouts_are_as_stated(person, average, mounts):
    still = simulate_still(person, average, duration_s=24.0, rate_hz=40).motion
    noise = ImuNoise(
        accelerometer=SensorNoise(sd=0.033, offset_sd=0.1),
        gyroscope=SensorNoise(sd=0.005, offset_sd=0.01),
        orientation=SensorNoise(sd=0.01),
        dropouts=Dropouts(per_s=0.5, mean_s=0.3),
    )
    some = mounts[:5]
    exact = simulate_imus(person, still, some, np.random.default_rng(2))
    noisy, again = (
        simulate_imus(person, still, some, np.random.default_rng(2), noise=noise) for _ in range(2)
    )
    offsets = np.array([reading.acceleration_offset for reading in noisy])
    assert 0.04 < offsets.std() < 0.2
    for true, reading, same in zip(exact, noisy, again, strict=True):
        np.testing.assert_array_equal(reading.acceleration, same.acceleration)
        here = reading.received
        assert 0.7 < here.mean() < 1.0
        felt = (reading.acceleration - true.acceleration)[here]
        np.testing.assert_allclose(felt.std(axis=0), 0.033, rtol=0.1)
        np.testing.assert_allclose(felt.mean(axis=0), reading.acceleration_offset, atol=0.005)
        turned = (reading.angular_velocity - true.angular_velocity)[here]
        np.testing.assert_allclose(turned.std(axis=0), 0.005, rtol=0.1)
        error = matrix_to_rotation_vector(
            quaternion_to_matrix(true.orientation_xyzw).swapaxes(-1, -2)
            @ quaternion_to_matrix(reading.orientation_xyzw)
        )[here]
        np.testing.assert_allclose(error.std(axis=0), 0.01, rtol=0.1)
        for i in np.flatnonzero(~here):
            np.testing.assert_array_equal(reading.acceleration[i], reading.acceleration[i - 1])


def test_unknown_segments_are_refused(person, motion):
    mount = ImuMount("Tail", np.zeros(3), np.eye(3))
    with pytest.raises(UnknownNameError, match="Tail"):
        simulate_imus(person, motion, [mount], np.random.default_rng(0))
