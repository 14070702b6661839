"""Sensorised shoes: several force/torque sensors under each foot, each in its own frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from human.kinematics import forward_kinematics
from human.model import HumanModel
from human.rotations import rotation_vector_to_matrix
from human.simulate.errors import SimulationError
from human.simulate.legs import legs_of
from human.simulate.records import SimulatedMotion
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

#: Where sensors sit along the sole from heel (0) to toe (1), and how they are turned against the
#: foot as rotation vectors [rad]: no two in the same axes, as in real shoes.
_ALONG = {1: (0.5,), 2: (0.2, 0.75), 3: (0.15, 0.7, 0.7)}
_ACROSS = {1: (0.0,), 2: (0.0, 0.0), 3: (0.0, 0.5, -0.5)}
_TURNS = ((0.0, 0.0, np.pi), (0.0, 0.12, 0.3), (0.05, -0.1, -1.2))
#: Height of the sensors over the ground [m].
_THICKNESS_M = 0.01


@dataclass(frozen=True, slots=True)
class ShoeSensor:
    """A force/torque sensor in a sole.

    Attributes:
        name: what it is called.
        segment: the foot it is under, such as ``RightFoot``.
        position: of its origin in foot axes from the ankle, ``3`` [m].
        rotation: its axes in the foot's, ``3 x 3``.
    """

    name: str
    segment: str
    position: Array
    rotation: Array


@dataclass(frozen=True, slots=True)
class ShoeReading:
    """What one sensor recorded.

    Attributes:
        sensor: which.
        wrench: what the ground does to the foot through it, ``T x 6`` [N, N m], sensor axes, about
            its origin.
        received: frames that arrived, ``T``; in the others the last one is repeated.
        offset: the constant error in the wrench, ``6``.
    """

    sensor: ShoeSensor
    wrench: Array
    received: Mask
    offset: Array


def shoe_sensors(model: HumanModel, per_foot: int = 2) -> tuple[ShoeSensor, ...]:
    """Returns the sensors of a pair of shoes: one to three a foot, right shoe first, heel first.

    Raises:
        SimulationError: another number, or a model without full legs.
    """
    if per_foot not in _ALONG:
        raise SimulationError(f"per_foot: expected 1, 2 or 3 sensors, got {per_foot}")
    sensors = []
    for leg in legs_of(model):
        places = zip(_ALONG[per_foot], _ACROSS[per_foot], _TURNS, strict=False)
        for k, (along, across, turn) in enumerate(places):
            x = leg.heel + along * (leg.toe - leg.heel)
            position = np.array([x, across * leg.half_width, _THICKNESS_M - leg.sole])
            rotation = rotation_vector_to_matrix(np.array(turn))
            sensors.append(
                ShoeSensor(f"{leg.side}Shoe{k + 1}", f"{leg.side}Foot", position, rotation)
            )
    return tuple(sensors)


def simulate_shoes(
    model: HumanModel,
    simulated: SimulatedMotion,
    sensors: Sequence[ShoeSensor],
    rng: np.random.Generator,
    *,
    noise: SensorNoise = PERFECT,
    dropouts: Dropouts = ALWAYS_THERE,
) -> tuple[ShoeReading, ...]:
    """Records what sensors under the feet feel of a simulated motion.

    Args:
        model: the person.
        simulated: the motion and its truth.
        sensors: where they are; together those of a foot bear all of it.
        rng: source of all randomness.
        noise: of the six channels, sensor axes [N, N m].
        dropouts: of each sensor on its own.

    Raises:
        SimulationError: the motion does not say what each foot bears, or a sensor is under none.

    Derived here: a stiff sole on equal springs at the sensors loads them by an affine function of
    place whose mean is the center of pressure, cut off at zero because nothing pulls; horizontal
    force goes by the same share, and so does the moment that is left about the sensors' weighted
    middle. The sum is exactly the foot's wrench.
    """
    feet = simulated.truth.dynamics.feet
    if feet is None:
        raise SimulationError("the motion was simulated without feet, so no shoe can feel them")
    time_s = simulated.motion.time_s
    poses = forward_kinematics(model, simulated.motion.q)
    true: dict[str, Array] = {}
    for segment, world in zip(("RightFoot", "LeftFoot"), feet, strict=True):
        R, p = poses.of(segment)
        force = np.einsum("tji,tj->ti", R, world[:, :3])
        moment = np.einsum("tji,tj->ti", R, world[:, 3:] - np.cross(p, world[:, :3]))
        mine = [sensor for sensor in sensors if sensor.segment == segment]
        if mine:
            true |= _shared(mine, force, moment)
    stray = [sensor.name for sensor in sensors if sensor.name not in true]
    if stray or len(true) != len(sensors):
        raise SimulationError(
            "sensors must have different names and be under RightFoot or LeftFoot; not so: "
            f"{', '.join(stray) or 'names'}"
        )
    readings = []
    for sensor in sensors:
        read, offset = disturbed(true[sensor.name], noise, rng)
        received = frames_received(time_s, dropouts, rng)
        readings.append(ShoeReading(sensor, held(read, received), received, offset))
    return tuple(readings)


def _shared(sensors: list[ShoeSensor], force: Array, moment: Array) -> dict[str, Array]:
    """Returns each sensor's wrench in its axes, from the foot's in foot axes about the ankle."""
    places = np.array([sensor.position for sensor in sensors])
    height = float(places[:, 2].mean())
    pushes = force[:, 2] > 0.0
    vertical = np.where(pushes, force[:, 2], 1.0)
    x = (height * force[:, 0] - moment[:, 1]) / vertical
    y = (height * force[:, 1] + moment[:, 0]) / vertical
    middle = places[:, :2].mean(axis=0)
    aside = np.stack((x, y), axis=-1) - middle
    slope = np.linalg.pinv((places[:, :2] - middle).T, rcond=1e-9)
    share = np.where(pushes[:, None], 1.0 / len(sensors) + aside @ slope.T, 1.0 / len(sensors))
    share = np.maximum(share, 0.0)
    share /= share.sum(axis=1, keepdims=True)
    left = moment - np.cross(share @ places, force)
    out = {}
    for k, sensor in enumerate(sensors):
        part = share[:, k, None]
        out[sensor.name] = np.concatenate(
            (part * force @ sensor.rotation, part * left @ sensor.rotation), axis=-1
        )
    return out
