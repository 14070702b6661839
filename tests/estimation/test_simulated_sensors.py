"""Sensors to contacts, base velocity and placement: the pieces together, on simulated hardware."""

import numpy as np

from estimation import (
    Contact,
    ContactDetector,
    LinkMotion,
    base_velocity,
    place_imu,
    sole_motion,
)
from human import forward_kinematics
from human.rotations import quaternion_to_matrix
from human.simulate import (
    Dropouts,
    ImuNoise,
    SensorNoise,
    imu_mounts,
    shoe_sensors,
    simulate_imus,
    simulate_shoes,
)


def test_shoes_with_lost_frames_lead_to_the_speed_of_the_pelvis(person, walk):
    rng = np.random.default_rng(8)
    motion, truth = walk.motion, walk.truth
    readings = simulate_shoes(
        person,
        walk,
        shoe_sensors(person),
        rng,
        noise=SensorNoise(sd=(1.0, 1.0, 1.0, 0.15, 0.15, 0.15)),
        dropouts=Dropouts(per_s=0.2, mean_s=0.05),
    )
    poses = forward_kinematics(person, motion.q)
    vertical, there = np.zeros((len(motion), 2)), np.ones((len(motion), 2), dtype=bool)
    for reading in readings:
        foot = ("RightFoot", "LeftFoot").index(reading.sensor.segment)
        up = poses.of(reading.sensor.segment)[0][:, 2, :] @ reading.sensor.rotation
        vertical[:, foot] += np.sum(up * reading.wrench[:, :3], axis=1)
        there[:, foot] &= reading.received
    assert not there.all()
    weight_n = 9.81 * (person.total_mass_kg + 8.0)
    found = ContactDetector(weight_n).classify(
        vertical_n=vertical,
        force_valid=there,
        feet=sole_motion(person, motion.q, motion.v, motion.a),
    )
    rest = np.stack([truth.contact_right, truth.contact_left], axis=-1)
    assert np.all(found.feet == rest, axis=1).mean() >= 0.98

    rates = motion.joint_rates + rng.normal(scale=0.02, size=motion.joint_rates.shape)
    feet = [Contact("RightFoot", active=found.right), Contact("LeftFoot", active=found.left)]
    moved = base_velocity(person, motion.q, rates, feet)
    error = moved.twist_body[:, :3] - motion.v[:, :3]
    assert np.sqrt(np.mean(error**2)) < 0.05
    assert np.linalg.norm(motion.v[:, :3], axis=1).max() > 0.5
    # The residual says how still the feet were: as still as the rates are exact.
    slip = np.linalg.norm(moved.slip[:, :, :3], axis=-1)
    assert np.median(slip[found.feet]) < 0.05


def test_a_suit_whose_sensors_were_strapped_on_anyhow_is_placed(person, walk):
    rng = np.random.default_rng(9)
    motion = walk.motion
    noise = ImuNoise(accelerometer=SensorNoise(sd=0.033, offset_sd=0.02))
    segments = ("RightForeArm", "LeftForeArm", "RightLowerLeg", "LeftLowerLeg")
    mounts = imu_mounts(person, rng, segments)
    exact = simulate_imus(
        person,
        motion,
        [type(m)(m.segment, np.zeros(3), np.eye(3)) for m in mounts],
        np.random.default_rng(0),
    )
    for mount, origin, reading in zip(
        mounts, exact, simulate_imus(person, motion, mounts, rng, noise=noise), strict=True
    ):
        # A sensor without error at the link's origin stands for what the suit says of the link.
        R = quaternion_to_matrix(origin.orientation_xyzw)
        omega = np.einsum("tij,tj->ti", R, origin.angular_velocity)
        acceleration = np.einsum("tij,tj->ti", R, origin.acceleration) - [0.0, 0.0, 9.81]
        alpha = np.gradient(omega, motion.time_s, axis=0, edge_order=2)
        link = LinkMotion(R, omega, alpha, acceleration)
        attitude = quaternion_to_matrix(reading.orientation_xyzw)
        found = place_imu(
            link, reading.acceleration, attitude, estimate_bias=True, least_excitation_per_s2=0.2
        )
        assert np.abs(found.position - mount.position).max() < 0.02
        np.testing.assert_allclose(found.bias, reading.acceleration_offset, atol=0.02)
