"""Joint angles of one segment pair from its relative rotation, within the joint's limits.

A joint is three revolutes, ``R = Rx(a) Ry(b) Rz(c)``. Inside the limits the angles follow in closed
form; outside, the angles in the box of limits that come nearest to ``R`` (least rotation angle) are
found by enumerating the box's faces, edges and corners, on each of which the optimum is again in
closed form.

Derived here. With half angles, the quaternion of ``R(a, b, c)`` is trilinear in ``u(t) = (cos t/2,
sin t/2)``, so the cosine of half the distance to a measured quaternion is a 2x2x2 tensor contracted
with ``u(a)``, ``u(b)``, ``u(c)``. Fixing one angle leaves ``u^T M v``, maximal where the two
rotations of the polar form of ``M`` say; it has one maximum (the other stationary point is a
saddle), so that the optimum over a face is this point if it lies inside, and else lies on an edge.
Fixing two angles leaves ``g . u``, maximal at ``2 atan2(g1, g0)``. Hence the best of at most 6 + 12
+ 8 points is the true constrained optimum.

Source: Latella et al. 2019, eq. (6), with the distance taken as the angle of the rotation error,
    which
unlike a difference of Euler angles does not depend on the axes.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from human.rotations import (
    matrix_to_quaternion,
    matrix_to_xyz,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    quaternion_to_rotation_vector,
    xyz_to_matrix,
)

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: The middle axis this near to 90 degrees: rates of the two others are unreliable; the frame is
#: flagged.
NEAR_SINGULAR_RAD = np.deg2rad(5.0)
#: And this near: the other two are one turn shared between them; the share is interpolated over
#: time.
FROZEN_RAD = np.deg2rad(0.1)
_LIMIT_TOLERANCE_RAD = 1e-9
#: Weight of the squared angles themselves beside their squared steps when a branch is chosen.
_SMALLNESS = 1e-3
_TURN = 2.0 * np.pi


@dataclass(frozen=True, slots=True)
class PairSolution:
    """Angles of one joint over time.

    Attributes:
        angles: ``(frames, 3)`` rad, x, y, z.
        error_rad: ``(frames,)`` angle between the measured rotation and that of the angles.
        limited: ``(frames,)`` a limit is active: the measured rotation lies outside.
        near_singular: ``(frames,)`` the middle angle is within 5 degrees of 90.
        frozen: ``(frames,)`` it is within 0.1 degree, and the split of the other two is
            interpolated.
    """

    angles: Array
    error_rad: Array
    limited: Flags
    near_singular: Flags
    frozen: Flags


def solve_pair(quat_xyzw: Array, lower: Array, upper: Array) -> PairSolution:
    """Finds the angles of one joint over a recording.

    Of the two exact solutions ``(a, b, c)`` and ``(a + pi, pi - b, c + pi)`` the one inside the
    limits is taken, and where both are, the path through time with the smallest steps.

    Args:
        quat_xyzw: ``(frames, 4)`` child axes in the parent's.
        lower: ``(3,)`` rad, may be ``-inf``.
        upper: ``(3,)`` rad, may be ``inf``.
    """
    rotation = quaternion_to_matrix(quat_xyzw)
    first = matrix_to_xyz(rotation)
    second = np.stack([first[:, 0] + np.pi, np.pi - first[:, 1], first[:, 2] + np.pi], axis=-1)
    both = _into_limits(np.stack([first, second], axis=1), lower, upper)
    inside = np.all(
        (both >= lower - _LIMIT_TOLERANCE_RAD) & (both <= upper + _LIMIT_TOLERANCE_RAD), axis=-1
    )
    middle = np.abs(np.abs(first[:, 1]) - np.pi / 2.0)
    frozen = middle < FROZEN_RAD
    limited = ~np.any(inside, axis=1) & ~frozen
    if np.any(limited):
        both[limited] = nearest_in_box(quat_xyzw[limited], lower, upper)[:, None]
        inside[limited] = True
    periodic = ~np.isfinite(upper - lower)
    angles = _smoothest(both, inside, ~frozen, periodic)
    if np.any(frozen):
        angles, failed = _frozen_split(quat_xyzw, angles, frozen, lower, upper)
        if np.any(failed):
            angles[failed] = nearest_in_box(quat_xyzw[failed], lower, upper)
            limited |= failed
            frozen &= ~failed
    if np.any(periodic):
        angles[:, periodic] = np.unwrap(angles[:, periodic], axis=0)
    angles = np.clip(angles, lower, upper)
    return PairSolution(
        angles, distance(quat_xyzw, angles), limited, middle < NEAR_SINGULAR_RAD, frozen
    )


def distance(quat_xyzw: Array, angles: Array) -> Array:
    """Returns the angle ``(frames,)`` (rad) between rotations and those of x-y-z angles."""
    made = matrix_to_quaternion(xyz_to_matrix(angles))
    error = quaternion_multiply(quaternion_conjugate(made), quat_xyzw)
    return np.asarray(np.linalg.norm(quaternion_to_rotation_vector(error), axis=-1))


def _into_limits(angles: Array, lower: Array, upper: Array) -> Array:
    """Adds whole turns so that each angle is within half a turn of the middle of its range."""
    low, high = (
        np.where(np.isfinite(lower), lower, -np.pi),
        np.where(np.isfinite(upper), upper, np.pi),
    )
    centre = 0.5 * (low + high)
    return np.asarray(angles - _TURN * np.round((angles - centre) / _TURN))


def _smoothest(both: Array, inside: Flags, counted: Flags, periodic: Flags) -> Array:
    """Chooses one of two candidates per frame by the least sum of squared steps through time.

    Args:
        both: ``(frames, 2, 3)`` candidates.
        inside: ``(frames, 2)`` those allowed.
        counted: ``(frames,)`` frames that take part; the others get their first allowed candidate.
        periodic: ``(3,)`` angles whose steps are taken modulo a turn.
    """
    choice = np.argmax(inside, axis=1)
    frames = np.flatnonzero(counted)
    if np.any(np.all(inside[frames], axis=1)) and frames.size:
        candidates, allowed = both[frames], inside[frames]
        own = _SMALLNESS * np.sum(candidates**2, axis=-1) + np.where(allowed, 0.0, np.inf)
        step = candidates[1:, None, :, :] - candidates[:-1, :, None, :]
        step = np.where(periodic, step - _TURN * np.round(step / _TURN), step)
        steps = np.sum(step**2, axis=-1)  # (frames - 1, from, to)
        choice[frames] = _least_path(own.tolist(), steps.reshape(-1, 4).tolist())
    return np.asarray(both[np.arange(len(both)), choice])


def _least_path(own: list[list[float]], steps: list[list[float]]) -> list[int]:
    """Returns the cheapest way through two states per frame, by dynamic programming.

    Plain floats: arrays of two elements cost more than the arithmetic.

    Args:
        own: cost of states 0 and 1 in each frame.
        steps: cost from each frame to the next, ``[0 to 0, 0 to 1, 1 to 0, 1 to 1]``.
    """
    zero, one = own[0]
    origins: list[tuple[int, int]] = []
    for (zero_zero, zero_one, one_zero, one_one), (own_zero, own_one) in zip(
        steps, own[1:], strict=True
    ):
        stay, back = zero + zero_zero, one + one_zero
        leave, keep = zero + zero_one, one + one_one
        origins.append((int(back < stay), int(keep < leave)))
        zero, one = min(stay, back) + own_zero, min(leave, keep) + own_one
    path = [int(one < zero)]
    for origin in reversed(origins):
        path.append(origin[path[-1]])
    return path[::-1]


def _frozen_split(
    quat: Array, angles: Array, frozen: Flags, lower: Array, upper: Array
) -> tuple[Array, Flags]:
    """Redoes frames at the singularity: the first angle interpolated, the others the nearest to it.

    Returns:
        The angles, and the frozen frames where a limit would be left that way.
    """
    kept = np.flatnonzero(~frozen)
    at = np.flatnonzero(frozen)
    out = angles.copy()
    if kept.size:
        guess = np.stack([np.interp(at, kept, angles[kept, k]) for k in range(3)], axis=-1)
    else:
        guess = np.zeros((len(at), 3))
    guess[:, 0] = np.clip(guess[:, 0], lower[0], upper[0])
    face = np.einsum("nijk,ni->njk", _tensor(quat[at]), _half(guess[:, 0]))
    b, c = _best_on_face(face)
    solved = np.stack([guess[:, 0], b, c], axis=-1)
    solved[:, 1:] -= _TURN * np.round((solved[:, 1:] - guess[:, 1:]) / _TURN)
    out[at] = solved
    failed = np.zeros(len(quat), dtype=np.bool_)
    failed[at] = np.any((solved < lower - 1e-6) | (solved > upper + 1e-6), axis=-1)
    return out, failed


def _half(angle: Array) -> Array:
    return np.stack([np.cos(0.5 * angle), np.sin(0.5 * angle)], axis=-1)


def _tensor(quat: Array) -> Array:
    """The inner product of a quaternion with that of ``Rx(a) Ry(b) Rz(c)``, as ``(n, 2, 2, 2)``."""
    x, y, z, w = quat.T
    out = np.empty((len(quat), 2, 2, 2))
    out[:, 0, 0, 0], out[:, 1, 1, 1] = w, -w
    out[:, 1, 0, 0], out[:, 0, 1, 1] = x, x
    out[:, 0, 1, 0], out[:, 1, 0, 1] = y, -y
    out[:, 0, 0, 1], out[:, 1, 1, 0] = z, z
    return out


def _best_on_face(m: Array) -> tuple[Array, Array]:
    """Angles that make ``u(s)^T M u(t)`` largest; ``m`` is ``(n, 2, 2)``."""
    difference = np.arctan2(m[:, 1, 0] - m[:, 0, 1], m[:, 0, 0] + m[:, 1, 1])
    total = np.arctan2(m[:, 0, 1] + m[:, 1, 0], m[:, 0, 0] - m[:, 1, 1])
    return total + difference, total - difference


def nearest_in_box(quat: Array, lower: Array, upper: Array) -> Array:
    """Returns the angles within limits whose rotation is nearest to rotations outside the limits.

    Args:
        quat: ``(n, 4)`` xyzw.
        lower: ``(3,)`` rad, may be ``-inf``.
        upper: ``(3,)`` rad, may be ``inf``.

    Returns:
        ``(n, 3)`` rad.
    """
    tensor = _tensor(quat)
    bounds = [[float(v) for v in pair if np.isfinite(v)] for pair in zip(lower, upper, strict=True)]
    best = np.zeros((len(quat), 3))
    best_cosine = np.full(len(quat), -1.0)
    # Each angle is free (None) or at one of its bounds; all three free is the interior, excluded
    # here.
    for fixed in product(*([None, *pair] for pair in bounds)):
        free = [k for k in range(3) if fixed[k] is None]
        if len(free) == 3:
            continue
        point = np.empty((len(quat), 3))
        reduced = tensor
        for k in (2, 1, 0):  # contract from the back so that the remaining axes keep their place
            value = fixed[k]
            if value is not None:
                point[:, k] = value
                reduced = np.tensordot(reduced, _half(np.array(value)), axes=([k + 1], [0]))
        if len(free) == 2:
            point[:, free[0]], point[:, free[1]] = _best_on_face(reduced)
        elif len(free) == 1:
            point[:, free[0]] = 2.0 * np.arctan2(reduced[:, 1], reduced[:, 0])
        point = np.where([k in free for k in range(3)], _into_limits(point, lower, upper), point)
        ok = np.all((point >= lower) & (point <= upper), axis=-1)
        halves = [_half(point[:, k]) for k in range(3)]
        cosine = np.abs(np.einsum("nijk,ni,nj,nk->n", tensor, *halves))
        better = ok & (cosine > best_cosine)
        best[better], best_cosine[better] = point[better], cosine[better]
    return best
