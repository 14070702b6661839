"""Puts a whole body together: pelvis on its path, feet where they stand, hands led or hanging."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from human.model import HumanModel
from human.motion import Motion, Provenance
from human.rotations import quaternion_continuous
from human.simulate.errors import SimulationError
from human.simulate.legs import Leg
from human.simulate.paths import PosePath
from human.simulate.resolve import Resolved

Array = NDArray[np.float64]

#: All joint angles at times ``T``: ``T x n_dof`` [rad].
AngleCourse = Callable[[Array], Array]

#: Step of the five-point differences of closed-form angles [s]; error of order step^4.
_STEP_S = 2e-3
#: Half step of the central difference of the exact base twist [s].
_EPSILON_S = 1e-4


@dataclass(frozen=True, slots=True)
class BodyPaths:
    """Where pelvis and feet are over time, world axes.

    Attributes:
        pelvis: path of the pelvis frame.
        feet: paths of the right and left foot frames (origin at the ankle).
        contacts: for each foot, the intervals within which it stands still, ``K x 2`` [s].
    """

    pelvis: PosePath
    feet: tuple[PosePath, PosePath]
    contacts: tuple[Array, Array]


def in_contact(
    contacts: tuple[Array, Array], time_s: Array
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Returns whether the right and the left foot stand, ``T`` each, from intervals ``K x 2``."""
    right, left = (
        np.any((time_s[:, None] >= c[:, 0]) & (time_s[:, None] <= c[:, 1]), axis=1)
        for c in contacts
    )
    return right, left


def whole_body(
    model: HumanModel,
    legs: tuple[Leg, Leg],
    paths: BodyPaths,
    time_s: Array,
    hanging: AngleCourse,
    led: tuple[NDArray[np.intp], Resolved] | None,
    provenance: Provenance,
) -> Motion:
    """Returns the motion of all joints.

    Args:
        model: the person.
        legs: right and left leg of the model.
        paths: pelvis and feet.
        time_s: ``T`` [s].
        hanging: angles of every joint that is neither in a leg nor led, as a smooth function of
            time.
        led: indices of the joints that the hand leads, and what they do.
        provenance: what to write into the motion.

    Raises:
        SimulationError: a foot is out of reach of its leg.

    Derived here: base velocity is the exact derivative of the pelvis path in body axes; leg angles
    are closed form in time, so their five-point differences are exact to about 1e-8.
    """

    def angles(t: Array) -> Array:
        q = np.array(hanging(t))
        pelvis = paths.pelvis.sample(t)
        for leg, foot in zip(legs, paths.feet, strict=True):
            q[:, leg.dof] = leg.angles(pelvis, foot.sample(t))
        return q

    def base_twist(t: Array) -> Array:
        pelvis = paths.pelvis.sample(t)
        back = np.swapaxes(pelvis.rotation, -1, -2)
        return np.concatenate(
            (
                np.einsum("tij,tj->ti", back, pelvis.linear),
                np.einsum("tij,tj->ti", back, pelvis.angular),
            ),
            axis=-1,
        )

    h = _STEP_S
    far_back, back, now, on, far_on = (angles(time_s + k * h) for k in (-2, -1, 0, 1, 2))
    rates = (far_back - far_on + 8.0 * (on - back)) / (12.0 * h)
    accelerations = (16.0 * (on + back) - far_on - far_back - 30.0 * now) / (12.0 * h * h)
    joints = np.array(now)
    if led is not None:
        dof, course = led
        joints[:, dof], rates[:, dof], accelerations[:, dof] = course.q, course.v, course.a
    pelvis = paths.pelvis.sample(time_s)
    quaternion = quaternion_continuous(Rotation.from_matrix(pelvis.rotation).as_quat())
    base_acceleration = (base_twist(time_s + _EPSILON_S) - base_twist(time_s - _EPSILON_S)) / (
        2.0 * _EPSILON_S
    )
    return Motion(
        model_dof_names=model.dof_names,
        time_s=time_s,
        q=np.concatenate((pelvis.position, quaternion, joints), axis=-1),
        v=np.concatenate((base_twist(time_s), rates), axis=-1),
        a=np.concatenate((base_acceleration, accelerations), axis=-1),
        provenance=provenance,
    )


def refuse_beyond_limits(model: HumanModel, motion: Motion) -> None:
    """Checks that every joint stays within its limits.

    Raises:
        SimulationError: one does not; the worst is named.
    """
    q = motion.joint_angles
    beyond = np.maximum(model.lower - q, q - model.upper)
    frame, dof = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
    if beyond[frame, dof] > 0.0:
        raise SimulationError(
            f"at {motion.time_s[frame]:.2f} s {model.dof_names[dof]} is "
            f"{np.rad2deg(beyond[frame, dof]):.1f} degrees beyond its limit; "
            "choose an easier task or another person"
        )
