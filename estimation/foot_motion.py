"""How heel and toes move, from a motion of the whole body: for contacts without forces."""

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from estimation.contacts import FootMotion
from estimation.errors import MeasurementError
from human import HumanModel
from human.shapes import Box

Array = NDArray[np.float64]

SIDES = ("Right", "Left")


def sole_points(model: HumanModel, side: str) -> tuple[tuple[str, Array], ...]:
    """Returns heel and toe tip of a foot as (segment, ``(3,)`` m in segment axes).

    They are the lower rear edge of the foot's solid and the lower front edge of the toes'; of a
    model without solids the two segments' origins.

    Args:
        model: the person.
        side: ``Right`` or ``Left``.

    Raises:
        human.UnknownNameError: the model has no such foot.
    """
    points = []
    for segment, end in ((f"{side}Foot", -0.5), (f"{side}Toe", 0.5)):
        model.segment_index(segment)
        solid = model.shapes.get(segment)
        at = np.zeros(3)
        if isinstance(solid, Box):
            length, _, thickness = solid.size
            at = np.asarray(solid.center) + np.array([end * length, 0.0, -0.5 * thickness])
        points.append((segment, at))
    return tuple(points)


def sole_motion(
    model: HumanModel,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike | None = None,
    *,
    floor_height_m: float = 0.0,
    belt_velocity: ArrayLike = (0.0, 0.0, 0.0),
) -> FootMotion:
    """Computes height, speed and acceleration of both soles, heel and toe tip of each.

    Args:
        model: the person.
        q: ``(time, nq)`` configurations.
        v: ``(time, nv)`` velocities, base twist in body axes.
        a: ``(time, nv)`` accelerations; None if unknown: they shall be measured, or the result of a
            short window, or they show a switch late.
        floor_height_m: of the floor in world axes; of who stands in ``q`` if that is not zero.
        belt_velocity: ``(3,)`` m/s, world axes, what resting feet move at on a treadmill.

    Raises:
        MeasurementError: shapes do not fit or a number is not finite.
        human.UnknownNameError: the model lacks a foot.
    """
    pin_model = model.pinocchio()
    data = pin_model.createData()
    q, v = (np.asarray(x, dtype=np.float64) for x in (q, v))
    rate = np.zeros_like(v) if a is None else np.asarray(a, dtype=np.float64)
    for name, array, width in (("q", q, model.nq), ("v", v, model.nv), ("a", rate, model.nv)):
        if array.ndim != 2 or array.shape != (len(q), width):
            raise MeasurementError(f"{name}: expected shape ({len(q)}, {width}), got {array.shape}")
        bad = ~np.isfinite(array).all(axis=1)
        if np.any(bad):
            raise MeasurementError(f"{name}: expected finite numbers", int(np.argmax(bad)))
    points = [sole_points(model, side) for side in SIDES]
    height, speed, acceleration = (np.empty((len(q), 2, 2)) for _ in range(3))
    belt = np.asarray(belt_velocity, dtype=np.float64)
    aligned = pin.LOCAL_WORLD_ALIGNED
    for i in range(len(q)):
        pin.forwardKinematics(pin_model, data, q[i], v[i], rate[i])
        for side in range(2):
            for k, (segment, local) in enumerate(points[side]):
                frame = pin_model.getFrameId(segment)
                place = pin.updateFramePlacement(pin_model, data, frame)
                lever = place.rotation @ local
                twist = pin.getFrameVelocity(pin_model, data, frame, aligned)
                change = pin.getFrameClassicalAcceleration(pin_model, data, frame, aligned)
                along = np.cross(twist.angular, lever)
                height[i, side, k] = place.translation[2] + lever[2] - floor_height_m
                speed[i, side, k] = np.linalg.norm(twist.linear + along - belt)
                acceleration[i, side, k] = np.linalg.norm(
                    change.linear + np.cross(change.angular, lever) + np.cross(twist.angular, along)
                )
    return FootMotion(height, speed, None if a is None else acceleration)
