"""The recursive Newton-Euler algorithm on whole batches, in world axes, batch last.

In world axes nothing has to be transformed on the way down the tree: forces add, moments add with a
lever. Vectors are stored as five rows, x y z x y, so that a cross product is three calls over whole
batches.

Source: Luh, Walker and Paul 1980 (the recursion); its world-axes form derived here: for a segment
with joint centre acceleration ``s`` (gravity taken off), ``F = m (s + alpha x c + omega x (omega x
c))`` and ``N = I alpha + omega x I omega`` about its centre of mass ``c``; the parent bears, about
the joint centre, ``f = F - f_ext + sum f_child`` and ``m = N + c x F - m_ext + sum (m_child +
r_child x f_child)``.
"""

from dataclasses import dataclass

import numpy as np

from human.columns import cosine_sine, shift_along, turn
from human.model import BASE_NQ, BASE_NV, Array, HumanModel
from human.rotations import quaternion_to_matrix


@dataclass(slots=True)
class SegmentLoads:
    """What each segment's parent bears, batch last.

    Attributes:
        force: ``(n_segments, 3, batch)`` N, parent on segment, world axes.
        moment: ``(n_segments, 3, batch)`` N m about the segment's proximal joint, world axes.
        torque: ``(n_dof, batch)`` N m, the moment along each degree of freedom.
        columns: ``(n_segments, 3, 3, batch)`` segment rotations [column, row].
    """

    force: Array
    moment: Array
    torque: Array
    columns: Array


@dataclass(frozen=True, slots=True)
class PointLoad:
    """A force and moment on a segment at a point fixed to it.

    Attributes:
        segment: its index.
        position: ``(3,)`` m in segment axes.
        force: ``(3, batch)`` N, world axes.
        moment: ``(3, batch)`` N m, world axes.
    """

    segment: int
    position: Array
    force: Array
    moment: Array


@dataclass(slots=True)
class Workspace:
    """Memory that the recursion works in, batch last; made once and used chunk after chunk."""

    columns: Array
    axes: Array
    lever: Array
    omega: Array
    alpha: Array
    proper: Array
    force: Array
    moment: Array
    torque: Array
    work: Array
    pair: Array


_ROWS = tuple(Workspace.__dataclass_fields__)


def workspace(model: HumanModel, count: int) -> Workspace:
    """Returns memory for chunks of up to ``count`` frames."""
    segments = len(model.segment_names)
    return Workspace(
        columns=np.empty((segments, 3, 3, count)),
        axes=np.empty((model.n_dof, 3, count)),
        lever=np.zeros((segments, 5, count)),
        omega=np.zeros((segments, 5, count)),
        alpha=np.zeros((segments, 5, count)),
        proper=np.empty((segments, 3, count)),
        force=np.empty((segments, 5, count)),
        moment=np.empty((segments, 3, count)),
        torque=np.empty((model.n_dof, count)),
        work=np.empty((3, 3, count)),
        pair=np.empty((2, 5, count)),
    )


def newton_euler(
    model: HumanModel,
    q: Array,
    v: Array | None,
    a: Array | None,
    loads: tuple[PointLoad, ...],
    gravity: Array,
    wanted: tuple[bool, ...],
    space: "Workspace",
) -> SegmentLoads:
    """Runs the recursion on one chunk.

    Args:
        model: the person.
        q: ``(batch, nq)``, checked.
        v: ``(batch, nv)``, or None for standing still.
        a: ``(batch, nv)``, or None for zero.
        loads: what acts on the person.
        gravity: ``(3,)`` m/s^2, world axes.
        wanted: ``n_segments`` flags: whose loads are needed. A wanted segment's descendants must be
            too.
        space: memory for at least as many frames, overwritten.

    Returns:
        The loads, views of ``space`` that hold until it is used again. Rows of segments and degrees
        of freedom that were not wanted are left undefined.
    """
    count, segments = len(q), len(model.segment_names)
    reach = _carriers(model, wanted)
    cosine, sine = cosine_sine(q[:, BASE_NQ:].T)
    rates = None if v is None else np.ascontiguousarray(v[:, BASE_NV:].T)
    rates_of_rates = None if a is None else np.ascontiguousarray(a[:, BASE_NV:].T)
    still = rates is None and rates_of_rates is None

    space = Workspace(**{name: getattr(space, name)[..., :count] for name in _ROWS})
    columns, axes, lever, omega, alpha = (
        space.columns,
        space.axes,
        space.lever,
        space.omega,
        space.alpha,
    )
    proper, force, moment, torque = space.proper, space.force, space.moment, space.torque
    work, (first, second) = space.work, space.pair
    nowhere = np.zeros((3, count))
    omega[0] = 0.0
    alpha[0] = 0.0

    columns[0] = quaternion_to_matrix(q[:, 3:7]).T
    _start(columns[0], v, a, gravity, omega[0], alpha[0], proper[0])
    for index in range(1, segments):
        if not reach[index]:
            continue
        parent, joint = model.parents[index], index - 1
        here = columns[index]
        here[...] = columns[parent]
        shift_along(here, nowhere, model.offsets[joint], lever[index, :3], work[0])
        _close(lever[index])
        proper[index] = proper[parent]
        if not still:
            _add_turning(proper[index], omega[parent], alpha[parent], lever[index], first, work)
            omega[index], alpha[index] = omega[parent], alpha[parent]
        for dof in model.joint_dofs(joint):
            axis = int(model.dof_axes[dof])
            axes[dof] = here[axis]
            if rates is not None:
                np.multiply(here[axis], rates[dof], out=first[:3])
                _close(first)
                alpha[index, :3] += _cross(omega[index], first, work[0], work[1])
                omega[index, :3] += first[:3]
                _close(omega[index])
            if rates_of_rates is not None:
                alpha[index, :3] += np.multiply(here[axis], rates_of_rates[dof], out=work[0])
            turn(here, axis, cosine[dof], sine[dof], work)
        _close(alpha[index])

    for index in range(segments):
        if wanted[index]:
            _inertial(
                model,
                index,
                columns,
                omega,
                alpha,
                proper,
                force,
                moment,
                (first, second),
                work,
                still,
            )
    for load in loads:
        if wanted[load.segment]:
            shift_along(columns[load.segment], nowhere, load.position, first[:3], work[0])
            _close(first)
            second[:3] = load.force
            _close(second)
            force[load.segment, :3] -= load.force
            moment[load.segment] -= load.moment
            moment[load.segment] -= _cross(first, second, work[0], work[1])
    for index in range(segments - 1, 0, -1):
        parent = model.parents[index]
        if wanted[parent] and wanted[index]:
            _close(force[index])
            force[parent, :3] += force[index, :3]
            moment[parent] += moment[index]
            moment[parent] += _cross(lever[index], force[index], work[0], work[1])
    for dof, joint in enumerate(model.dof_joints):
        if wanted[joint + 1]:
            np.einsum("ib,ib->b", axes[dof], moment[joint + 1], out=torque[dof])
    return SegmentLoads(force[:, :3], moment, torque, columns)


def _carriers(model: HumanModel, wanted: tuple[bool, ...]) -> list[bool]:
    """Wanted segments and everything between them and the root, whose motion they share."""
    reach = list(wanted)
    for index in range(len(wanted) - 1, 0, -1):
        if reach[index]:
            reach[model.parents[index]] = True
    return reach


def _start(
    columns: Array,
    v: Array | None,
    a: Array | None,
    gravity: Array,
    omega: Array,
    alpha: Array,
    proper: Array,
) -> None:
    """Turns the base twist, in body axes, into world rates and its origin's proper acceleration."""
    proper[...] = -gravity[:, None]
    linear_rate = np.zeros_like(proper)
    if v is not None:
        body = v[:, :BASE_NV].T
        linear_rate += np.cross(body[3:], body[:3], axis=0)
        omega[:3] = np.einsum("cib,cb->ib", columns, body[3:])
        _close(omega)
    if a is not None:
        body = a[:, :BASE_NV].T
        linear_rate += body[:3]
        alpha[:3] = np.einsum("cib,cb->ib", columns, body[3:])
        _close(alpha)
    proper += np.einsum("cib,cb->ib", columns, linear_rate)


def _inertial(
    model: HumanModel,
    index: int,
    columns: Array,
    omega: Array,
    alpha: Array,
    proper: Array,
    force: Array,
    moment: Array,
    scratch: tuple[Array, Array],
    work: Array,
    still: bool,
) -> None:
    """Writes what one segment alone asks of its parent: force, and moment about its joint."""
    center, momentum = scratch
    here, mass, inertia = columns[index], float(model.masses[index]), model.inertias[index]
    work[2] = 0.0
    shift_along(here, work[2], model.centers_of_mass[index], center[:3], work[0])
    _close(center)
    net = force[index]
    net[:3] = proper[index]
    if not still:
        _add_turning(net[:3], omega[index], alpha[index], center, momentum, work)
    net[:3] *= mass
    _close(net)
    moment[index] = _cross(center, net, work[0], work[1])
    if not still:
        moment[index] += _world_inertia_times(here, inertia, alpha[index, :3], work)
        momentum[:3] = _world_inertia_times(here, inertia, omega[index, :3], work)
        _close(momentum)
        moment[index] += _cross(omega[index], momentum, work[0], work[1])


def _world_inertia_times(columns: Array, inertia: Array, vector: Array, work: Array) -> Array:
    """Returns ``R I R' v``, ``(3, batch)``; a diagonal ``I`` takes the short way."""
    body = np.einsum("cib,ib->cb", columns, vector, out=work[0])
    if np.count_nonzero(inertia - np.diag(np.diagonal(inertia))):
        turned = inertia @ body
    else:
        turned = np.multiply(body, np.diagonal(inertia)[:, None], out=work[1])
    return np.asarray(np.einsum("cib,cb->ib", columns, turned, out=work[2]))


def _add_turning(
    out: Array, omega: Array, alpha: Array, lever: Array, scratch: Array, work: Array
) -> None:
    """Adds ``alpha x r + omega x (omega x r)`` to ``out``."""
    out += _cross(alpha, lever, work[0], work[1])
    scratch[:3] = _cross(omega, lever, work[0], work[1])
    _close(scratch)
    out += _cross(omega, scratch, work[0], work[1])


def _close(vector: Array) -> None:
    """Repeats x and y below z, after the first three rows have been set."""
    vector[3:] = vector[:2]


def _cross(left: Array, right: Array, out: Array, scratch: Array) -> Array:
    """Writes the cross product of two five-row vectors to ``out`` ``(3, batch)`` and returns it."""
    np.multiply(left[1:4], right[2:5], out=out)
    np.multiply(left[2:5], right[1:4], out=scratch)
    return np.subtract(out, scratch, out=out)
