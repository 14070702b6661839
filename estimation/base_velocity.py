"""Velocity of the base from what stands still: a foot on the floor, or on a moving belt.

Inertial suits measure how the body moves within itself far better than how it moves through the
room; a planted foot tells the latter.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation.errors import MeasurementError, NoContactError, SingularContactsError
from estimation.spatial import cross, skew, times
from human import Chain, HumanModel, forward_kinematics, frame_poses
from human.rotations import matrix_to_quaternion, quaternion_to_matrix

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Point contacts less spread than this across their line, m, are taken to leave a turn free.
_LEAST_SPREAD_M = 1e-3


@dataclass(frozen=True, slots=True)
class Contact:
    """Something on the body that moves as what it stands on.

    Attributes:
        frame: frame or segment name, such as ``RightFoot``; its origin is the point.
        active: ``(...)`` booleans, when it holds.
        velocity: ``(..., 3)`` m/s, world axes, of the ground there: zero, or the treadmill's belt.
        rigid: whether the segment does not turn either (a flat foot); otherwise a point alone.
    """

    frame: str
    active: ArrayLike = True
    velocity: ArrayLike = (0.0, 0.0, 0.0)
    rigid: bool = True


@dataclass(frozen=True, slots=True)
class BaseVelocity:
    """How the base moves, and how far the contacts disagree.

    Attributes:
        base: frame or segment name.
        twist_world: ``(..., 6)`` velocity of its origin (m/s) and angular velocity (rad/s), world
            axes.
        twist_body: ``(..., 6)`` the same in its own axes; for the pelvis, ``Motion.v[..., :6]``.
        slip: ``(..., contacts, 6)`` twist of each contact frame against its ground, world axes. Of
            an active contact it is the residual, of another how it moves.
        supported: ``(...)`` whether any contact held; where none did the twists are zero.
    """

    base: str
    twist_world: Array
    twist_body: Array
    slip: Array
    supported: Mask


def base_velocity(
    model: HumanModel,
    q: ArrayLike,
    joint_rates: ArrayLike,
    contacts: Sequence[Contact],
    *,
    base: str = "Pelvis",
    angular_scale_m: float = 1.0,
    allow_unsupported: bool = False,
) -> BaseVelocity:
    """Computes the base velocity that leaves the contacts as still as can be.

    Args:
        model: the person.
        q: ``(..., nq)`` configurations; of the base only its rotation matters.
        joint_rates: ``(..., n_dof)`` rad/s.
        contacts: what may touch the ground; two feet make single and double support.
        base: frame or segment whose velocity is wanted.
        angular_scale_m: metres per radian by which turning of a contact counts against sliding; one
            is the paper's sum of squares.
        allow_unsupported: mark frames without a contact instead of refusing them.

    Raises:
        MeasurementError: shapes do not fit, a number is not finite, or the scale is not positive.
        NoContactError: a frame, or all, without contact.
        SingularContactsError: point contacts that leave the base free to turn.
        human.UnknownNameError: a contact or the base is not in the model.

    Source: Latella et al. 2019, equations 7-10; a belt's velocity stands where the paper has zero.
    Derived here: with the pelvis twist ``V`` in world axes, ``J_b V`` of a contact ``r`` away is
    ``(v + omega x r, omega)`` and ``J_s s'`` is the chain's Jacobian turned to world axes, so the
    least squares is one 6 x 6 solve a frame; the twist of another base is the pelvis's carried
    there, which maps solutions onto solutions and residuals onto themselves.
    """
    q = np.asarray(q, dtype=np.float64)
    if q.ndim == 0 or q.shape[-1] != model.nq:
        raise MeasurementError(f"q: expected shape (..., {model.nq}), got {q.shape}")
    if not angular_scale_m > 0.0:
        raise MeasurementError(f"angular_scale_m: expected more than zero, got {angular_scale_m}")
    batch = q.shape[:-1]
    rates = _spread(joint_rates, (*batch, model.n_dof), "joint_rates").reshape(-1, model.n_dof)
    flat = _spread(q, q.shape, "q").reshape(-1, model.nq)
    names = tuple(contact.frame for contact in contacts)
    active = np.zeros((len(contacts), len(flat)), dtype=np.bool_)
    ground = np.zeros((len(contacts), len(flat), 3))
    for k, contact in enumerate(contacts):
        active[k] = _mask(contact.active, batch, contact.frame).reshape(-1)
        what = f"velocity under {contact.frame}"
        ground[k] = _spread(contact.velocity, (*batch, 3), what).reshape(-1, 3)
    supported = np.any(active, axis=0)
    if not contacts or not (allow_unsupported or np.all(supported)):
        raise NoContactError(names, np.flatnonzero(~supported).tolist(), len(flat))

    R = quaternion_to_matrix(flat[:, 3:7])
    levers, relative, _ = _seen_from_pelvis(model, flat, rates, names, R)
    normal, right = np.zeros((len(flat), 6, 6)), np.zeros((len(flat), 6))
    turn_weight = angular_scale_m**2
    for k, contact in enumerate(contacts):
        # Rows of J_b for the point: [1, -S(r)]; for the turning: [0, 1].
        on = active[k].astype(np.float64)
        rows = np.concatenate([np.broadcast_to(np.eye(3), R.shape), -skew(levers[k])], axis=-1)
        normal += on[:, None, None] * (rows.swapaxes(-1, -2) @ rows)
        wanted = on[:, None] * (ground[k] - relative[k][:, :3])
        right += times(rows.swapaxes(-1, -2), wanted)
        if contact.rigid:
            normal[:, 3:, 3:] += (turn_weight * on)[:, None, None] * np.eye(3)
            right[:, 3:] -= (turn_weight * on)[:, None] * relative[k][:, 3:]
    rigid = np.array([contact.rigid for contact in contacts])
    _refuse_singular(normal, active, rigid, supported, names)
    normal[~supported] = np.eye(6)
    pelvis = np.asarray(np.linalg.solve(normal, right[..., None])[..., 0], dtype=np.float64)

    slip = np.stack(
        [_carried(pelvis, levers[k]) + relative[k] for k in range(len(contacts))], axis=1
    )
    slip[..., :3] -= ground.swapaxes(0, 1)
    (lever,), (moved,), (R_base,) = _seen_from_pelvis(model, flat, rates, (base,), R)
    twist = np.where(supported[:, None], _carried(pelvis, lever) + moved, 0.0)
    body = np.einsum("bij,bki->bkj", R_base, twist.reshape(-1, 2, 3)).reshape(-1, 6)
    return BaseVelocity(
        base=base,
        twist_world=twist.reshape(*batch, 6),
        twist_body=body.reshape(*batch, 6),
        slip=slip.reshape(*batch, len(contacts), 6),
        supported=supported.reshape(batch),
    )


def configuration_from_link(
    model: HumanModel,
    joint_angles: ArrayLike,
    link: str,
    position: ArrayLike,
    quat_xyzw: ArrayLike,
) -> Array:
    """Returns the configuration in which any one link is where it was measured.

    Args:
        model: the person.
        joint_angles: ``(..., n_dof)`` rad.
        link: frame or segment name.
        position: ``(..., 3)`` m, world, its origin.
        quat_xyzw: ``(..., 4)`` its orientation in world, unit.

    Returns:
        ``(..., nq)``.

    Raises:
        MeasurementError: shapes do not fit or a number is not finite.
        human.UnknownNameError: the model has no such frame or segment.
    """
    angles = np.asarray(joint_angles, dtype=np.float64)
    batch = angles.shape[:-1]
    place = _spread(position, (*batch, 3), f"position of {link}")
    turned = quaternion_to_matrix(_spread(quat_xyzw, (*batch, 4), f"orientation of {link}"))
    q = np.zeros((*batch, model.nq))
    q[..., 6] = 1.0
    q[..., 7:] = _spread(angles, (*batch, model.n_dof), "joint_angles")
    rotation, origin = frame_poses(model, forward_kinematics(model, q), link)
    pelvis = turned @ rotation.swapaxes(-1, -2)
    q[..., :3] = place - (pelvis @ origin[..., None])[..., 0]
    q[..., 3:7] = matrix_to_quaternion(pelvis)
    return q


def _seen_from_pelvis(
    model: HumanModel, q: Array, rates: Array, names: tuple[str, ...], R: Array
) -> tuple[list[Array], list[Array], list[Array]]:
    """Returns each frame's place from the pelvis, its twist ``J_s s'`` and rotation, world axes."""
    levers, twists, rotations = [], [], []
    for name in names:
        segment, fixed = model.point(name)
        if segment == 0:
            levers.append(times(R, fixed))
            twists.append(np.zeros((len(q), 6)))
            rotations.append(R)
            continue
        chain = Chain(model, tip=name)
        place, turned, jacobian = chain.forward_and_jacobian(q[:, 7 + chain.dof_indices])
        twist = times(jacobian, rates[:, chain.dof_indices]).reshape(-1, 2, 3)
        levers.append(times(R, place))
        twists.append(np.einsum("bij,bkj->bki", R, twist).reshape(-1, 6))
        rotations.append(R @ turned)
    return levers, twists, rotations


def _refuse_singular(
    normal: Array, active: Mask, rigid: Mask, supported: Mask, names: tuple[str, ...]
) -> None:
    """Looks at frames held by points alone: do they spread in two directions?"""
    suspects = np.flatnonzero(supported & ~np.any(active[rigid], axis=0))
    if not len(suspects):
        return
    count = normal[suspects, 0, 0][:, None, None]
    lever = normal[suspects][:, 3:, :3]
    # About the points' centre the angular block is the sum of |r|^2 1 - r r'.
    spread = normal[suspects][:, 3:, 3:] - lever @ lever.swapaxes(-1, -2) / count
    bad = np.linalg.eigvalsh(spread)[:, 0] < _LEAST_SPREAD_M**2
    if np.any(bad):
        index = int(suspects[np.argmax(bad)])
        held = tuple(name for k, name in enumerate(names) if active[k, index])
        raise SingularContactsError(held, index)


def _carried(twist: Array, lever: Array) -> Array:
    """Returns the twist ``(batch, 6)`` of the same rigid body at a point ``lever`` away."""
    linear = twist[:, :3] + cross(twist[:, 3:], lever)
    return np.concatenate([linear, twist[:, 3:]], axis=-1)


def _spread(value: ArrayLike, shape: tuple[int, ...], what: str) -> Array:
    array = np.asarray(value, dtype=np.float64)
    try:
        spread = np.broadcast_to(array, shape)
    except ValueError:
        raise MeasurementError(f"{what}: expected shape {shape}, got {array.shape}") from None
    bad = ~np.isfinite(spread.reshape(-1, shape[-1])).all(axis=-1)
    if np.any(bad):
        raise MeasurementError(f"{what}: expected finite numbers", int(np.argmax(bad)))
    return spread


def _mask(value: ArrayLike, batch: tuple[int, ...], frame: str) -> Mask:
    array = np.asarray(value)
    if array.dtype != np.bool_:
        raise MeasurementError(f"active of {frame}: expected booleans, got {array.dtype}")
    try:
        return np.broadcast_to(array, batch)
    except ValueError:
        raise MeasurementError(
            f"active of {frame}: expected shape {batch}, got {array.shape}"
        ) from None
