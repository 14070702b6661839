"""What is estimated from: frames that can be used, measurements cut to them, what is derived.

Nothing missing is ever taken to be zero: an acceleration is measured, derived from the motion and
said to be, or refused.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from estimation.covariances import (
    LARGEST_FREE_VARIANCE,
    LARGEST_WHOLLY_FREE_VARIANCE,
    ModelCovariances,
)
from estimation.errors import MeasurementError, MissingMeasurementError
from estimation.sensors import (
    Accelerometer,
    AngularAcceleration,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
    describe,
    frames_at_fault,
)
from estimation.spatial import Array, IntArray
from estimation.tree import BASE_NQ, EstimationTree
from estimation.tree_kinematics import proper_acceleration
from human.rotations import quaternion_to_matrix

Missing = Literal["refuse", "leave_out"]


def usable_frames(
    measurements: Sequence[Measurement], frames: int, missing: Missing
) -> tuple[IntArray, dict[str, tuple[int, ...]]]:
    """Returns the frames where every measurement is finite, and the others by measurement.

    Raises:
        MeasurementError: a measurement has another number of frames; or one is not finite, and it
            is to be refused; or no frame is left.
    """
    for sensor in measurements:
        if not isinstance(sensor, FreeWrench) and np.shape(sensor.value)[:1] != (frames,):
            raise MeasurementError(
                f"{describe(sensor)}: expected {frames} frames, got shape {np.shape(sensor.value)}"
            )
    found = frames_at_fault(measurements)
    if found and missing == "refuse":
        name, bad = next(iter(found.items()))
        raise MeasurementError(
            f"{name}: expected finite numbers; mend them, or pass missing='leave_out'", bad
        )
    good = np.ones(frames, dtype=np.bool_)
    for bad in found.values():
        good[bad] = False
    if not np.any(good):
        raise MeasurementError(
            f"{', '.join(found)}: expected at least one frame with finite numbers"
        )
    return np.flatnonzero(good), {name: tuple(sorted(set(bad))) for name, bad in found.items()}


def of_frames(sensor: Measurement, chosen: IntArray, frames: int) -> Measurement:
    """Returns a measurement cut to some of its frames, with all that changes with them."""
    if isinstance(sensor, FreeWrench):
        return sensor
    value = np.asarray(sensor.value, dtype=np.float64)[chosen]
    if isinstance(sensor, JointAcceleration):
        covariance = _cut(sensor.covariance, chosen, frames, 2)
        return replace(sensor, value=value, covariance=covariance)
    covariance = _cut(sensor.covariance, chosen, frames, 3)
    rotation = None if sensor.rotation is None else _cut(sensor.rotation, chosen, frames, 3)
    if isinstance(sensor, AngularAcceleration):
        return replace(sensor, value=value, covariance=covariance, rotation=rotation)
    position = _cut(sensor.position, chosen, frames, 2)
    return replace(sensor, value=value, covariance=covariance, rotation=rotation, position=position)


def _cut(given: ArrayLike, chosen: IntArray, frames: int, dimensions: int) -> Array:
    """Cuts what has an entry for each frame; a shape that is wrong is left for others to refuse."""
    array = np.asarray(given, dtype=np.float64)
    return array[chosen] if array.ndim == dimensions and len(array) == frames else array


def completed(
    tree: EstimationTree,
    q: Array,
    v: Array,
    a: Array | None,
    measurements: Sequence[Measurement],
    covariances: ModelCovariances,
) -> tuple[list[Measurement], list[str]]:
    """Adds the accelerations that nobody measured, derived from the motion, and says so.

    Args:
        tree: the links.
        q: ``(frames, 7 + n_dof)``.
        v: ``(frames, 6 + n_dof)``.
        a: ``(frames, 6 + n_dof)``, or None where the motion has none.
        measurements: what there is.
        covariances: how far what is derived is believed.

    Returns:
        The measurements and, in words, what was added or changed.

    Raises:
        MissingMeasurementError: an acceleration is neither measured nor in the motion.
    """
    out, assumed = [], []
    for sensor in measurements:
        if isinstance(sensor, FreeWrench):
            sensor, lowered = _bounded(sensor)
            assumed.extend(lowered)
        out.append(sensor)
    has_joints = any(isinstance(sensor, JointAcceleration) for sensor in measurements)
    if not has_joints and not np.isfinite(covariances.joint_acceleration_prior):
        if a is None:
            raise MissingMeasurementError(
                "joint accelerations: expected a JointAcceleration or the motion's accelerations "
                "`a`; got neither, and they are never taken to be zero"
            )
        out.append(JointAcceleration(a[:, 6:], covariances.derived_joint_sd**2))
        assumed.append(
            "joint accelerations: derived from the motion, sd "
            f"{covariances.derived_joint_sd:g} rad/s^2"
        )
    if not any(isinstance(sensor, Accelerometer) for sensor in measurements):
        if a is None:
            raise MissingMeasurementError(
                "link accelerations: expected an Accelerometer or the motion's accelerations `a`; "
                "got neither, and they are never taken to be zero, which would be free fall"
            )
        base = proper_acceleration(quaternion_to_matrix(q[:, 3:BASE_NQ]), v, a)
        pelvis = tree.link_names[0]
        linear, angular = covariances.derived_acceleration_sd, covariances.derived_angular_sd
        out.append(Accelerometer(pelvis, base[:, :3], linear**2))
        assumed.append(f"acceleration of {pelvis}: derived from the motion, sd {linear:g} m/s^2")
        if not any(isinstance(sensor, AngularAcceleration) for sensor in measurements):
            out.append(AngularAcceleration(pelvis, base[:, 3:], angular**2))
            assumed.append(
                f"angular acceleration of {pelvis}: derived from the motion, sd {angular:g} rad/s^2"
            )
    return out, assumed


def _bounded(sensor: FreeWrench) -> tuple[FreeWrench, list[str]]:
    """Lowers what is freer than double precision carries, and says so; the answer is the same."""
    mixed = sensor.moment_sd**2 < 1e-2 * sensor.force_sd**2
    most = LARGEST_FREE_VARIANCE if mixed else LARGEST_WHOLLY_FREE_VARIANCE
    limits = {"force_sd": (most**0.5, "N"), "moment_sd": (LARGEST_WHOLLY_FREE_VARIANCE**0.5, "N m")}
    lowered = []
    for name, (limit, unit) in limits.items():
        if getattr(sensor, name) > limit:
            sensor = replace(sensor, **{name: limit})
            lowered.append(
                f"{describe(sensor)}: {name} lowered to {limit:.0f} {unit}; beyond it the bands "
                "of other wrenches lose their digits"
            )
    return sensor, lowered


def force_sensors(measurements: Sequence[Measurement]) -> tuple[str, ...]:
    """Returns the links with a `ForceTorque`, each once."""
    return tuple(
        dict.fromkeys(sensor.link for sensor in measurements if isinstance(sensor, ForceTorque))
    )


def free_links(measurements: Sequence[Measurement]) -> tuple[str, ...]:
    """Returns the links with a `FreeWrench`, each once."""
    return tuple(
        dict.fromkeys(sensor.link for sensor in measurements if isinstance(sensor, FreeWrench))
    )
