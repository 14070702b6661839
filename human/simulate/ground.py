"""What the ground does to a simulated person: exact inverse dynamics, by Pinocchio alone.

Wrenches here act on the person, in world axes, force first, the moment about the world origin.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from human.model import HumanModel
from human.motion import Motion

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Dynamics:
    """True efforts of a simulated motion.

    Attributes:
        effort: generalised forces, ``T x (6 + n_dof)``, base wrench (zero to rounding: the ground
            carries it) then joint torques [N m].
        ground: sum of what the ground does to the person, ``T x 6`` [N, N m].
        feet: its share at the right and left foot, ``2 x T x 6``, or None where no foot is stated.
        center_of_pressure: where the ground force passes through z = 0, ``T x 2`` [m].
        hands: force of the load on each loaded frame, name to ``T x 3`` [N].
    """

    effort: Array
    ground: Array
    feet: Array | None
    center_of_pressure: Array
    hands: Mapping[str, Array]


def solve_dynamics(
    model: HumanModel,
    motion: Motion,
    loads: Mapping[str, Array],
    *,
    feet: tuple[Array, Array] | None = None,
    contact: tuple[NDArray[np.bool_], NDArray[np.bool_]] | None = None,
    share_right: Array | None = None,
) -> Dynamics:
    """Solves inverse dynamics of a motion: hands carry point masses, feet carry everything.

    Args:
        model: the person.
        motion: what they do.
        loads: mass carried at a frame, name to ``T`` [kg]. A load pushes with ``m (g - a)``, with a
            the acceleration of the frame's origin.
        feet: position of the middle of each sole, ``T x 2`` each [m], to split the ground force by.
        contact: whether each foot stands, ``T`` each; needed with ``feet``.
        share_right: share of the vertical force borne by the right foot where both stand, ``T``;
            if not given, that of the center of pressure on the line between the feet.

    Returns:
        The efforts. With ``feet`` the leg torques hold for that split; without, the whole ground
        wrench enters at the pelvis, so that torques above it hold and torques below are those of
        legs hanging free.

    Derived here: RNEA without ground gives the wrench that the base lacks; that is the ground's.
    Both feet get their share of the vertical force at centers of pressure that add up to the
    whole's, horizontal forces and the moment about the vertical by the same share, so that the sum
    is exact.
    """
    pin_model = model.pinocchio()
    data = pin_model.createData()
    external, ground, hands = _unsupported(model, motion, loads)
    pressure = _pressure(ground)
    split = None
    if feet is not None and contact is not None:
        split = _split(ground, pressure, feet, contact, share_right)
        soles = [
            pin_model.frames[pin_model.getFrameId(f"{side}Foot")].parentJoint
            for side in ("Right", "Left")
        ]
    effort = np.empty((len(motion), pin_model.nv))
    for i, forces in enumerate(external):
        pin.forwardKinematics(pin_model, data, motion.q[i])
        if split is None:
            forces[1] += data.oMi[1].actInv(pin.Force(ground[i]))
        else:
            for joint, wrench in zip(soles, split[:, i], strict=True):
                forces[joint] += data.oMi[joint].actInv(pin.Force(wrench))
        effort[i] = pin.rnea(pin_model, data, motion.q[i], motion.v[i], motion.a[i], forces)
    return Dynamics(effort, ground, split, pressure, hands)


def center_of_pressure(model: HumanModel, motion: Motion, loads: Mapping[str, Array]) -> Array:
    """Returns where the ground force of a motion passes through z = 0, ``T x 2`` [m].

    The arguments are those of ``solve_dynamics``, which answers the same and everything else.
    """
    return _pressure(_unsupported(model, motion, loads)[1])


def _pressure(ground: Array) -> Array:
    return np.stack((-ground[:, 4], ground[:, 3]), axis=-1) / ground[:, 2:3]


def _unsupported(
    model: HumanModel, motion: Motion, loads: Mapping[str, Array]
) -> tuple[list[list[pin.Force]], Array, dict[str, Array]]:
    """Returns the loads' forces by joint, what the ground must give, and the loads' by hand."""
    pin_model = model.pinocchio()
    data = pin_model.createData()
    frames = {name: pin_model.getFrameId(name) for name in loads}
    T = len(motion)
    ground = np.empty((T, 6))
    hands = {name: np.empty((T, 3)) for name in loads}
    external: list[list[pin.Force]] = []
    for i in range(T):
        q, v, a = motion.q[i], motion.v[i], motion.a[i]
        pin.forwardKinematics(pin_model, data, q, v, a)
        forces = [pin.Force.Zero() for _ in range(pin_model.njoints)]
        for name, frame in frames.items():
            placement = pin.updateFramePlacement(pin_model, data, frame)
            acceleration = pin.getFrameClassicalAcceleration(
                pin_model, data, frame, pin.LOCAL_WORLD_ALIGNED
            ).linear
            force = loads[name][i] * (pin_model.gravity.linear - acceleration)
            hands[name][i] = force
            joint = pin_model.frames[frame].parentJoint
            moment = np.cross(placement.translation, force)
            forces[joint] += data.oMi[joint].actInv(pin.Force(force, moment))
        external.append(forces)
        lacking = pin.rnea(pin_model, data, q, v, a, forces)[:6]
        wrench = data.oMi[1].act(pin.Force(lacking))
        ground[i] = np.r_[wrench.linear, wrench.angular]
    return external, ground, hands


def _split(
    ground: Array,
    pressure: Array,
    feet: tuple[Array, Array],
    contact: tuple[NDArray[np.bool_], NDArray[np.bool_]],
    share_right: Array | None,
) -> Array:
    """Returns the wrenches of right and left foot, ``2 x T x 6``."""
    right, left = feet
    if share_right is None:
        way = left - right
        along = np.sum((pressure - right) * way, axis=-1) / np.sum(way * way, axis=-1)
        share_right = np.clip(1.0 - along, 0.0, 1.0)
    on_right, on_left = contact
    share = np.where(on_right & on_left, share_right, np.where(on_right, 1.0, 0.0))[:, None]
    # Move both centers of pressure by the same amount, so that their weighted mean is the whole's.
    shift = pressure - (share * right + (1.0 - share) * left)
    out = np.empty((2, len(ground), 6))
    for wrench, part, center in (
        (out[0], share, right + shift),
        (out[1], 1.0 - share, left + shift),
    ):
        force = part * ground[:, :3]
        wrench[:, :3] = force
        wrench[:, 3] = center[:, 1] * force[:, 2]
        wrench[:, 4] = -center[:, 0] * force[:, 2]
        wrench[:, 5] = part[:, 0] * ground[:, 5]
    return out
