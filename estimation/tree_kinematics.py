"""What the equations of motion need to know of a pose and its velocities, for many frames at once.

All of it is free of the base's linear velocity, which nobody measures.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimation.errors import MeasurementError
from estimation.spatial import GRAVITY_MS2, Array, cross, motion_transform, times, transposed
from estimation.tree import BASE_NQ, BASE_NV, EstimationTree
from human.rotations import quaternion_to_matrix

_NORM_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class TreeKinematics:
    """Transforms and velocity-dependent terms of each link, its own axes, frames first.

    Attributes:
        X: for each link but the base, ``(frames, 6, 6)``: accelerations from parent to child.
        H: for each link, ``(frames, 6, k)``: what a joint acceleration adds to the link's.
        bias: ``(n_links, frames, 6)`` acceleration relative to the parent's from velocities alone.
        gyro: ``(n_links, frames, 6)`` N, N m: inertial wrench from velocities alone.
        omega: ``(n_links, frames, 3)`` rad/s.
        rotation: ``(n_links, frames, 3, 3)`` link axes in the world.
        position: ``(n_links, frames, 3)`` m, link origins in the world.
    """

    X: tuple[Array, ...]
    H: tuple[Array, ...]
    bias: Array
    gyro: Array
    omega: Array
    rotation: Array
    position: Array


def check_state(
    tree: EstimationTree, q: ArrayLike, v: ArrayLike | None, a: ArrayLike | None = None
) -> tuple[Array, Array, Array | None]:
    """Checks configurations, velocities and accelerations of a run.

    Args:
        tree: the links.
        q: ``(frames, 7 + n_dof)`` base position, base quaternion xyzw, joint angles.
        v: ``(frames, 6 + n_dof)`` base twist in body axes, joint rates; None stands for rest.
        a: ``(frames, 6 + n_dof)``; None where there is none.

    Raises:
        MeasurementError: a shape does not fit, a number is not finite, a quaternion is not unit.
    """
    state = np.asarray(q, dtype=np.float64)
    if state.ndim != 2 or state.shape[1] != BASE_NQ + tree.n_dof or not len(state):
        raise MeasurementError(
            f"q: expected shape (frames, {BASE_NQ + tree.n_dof}), got {state.shape}"
        )
    _finite("q", state)
    askew = np.abs(np.linalg.norm(state[:, 3:7], axis=1) - 1.0) > _NORM_TOLERANCE
    if np.any(askew):
        raise MeasurementError(
            "q: expected unit base quaternions xyzw", np.flatnonzero(askew).tolist()
        )
    shape = (len(state), BASE_NV + tree.n_dof)
    checked: list[Array | None] = []
    for name, value in (("v", np.zeros(shape) if v is None else v), ("a", a)):
        array = None if value is None else np.asarray(value, dtype=np.float64)
        if array is not None and array.shape != shape:
            raise MeasurementError(f"{name}: expected shape {shape}, got {array.shape}")
        if array is not None:
            _finite(name, array)
        checked.append(array)
    velocity = checked[0]
    assert velocity is not None
    return state, velocity, checked[1]


def _finite(name: str, array: Array) -> None:
    bad = np.flatnonzero(~np.all(np.isfinite(array), axis=1))
    if len(bad):
        raise MeasurementError(f"{name}: expected finite numbers", bad.tolist())


def tree_kinematics(tree: EstimationTree, q: Array, v: Array) -> TreeKinematics:
    """Computes transforms and velocity terms of checked states.

    Args:
        tree: the links.
        q: ``(frames, 7 + n_dof)``.
        v: ``(frames, 6 + n_dof)``; of the base only its angular velocity is used.

    Source: Latella et al. 2019, eq. 16 and 17; the angular bias of a joint of several axes is
    derived here: each axis adds ``w x u s'`` in the axes left by those before it.
    """
    frames, count = len(q), tree.n_links
    omega, bias, gyro = np.empty((count, frames, 3)), *np.zeros((2, count, frames, 6))
    rotation, position = np.empty((count, frames, 3, 3)), np.empty((count, frames, 3))
    transforms, subspaces = [np.empty((frames, 6, 6))], [np.empty((frames, 6, 0))]
    rotation[0], position[0], omega[0] = quaternion_to_matrix(q[:, 3:7]), q[:, :3], v[:, 3:6]
    sine, cosine = np.sin(q[:, BASE_NQ:]), np.cos(q[:, BASE_NQ:])
    for link, parent in enumerate(tree.parents[1:], 1):
        columns = np.zeros((frames, 3, len(tree.axes[link])))
        turned = np.zeros((frames, 3, 3))
        turned[:] = np.eye(3)
        w, beta = omega[parent].copy(), np.zeros((frames, 3))
        for place, (axis, dof) in enumerate(zip(tree.axes[link], tree.dofs[link], strict=True)):
            c, s = cosine[:, dof], sine[:, dof]
            _turn_back(w, axis, c, s)
            _turn_back(beta, axis, c, s)
            for earlier in range(place):
                _turn_back(columns[:, :, earlier], axis, c, s)
            for row in range(3):
                _turn_back(turned[:, row], axis, c, s)
            rate = v[:, BASE_NV + dof]
            w[:, axis] += rate
            # w x (axis * rate), of which w's own part along the axis drops out.
            left, right = (axis + 1) % 3, (axis + 2) % 3
            beta[:, left] += w[:, right] * rate
            beta[:, right] -= w[:, left] * rate
            columns[:, axis, place] = 1.0
        offset = tree.offsets[link]
        transforms.append(motion_transform(turned, offset))
        subspace = np.zeros((frames, 6, len(tree.axes[link])))
        subspace[:, 3:] = columns
        subspaces.append(subspace)
        omega[link] = w
        centripetal = cross(omega[parent], cross(omega[parent], offset))
        bias[link, :, :3] = times(transposed(turned), centripetal)
        bias[link, :, 3:] = beta
        rotation[link] = rotation[parent] @ turned
        position[link] = position[parent] + rotation[parent] @ offset
    for link in range(count):
        inertia = tree.inertias[link]
        if np.any(inertia):
            momentum = omega[link] @ inertia[:, 3:].T
            gyro[link, :, :3] = cross(omega[link], momentum[:, :3])
            gyro[link, :, 3:] = cross(omega[link], momentum[:, 3:])
    return TreeKinematics(
        tuple(transforms), tuple(subspaces), bias, gyro, omega, rotation, position
    )


def _turn_back(vector: Array, axis: int, cosine: Array, sine: Array) -> None:
    """Expresses vectors ``(frames, 3)`` in axes turned about one of them, in place."""
    left, right = (axis + 1) % 3, (axis + 2) % 3
    before = vector[:, left].copy()
    vector[:, left] = cosine * before + sine * vector[:, right]
    vector[:, right] = cosine * vector[:, right] - sine * before


def base_acceleration(kinematics: TreeKinematics, v: Array, a: Array) -> Array:
    """Returns the base's proper acceleration ``(frames, 6)``: what an accelerometer there reads.

    Args:
        kinematics: of the same frames.
        v: ``(frames, 6 + n_dof)`` body twist first.
        a: ``(frames, 6 + n_dof)`` its derivative in body axes first.

    Source: Latella et al. 2019, eq. 12. The body acceleration lacks ``omega x v``; the sign of
    eq. 13 as printed is the other one.
    """
    return proper_acceleration(kinematics.rotation[0], v, a)


def proper_acceleration(rotation: Array, v: Array, a: Array) -> Array:
    """The same from the base's axes in the world ``(frames, 3, 3)`` alone."""
    out = a[:, :6].copy()
    out[:, :3] += cross(v[:, 3:6], v[:, :3])
    out[:, :3] += rotation[:, 2] * GRAVITY_MS2
    return out


def link_accelerations(
    tree: EstimationTree, kinematics: TreeKinematics, base: Array, joints: Array
) -> Array:
    """Carries the base's proper acceleration ``(frames, 6)`` out to all links.

    Args:
        tree: the links.
        kinematics: of the same frames.
        base: ``(frames, 6)`` proper acceleration of the base.
        joints: ``(frames, n_dof)`` joint accelerations, rad/s^2.

    Returns:
        ``(n_links, frames, 6)``, link axes at the links' origins.

    Source: Latella et al. 2019, eq. 16.
    """
    out = np.empty((tree.n_links, *base.shape))
    out[0] = base
    for link, parent in enumerate(tree.parents[1:], 1):
        out[link] = times(kinematics.X[link], out[parent]) + kinematics.bias[link]
        out[link] += times(kinematics.H[link], joints[:, tree.dofs[link]])
    return out


def rows(count: int, size: int) -> Iterator[slice]:
    """Yields slices of at most ``size`` frames."""
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))
