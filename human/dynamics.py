"""Inverse dynamics: what joints must bear for a person to move so, under these external loads.

Everything is top-down: a joint bears what hangs from it on the side away from the pelvis. With all
ground reactions given as wrenches the base bears nothing; what it still bears is the residual.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from human.errors import ConfigurationError, UnknownNameError
from human.kinematics import flat_configurations
from human.model import BASE_NV, Array, HumanModel
from human.newton_euler import PointLoad, SegmentLoads, newton_euler, workspace

#: World axes, m/s^2.
GRAVITY = (0.0, 0.0, -9.81)
#: Frames worked on at once: a segment's vectors then stay in the processor's cache.
CHUNK = 1024


@dataclass(frozen=True, slots=True)
class Wrench:
    """A force and a moment acting on the person at a frame's or segment's origin, in world axes.

    The weight of a 5 kg box held in the right hand is ``Wrench("RightHandCOM", (0, 0, -49.05))``.

    Attributes:
        frame: frame or segment name; the point it acts at.
        force: ``(..., 3)`` N.
        moment: ``(..., 3)`` N m about that point.
    """

    frame: str
    force: ArrayLike
    moment: ArrayLike = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class JointLoads:
    """What the parent exerts on the child at each joint, in world axes.

    Attributes:
        joint_names: the joints asked for, ``n`` of them, in model order.
        force: ``(..., n, 3)`` N.
        moment: ``(..., n, 3)`` N m about the joint's centre.
        dof_names: their degrees of freedom.
        torque: ``(..., n_dof)`` N m, the moment along each degree of freedom.
    """

    joint_names: tuple[str, ...]
    force: Array
    moment: Array
    dof_names: tuple[str, ...]
    torque: Array


def inverse_dynamics(
    model: HumanModel,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    wrenches: Sequence[Wrench] = (),
    *,
    gravity: ArrayLike = GRAVITY,
) -> Array:
    """Computes the generalized forces of a motion.

    Args:
        model: the person.
        q: ``(..., nq)`` configurations.
        v: ``(..., nv)`` velocities, base twist in body axes; None stands for zero.
        a: ``(..., nv)`` accelerations; None stands for zero.
        wrenches: what acts on the person from outside.
        gravity: ``(3,)`` m/s^2, world axes.

    Returns:
        ``(..., nv)``: the wrench the base must be held by (N, N m; body axes, linear first), then a
        torque (N m) for each degree of freedom; equal to Pinocchio's ``rnea`` to rounding.

    Raises:
        ConfigurationError: shapes do not fit or numbers are not finite.
        UnknownNameError: a wrench acts at a frame that the model has not.
    """
    everything = (True,) * len(model.segment_names)
    inputs = _check(model, q, v, a, wrenches, gravity)
    out = np.empty((len(inputs.q), model.nv))
    for rows, loads in _chunks(model, inputs, everything):
        out[rows, :3] = np.einsum("cib,ib->bc", loads.columns[0], loads.force[0])
        out[rows, 3:6] = np.einsum("cib,ib->bc", loads.columns[0], loads.moment[0])
        out[rows, BASE_NV:] = loads.torque.T
    return out.reshape(*inputs.batch, model.nv)


def joint_loads(
    model: HumanModel,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    wrenches: Sequence[Wrench] = (),
    *,
    joints: Sequence[str] | None = None,
    gravity: ArrayLike = GRAVITY,
) -> JointLoads:
    """Computes force, moment and torques at some or all joints.

    Asking for the joints from hand to ``jL5S1`` alone leaves the legs out of the computation.

    Args:
        model: the person.
        q: ``(..., nq)`` configurations.
        v: ``(..., nv)`` velocities; None stands for zero.
        a: ``(..., nv)`` accelerations; None stands for zero.
        wrenches: what acts on the person from outside.
        joints: joint names; None stands for all.
        gravity: ``(3,)`` m/s^2, world axes.

    Raises:
        ConfigurationError: shapes do not fit or numbers are not finite.
        UnknownNameError: no such joint, or a wrench acts at a frame that the model has not.
    """
    names = model.joint_names if joints is None else tuple(joints)
    for name in names:
        if name not in model.joint_names:
            raise UnknownNameError("joint", name, model.joint_names)
    chosen = [index for index, name in enumerate(model.joint_names) if name in names]
    wanted = [False] * len(model.segment_names)
    for index in range(1, len(wanted)):
        wanted[index] = index - 1 in chosen or wanted[model.parents[index]]
    inputs = _check(model, q, v, a, wrenches, gravity)
    batch, count = inputs.batch, len(inputs.q)
    segments = [index + 1 for index in chosen]
    dofs = [dof for dof, joint in enumerate(model.dof_joints) if int(joint) in chosen]
    force, moment = np.empty((2, len(segments), 3, count))
    torque = np.empty((len(dofs), count))
    for rows, loads in _chunks(model, inputs, tuple(wanted)):
        force[..., rows], moment[..., rows] = loads.force[segments], loads.moment[segments]
        torque[:, rows] = loads.torque[dofs]
    return JointLoads(
        joint_names=tuple(model.joint_names[index] for index in chosen),
        force=np.moveaxis(force.reshape(len(segments), 3, *batch), (0, 1), (-2, -1)),
        moment=np.moveaxis(moment.reshape(len(segments), 3, *batch), (0, 1), (-2, -1)),
        dof_names=tuple(model.dof_names[dof] for dof in dofs),
        torque=np.moveaxis(torque.reshape(len(dofs), *batch), 0, -1),
    )


def joint_moments(
    model: HumanModel,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    wrenches: Sequence[Wrench] = (),
) -> Array:
    """Returns the moments ``(..., n_joints, 3)`` N m, parent on child, in world axes.

    It is the whole vector, whatever axes the joint turns about; its norm is the joint's effort. See
    `joint_loads` for arguments, errors, and some joints alone.
    """
    return joint_loads(model, q, v, a, wrenches).moment


def joint_forces(
    model: HumanModel,
    q: ArrayLike,
    v: ArrayLike | None = None,
    a: ArrayLike | None = None,
    wrenches: Sequence[Wrench] = (),
) -> Array:
    """Returns the forces ``(..., n_joints, 3)`` N, parent on child, in world axes.

    See `joint_loads` for arguments and errors.
    """
    return joint_loads(model, q, v, a, wrenches).force


@dataclass(frozen=True, slots=True)
class _Inputs:
    """Checked arguments, flattened to one batch dimension."""

    batch: tuple[int, ...]
    q: Array
    v: Array | None
    a: Array | None
    points: tuple[tuple[int, Array, Array, Array], ...]
    gravity: Array


def _check(
    model: HumanModel,
    q: ArrayLike,
    v: ArrayLike | None,
    a: ArrayLike | None,
    wrenches: Sequence[Wrench],
    gravity: ArrayLike,
) -> _Inputs:
    batch, flat = flat_configurations(model, q)
    pull = np.asarray(gravity, dtype=np.float64)
    if pull.shape != (3,) or not np.all(np.isfinite(pull)):
        raise ConfigurationError(f"gravity: expected three finite m/s^2, got {gravity!r}")
    return _Inputs(
        batch=batch,
        q=flat,
        v=None if v is None else _like(v, batch, model.nv, "v"),
        a=None if a is None else _like(a, batch, model.nv, "a"),
        points=tuple(
            (
                *model.point(wrench.frame),
                _like(wrench.force, batch, 3, f"force on {wrench.frame}").T,
                _like(wrench.moment, batch, 3, f"moment on {wrench.frame}").T,
            )
            for wrench in wrenches
        ),
        gravity=pull,
    )


def _chunks(
    model: HumanModel, inputs: _Inputs, wanted: tuple[bool, ...]
) -> Iterator[tuple[slice, SegmentLoads]]:
    """Yields frames and their loads; the loads hold until the next ones are asked for."""
    count = len(inputs.q)
    space = workspace(model, min(CHUNK, count))
    for start in range(0, count, CHUNK):
        rows = slice(start, min(start + CHUNK, count))
        loads = tuple(
            PointLoad(segment, position, force[:, rows], moment[:, rows])
            for segment, position, force, moment in inputs.points
        )
        v = None if inputs.v is None else inputs.v[rows]
        a = None if inputs.a is None else inputs.a[rows]
        yield rows, newton_euler(model, inputs.q[rows], v, a, loads, inputs.gravity, wanted, space)


def _like(value: ArrayLike, batch: tuple[int, ...], width: int, what: str) -> Array:
    """Checks and spreads ``(..., width)`` over the batch, flattened to ``(batch, width)``."""
    array = np.asarray(value, dtype=np.float64)
    try:
        spread = np.broadcast_to(array, (*batch, width))
    except ValueError:
        raise ConfigurationError(
            f"{what}: expected shape {(*batch, width)} or one that spreads to it, got {array.shape}"
        ) from None
    if not np.all(np.isfinite(array)):
        raise ConfigurationError(f"{what}: expected finite numbers, got NaN or infinity")
    return spread.reshape(-1, width)
