"""What the papers' hardware would read of a simulated motion, as measurements of the estimator.

17 inertial sensors, and shoes or force plates, with noise, an offset drawn once a run and lost
frames. A frame that a sensor lost keeps its last reading with a covariance that says it means
nothing: covariances may change while a run goes on.
"""

from dataclasses import dataclass, replace

import numpy as np

from estimation import Accelerometer, ForceTorque, JointAcceleration, Measurement
from estimation.covariances import TwoStepCovariances
from human import HumanModel, forward_kinematics
from human.simulate import (
    IMU_SEGMENTS,
    Dropouts,
    ImuMount,
    ImuNoise,
    SensorNoise,
    SimulatedMotion,
    imu_mounts,
    plate_pair,
    shoe_sensors,
    simulate_imus,
    simulate_plates,
    simulate_shoes,
)

FEET = ("RightFoot", "LeftFoot")
#: sd of noise and of the constant offset: m/s^2, rad/s^2, N (three times) and N m.
ACCELEROMETER = SensorNoise(sd=0.033, offset_sd=0.01)
JOINT_SD = 0.05
#: Of each of the two sensors in a shoe; together a foot has 1 N and 0.15 N m.
SHOE = SensorNoise(
    sd=tuple(np.array([1.0, 1.0, 1.0, 0.15, 0.15, 0.15]) / np.sqrt(2.0)), offset_sd=0.02
)
PLATE = SensorNoise(sd=(1.0, 1.0, 1.0, 0.15, 0.15, 0.15), offset_sd=0.02)
RADIO = Dropouts(per_s=0.1, mean_s=0.06)
_NONE, ALWAYS = SensorNoise(), Dropouts()
#: Standard deviation of what a sensor says in a frame that never arrived: nothing.
LOST_ACCELERATION, LOST_WRENCH = 30.0, 3e3


@dataclass(frozen=True, slots=True)
class Measured:
    """A motion, what was read of it, and the truth.

    Attributes:
        name: of the task.
        model: the person.
        simulated: the truth; positions and velocities are taken as known, as the papers do.
        sensors: readings with the noise that they have as covariance.
        arrived: ``T`` frames in which no sensor was lost.
        feet_arrived: ``T`` frames in which none of the feet's was.
        acceleration: ``T x nv`` of the motion, with noise: what the rate of momentum is made from.
    """

    name: str
    model: HumanModel
    simulated: SimulatedMotion
    sensors: tuple[Measurement, ...]
    arrived: np.ndarray
    feet_arrived: np.ndarray
    acceleration: np.ndarray

    @property
    def time_s(self) -> np.ndarray:
        """Times of the frames, s."""
        return self.simulated.motion.time_s

    def state(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns positions, velocities and measured accelerations."""
        motion = self.simulated.motion
        assert motion.v is not None
        return motion.q, motion.v, self.acceleration

    def torque(self) -> np.ndarray:
        """Returns the true torques, ``T x n_dof`` N m."""
        return self.simulated.truth.dynamics.effort[:, 6:]


def measured(
    name: str,
    model: HumanModel,
    simulated: SimulatedMotion,
    rng: np.random.Generator,
    *,
    feet: str = "shoes",
    exact: bool = False,
) -> Measured:
    """Reads a motion with ``shoes`` or ``plates``, and 17 inertial sensors.

    The pelvis's sensor sits at the link's origin, so that it and the estimate can be held together
    as in 2019, Fig. 7. Joint accelerations have white noise of 0.05 rad/s^2. ``exact`` leaves out
    noise, offsets and losses, and states the covariances that would have been.
    """
    motion = simulated.motion
    assert motion.a is not None
    size = 0.0 if exact else 1.0
    mounts = [
        ImuMount("Pelvis", np.zeros(3), np.eye(3)) if mount.segment == "Pelvis" else mount
        for mount in imu_mounts(model, rng, IMU_SEGMENTS)
    ]
    noise = None if exact else ImuNoise(accelerometer=ACCELEROMETER, dropouts=RADIO)
    arrived = np.ones(len(motion), dtype=bool)
    sensors: list[Measurement] = []
    for reading in simulate_imus(model, motion, mounts, rng, noise=noise):
        arrived &= reading.received
        variance = np.where(reading.received, _variance(ACCELEROMETER), LOST_ACCELERATION**2)
        sensors.append(
            Accelerometer(
                reading.mount.segment,
                reading.acceleration,
                variance[:, None, None] * np.eye(3),
                reading.mount.position,
                reading.mount.rotation,
            )
        )
    acceleration = motion.a + size * JOINT_SD * rng.normal(size=motion.a.shape)
    sensors.append(JointAcceleration(acceleration[:, 6:], JOINT_SD**2))
    there = np.ones(len(motion), dtype=bool)
    for sensor, received in _feet(model, simulated, rng, feet, exact):
        there &= received
        sensors.append(sensor)
    return Measured(name, model, simulated, tuple(sensors), arrived & there, there, acceleration)


def as_in_the_paper(
    sensors: tuple[Measurement, ...], preset: TwoStepCovariances
) -> list[Measurement]:
    """Gives readings the paper's covariances instead of their noise."""
    out: list[Measurement] = []
    for sensor in sensors:
        if isinstance(sensor, Accelerometer):
            out.append(replace(sensor, covariance=preset.accelerometer))
        elif isinstance(sensor, JointAcceleration):
            out.append(replace(sensor, covariance=preset.joint_acceleration))
        elif isinstance(sensor, ForceTorque):
            out.append(replace(sensor, covariance=preset.feet))
        else:
            out.append(sensor)
    return out


def without_accelerations(sensors: list[Measurement]) -> list[Measurement]:
    """Puts zeros in place of all measured accelerations, as the papers' software did."""
    return [
        replace(sensor, value=np.zeros_like(np.asarray(sensor.value)))
        if isinstance(sensor, Accelerometer | JointAcceleration)
        else sensor
        for sensor in sensors
    ]


def foot_wrenches(task: Measured) -> tuple[np.ndarray, np.ndarray]:
    """Returns what each foot's sensors read together, and what was true.

    Returns:
        Both ``2 x T x 6`` (right, left) N, N m, foot axes, about the ankle.
    """
    poses = forward_kinematics(task.model, task.simulated.motion.q)
    feet = task.simulated.truth.dynamics.feet
    assert feet is not None
    read, true = np.zeros(feet.shape), np.zeros(feet.shape)
    for k, name in enumerate(FEET):
        R, p = poses.of(name)
        moment = feet[k, :, 3:] - np.cross(p, feet[k, :, :3])
        for part, vector in ((slice(0, 3), feet[k, :, :3]), (slice(3, 6), moment)):
            true[k, :, part] = np.einsum("tji,tj->ti", R, vector)
        for sensor in task.sensors:
            if not isinstance(sensor, ForceTorque) or sensor.link != name:
                continue
            value = np.asarray(sensor.value)
            axes = np.eye(3) if sensor.rotation is None else np.asarray(sensor.rotation)
            force, about = value[:, :3] @ axes.T, value[:, 3:] @ axes.T
            place = np.asarray(sensor.position)
            if sensor.fixed_to == "world":
                about = about + np.cross(place - p, force)
                force, about = (np.einsum("tji,tj->ti", R, x) for x in (force, about))
            else:
                about = about + np.cross(place, force)
            read[k] += np.concatenate((force, about), axis=1)
    return read, true


def _feet(
    model: HumanModel, simulated: SimulatedMotion, rng: np.random.Generator, kind: str, exact: bool
) -> list[tuple[ForceTorque, np.ndarray]]:
    out = []
    shoe_noise, plate_noise, radio = (SHOE, PLATE, RADIO) if not exact else (_NONE, _NONE, ALWAYS)
    if kind == "shoes":
        for shoe in simulate_shoes(
            model, simulated, shoe_sensors(model), rng, noise=shoe_noise, dropouts=radio
        ):
            covariance = _wrench_covariance(SHOE, shoe.received)
            sensor = ForceTorque(
                shoe.sensor.segment,
                shoe.wrench,
                covariance,
                shoe.sensor.position,
                shoe.sensor.rotation,
            )
            out.append((sensor, shoe.received))
        return out
    recording = simulate_plates(simulated, plate_pair(), rng, noise=plate_noise)
    for name, plate in zip(FEET, recording.readings, strict=True):
        at = plate.plate
        origin = at.center + at.rotation @ at.sensor_origin
        sensor = ForceTorque(
            name,
            plate.wrench,
            _wrench_covariance(PLATE, plate.received),
            origin,
            at.rotation,
            fixed_to="world",
        )
        out.append((sensor, plate.received))
    return out


def _variance(noise: SensorNoise) -> np.ndarray:
    return np.square(noise.sd) + np.square(noise.offset_sd)


def _wrench_covariance(noise: SensorNoise, received: np.ndarray) -> np.ndarray:
    there = received[:, None]
    variance = np.where(there, _variance(noise), LOST_WRENCH**2)
    return variance[:, :, None] * np.eye(6)
