"""Postures nearest to markers, many frames at once, each frame for itself.

Levenberg-Marquardt on a loss that is quadratic up to a few standard deviations and logarithmic
beyond, so that a marker that sits on another limb moves nothing.

Source: Levenberg 1944, Marquardt 1963; Huber 1981, chapter 7 (reweighting); the loss derived here:
its weight ``(k / r)^2`` beyond ``k`` makes a marker's pull fall as 1 / r.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from human.markers.ik_priors import Prior, Pull, no_pull
from human.markers.ik_system import MarkerSystem
from human.model import BASE_NQ, BASE_NV, Array
from human.threads import single_threaded

Flags = NDArray[np.bool_]

#: Frames worked on at once: their matrices then stay in the processor's cache.
_CHUNK = 512
_MOST_STEPS = 40
#: A step that promises less than this gain of half a squared standard deviation is the last.
_LAST_GAIN = 1e-8
#: Longest step of any unknown (m, rad).
_LONGEST_STEP = 0.6
#: A frame with more than this still to gain has not settled.
_SETTLED_GAIN = 1e-3
_DAMPING_START, _DAMPING_LEAST, _DAMPING_MOST = 1e-4, 1e-12, 1e6
#: Distance within which a marker counts in full: standard deviations, and metres at least.
_FULL_SD, _FULL_LEAST_M = 4.0, 0.03
#: And beyond which it is not believed, in multiples of that.
_OUTLIER = 2.0
#: Curvature that keeps a system with nothing seen solvable, 1/m^2 and 1/rad^2.
_RIDGE = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """Postures of ``B`` frames.

    Attributes:
        q: ``(B, nq)``.
        residual_m: ``(B, markers)`` m, zero where unseen.
        outlier: ``(B, markers)`` seen and not believed.
        settled: ``(B,)`` the search came to rest.
        cost: ``(B,)`` half the squared improbability, far markers counting less.
    """

    q: Array
    residual_m: Array
    outlier: Flags
    settled: Flags
    cost: Array


@dataclass(frozen=True, slots=True, eq=False)
class MarkerProblem:
    """What stays the same from frame to frame.

    Attributes:
        system: the model with its markers.
        prior: likely postures.
        sd_m: ``(markers,)`` m.
    """

    system: MarkerSystem
    prior: Prior
    sd_m: Array

    @property
    def full_m(self) -> Array:
        """Distance ``(markers,)`` m within which a marker counts in full."""
        return np.maximum(_FULL_SD * self.sd_m, _FULL_LEAST_M)


@single_threaded
def solve(
    problem: MarkerProblem,
    q: Array,
    marker: Array,
    seen: Array,
    pull: Pull,
) -> Solved:
    """Finds the most likely posture of each frame.

    Args:
        problem: model, markers and prior.
        q: ``(B, nq)`` where to start.
        marker: ``(B, markers, 3)`` m, world.
        seen: ``(B, markers)`` 1 where it is seen, else 0.
        pull: what else is known of the angles.
    """
    parts = [
        _solve_chunk(
            problem,
            q[start : start + _CHUNK],
            marker[start : start + _CHUNK],
            seen[start : start + _CHUNK],
            pull.of(np.arange(start, min(start + _CHUNK, len(q)))),
        )
        for start in range(0, len(q), _CHUNK)
    ]
    return Solved(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("q", "residual_m", "outlier", "settled", "cost")
        )
    )


def _solve_chunk(
    problem: MarkerProblem, q: Array, marker: Array, seen: Array, pull: Pull
) -> Solved:
    q, left = _descend(problem, q, marker, seen, pull)
    distance = _distance(problem, q, marker, seen)
    outlier = (distance > _OUTLIER * problem.full_m) & (seen > 0.0)
    at = np.flatnonzero(np.any(outlier, axis=1))
    if len(at):
        # What is not believed shall not pull at all.
        believed = seen[at] * ~outlier[at]
        q[at], left[at] = _descend(problem, q[at], marker[at], believed, pull.of(at))
        distance = _distance(problem, q, marker, seen)
    cost = _loss(problem, distance, seen)
    cost += problem.prior.cost(q[:, BASE_NQ + problem.system.free], pull)
    return Solved(q, distance, outlier, left < _SETTLED_GAIN, cost)


def _descend(
    problem: MarkerProblem, q: Array, marker: Array, seen: Array, pull: Pull
) -> tuple[Array, Array]:
    """Returns the postures and what the last step of each promised to gain."""
    system, prior = problem.system, problem.prior
    angles = BASE_NQ + system.free
    q = q.copy()
    damping = np.full(len(q), _DAMPING_START)
    left = np.full(len(q), np.inf)
    active = np.arange(len(q))
    placed = system.place(q)
    for _ in range(_MOST_STEPS):
        here, y, s, known = q[active], marker[active], seen[active], pull.of(active)
        error = (y - placed.marker) * s[..., None]
        distance = np.linalg.norm(error, axis=-1)
        weight = _weight(problem, distance, s)
        cost = _loss(problem, distance, s) + prior.cost(here[:, angles], known)
        matrix, rhs = system.normal(placed, error, weight)
        prior.add(matrix[:, BASE_NV:, BASE_NV:], rhs[:, BASE_NV:], here[:, angles], known)
        diagonal = np.einsum("bkk->bk", matrix)
        diagonal += _RIDGE + damping[active, None] * diagonal
        step: Array = np.asarray(np.linalg.solve(matrix, rhs[..., None])[..., 0], dtype=np.float64)
        gain = 0.5 * np.sum(rhs * step, axis=1)
        longest = np.max(np.abs(step), axis=1)
        step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300))[:, None]
        trial = system.moved(here, step)
        there = system.place(trial)
        away = np.linalg.norm(y - there.marker, axis=-1) * s
        trial_cost = _loss(problem, away, s) + prior.cost(trial[:, angles], known)
        # At the optimum the gain drowns in rounding: the last step is taken all the same.
        better = (trial_cost < cost) | (gain < _LAST_GAIN)
        q[active[better]] = trial[better]
        left[active] = gain
        damping[active] = np.maximum(damping[active] * np.where(better, 0.1, 10.0), _DAMPING_LEAST)
        going = (gain >= _LAST_GAIN) & (damping[active] < _DAMPING_MOST)
        if not np.any(going):
            break
        placed = there.where(better, placed).of(np.flatnonzero(going))
        active = active[going]
    return q, left


@single_threaded
def spreads(
    problem: MarkerProblem, q: Array, residual_m: Array, seen: Array
) -> tuple[Array, Array]:
    """Returns how uncertain base, angles and joint rotations are.

    From the inverse of the normal matrix at the solution: trust in the markers and the prior, not
    the error that fixed offsets and lengths share over a recording. Where a joint's middle axis is
    near 90 degrees its angles are uncertain though the rotation that they make is not.

    Returns:
        Standard deviations ``(B, 6 + k)`` of base (m, rad, world axes) and free angles (rad), and
        ``(B, k)`` the largest of the rotation of the joint that each free angle belongs to.
    """
    system, angles = problem.system, BASE_NQ + problem.system.free
    own = np.empty((len(q), system.size))
    turn = np.empty((len(q), len(system.free)))
    for start in range(0, len(q), _CHUNK):
        part = slice(start, start + _CHUNK)
        placed = system.place(q[part])
        weight = _weight(problem, residual_m[part], seen[part])
        matrix, rhs = system.normal(placed, np.zeros_like(placed.marker), weight)
        nothing = no_pull(len(weight), len(system.free))
        problem.prior.add(
            matrix[:, BASE_NV:, BASE_NV:], rhs[:, BASE_NV:], q[part][:, angles], nothing
        )
        diagonal = np.einsum("bkk->bk", matrix)
        diagonal += _RIDGE
        covariance = np.linalg.inv(matrix)
        own[part] = np.sqrt(np.einsum("bkk->bk", covariance))
        for dofs in system.joint_places:
            axes = placed.axes[system.free[dofs - BASE_NV]].transpose(2, 1, 0)
            block = covariance[:, dofs[:, None], dofs]
            rotation = np.einsum("bik,bkl,bil->bi", axes, block, axes)
            turn[part, dofs - BASE_NV] = np.sqrt(np.max(rotation, axis=1))[:, None]
    return own, turn


def _distance(problem: MarkerProblem, q: Array, marker: Array, seen: Array) -> Array:
    """Distances ``(B, markers)`` m, zero where unseen."""
    return np.asarray(np.linalg.norm(marker - problem.system.place(q).marker, axis=-1) * seen)


def _weight(problem: MarkerProblem, distance: Array, seen: Array) -> Array:
    """Weights ``(B, markers)``, 1/m^2."""
    far = np.maximum(distance / problem.full_m, 1.0)
    return np.asarray(seen / (problem.sd_m * far) ** 2)


def _loss(problem: MarkerProblem, distance: Array, seen: Array) -> Array:
    """The loss ``(B,)`` that the weights belong to."""
    square = (distance / problem.sd_m) ** 2
    limit = (problem.full_m / problem.sd_m) ** 2
    square = np.where(
        square > limit, limit * (1.0 + np.log(np.maximum(square / limit, 1.0))), square
    )
    return np.asarray(0.5 * np.sum(seen * square, axis=-1))
