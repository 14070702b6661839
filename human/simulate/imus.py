"""Inertial sensors on a simulated person: what they feel, by Pinocchio, and their errors."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from human.model import HumanModel
from human.motion import Motion
from human.rotations import (
    matrix_to_quaternion,
    quaternion_continuous,
    quaternion_multiply,
    rotation_vector_to_matrix,
    rotation_vector_to_quaternion,
)
from human.simulate.sensor_noise import (
    ALWAYS_THERE,
    PERFECT,
    Dropouts,
    SensorNoise,
    disturbed,
    frames_received,
    held,
)

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Segments that carry a sensor in a full-body suit, 17 of them.
IMU_SEGMENTS = (
    "Pelvis",
    "T8",
    "Head",
    *(
        f"{side}{part}"
        for side in ("Right", "Left")
        for part in (
            "Shoulder",
            "UpperArm",
            "ForeArm",
            "Hand",
            "UpperLeg",
            "LowerLeg",
            "Foot",
        )
    ),
)


@dataclass(frozen=True, slots=True)
class ImuMount:
    """Where a sensor is strapped.

    Attributes:
        segment: to which segment.
        position: in segment axes from its proximal joint, ``3`` [m].
        rotation: sensor axes in the segment's, ``3 x 3``.
    """

    segment: str
    position: Array
    rotation: Array


@dataclass(frozen=True, slots=True)
class ImuNoise:
    """How the sensors err.

    Attributes:
        accelerometer: [m/s^2].
        gyroscope: [rad/s].
        orientation: rotation vector in sensor axes [rad]; its offset is a heading or mounting error
            that stays.
        dropouts: of each sensor on its own, all its channels together.
    """

    accelerometer: SensorNoise = PERFECT
    gyroscope: SensorNoise = PERFECT
    orientation: SensorNoise = PERFECT
    dropouts: Dropouts = ALWAYS_THERE


@dataclass(frozen=True, slots=True)
class ImuReading:
    """What one sensor recorded.

    Attributes:
        mount: where it is.
        acceleration: specific force, ``T x 3`` [m/s^2], sensor axes: 9.81 upwards at rest.
        angular_velocity: ``T x 3`` [rad/s], sensor axes.
        orientation_xyzw: sensor axes in the world, ``T x 4``.
        received: frames that arrived, ``T``; in the others the last one is repeated.
        acceleration_offset: constant error of the accelerometer, ``3``.
        angular_velocity_offset: constant error of the gyroscope, ``3``.
    """

    mount: ImuMount
    acceleration: Array
    angular_velocity: Array
    orientation_xyzw: Array
    received: Mask
    acceleration_offset: Array
    angular_velocity_offset: Array


def imu_mounts(
    model: HumanModel,
    rng: np.random.Generator,
    segments: Sequence[str] = IMU_SEGMENTS,
    *,
    radius_m: float = 0.06,
) -> tuple[ImuMount, ...]:
    """Straps sensors on, turned at random, around the segments' centres of mass.

    Args:
        model: the person.
        rng: source of all randomness.
        segments: which ones carry a sensor.
        radius_m: distance of the sensors from the centre of mass.

    Raises:
        human.UnknownNameError: the model has no such segment.
    """
    mounts = []
    for segment in segments:
        center = model.centers_of_mass[model.segment_index(segment)]
        way = rng.normal(size=3)
        turn = rng.normal(size=3)
        place = center + radius_m * way / np.linalg.norm(way)
        mounts.append(ImuMount(segment, place, rotation_vector_to_matrix(turn)))
    return tuple(mounts)


def simulate_imus(
    model: HumanModel,
    motion: Motion,
    mounts: Sequence[ImuMount],
    rng: np.random.Generator,
    *,
    noise: ImuNoise | None = None,
) -> tuple[ImuReading, ...]:
    """Records what sensors on the segments feel of a motion.

    Args:
        model: the person.
        motion: what they do, with exact velocities and accelerations.
        mounts: where the sensors are.
        rng: source of all randomness.
        noise: how they err; not at all if not given.

    Raises:
        human.UnknownNameError: the model has no such segment.
    """
    noise = noise or ImuNoise()
    pin_model = model.pinocchio().copy()
    frames = []
    for k, mount in enumerate(mounts):
        model.segment_index(mount.segment)
        holder = pin_model.frames[pin_model.getFrameId(mount.segment)]
        placement = holder.placement * pin.SE3(mount.rotation, mount.position)
        frame = pin.Frame(f"imu {k}", holder.parentJoint, 0, placement, pin.FrameType.SENSOR)
        frames.append(pin_model.addFrame(frame))
    data = pin_model.createData()
    shape = (len(mounts), len(motion), 3)
    force, turning, rotation = np.empty(shape), np.empty(shape), np.empty((*shape, 3))
    for i in range(len(motion)):
        pin.forwardKinematics(pin_model, data, motion.q[i], motion.v[i], motion.a[i])
        for k, frame in enumerate(frames):
            R = pin.updateFramePlacement(pin_model, data, frame).rotation
            change = pin.getFrameClassicalAcceleration(pin_model, data, frame, pin.LOCAL).linear
            force[k, i] = change - R.T @ pin_model.gravity.linear
            turning[k, i] = pin.getFrameVelocity(pin_model, data, frame, pin.LOCAL).angular
            rotation[k, i] = R
    readings = []
    for k, mount in enumerate(mounts):
        received = frames_received(motion.time_s, noise.dropouts, rng)
        felt, felt_offset = disturbed(force[k], noise.accelerometer, rng)
        turned, turned_offset = disturbed(turning[k], noise.gyroscope, rng)
        error, _ = disturbed(np.zeros_like(felt), noise.orientation, rng)
        attitude = quaternion_multiply(
            matrix_to_quaternion(rotation[k]), rotation_vector_to_quaternion(error)
        )
        readings.append(
            ImuReading(
                mount=mount,
                acceleration=held(felt, received),
                angular_velocity=held(turned, received),
                orientation_xyzw=held(quaternion_continuous(attitude), received),
                received=received,
                acceleration_offset=felt_offset,
                angular_velocity_offset=turned_offset,
            )
        )
    return tuple(readings)
