"""Integration of many roll-outs side by side, one led step of the hand after another."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from prediction.chain import ReducedChain, held_tips
from prediction.familiarity import widening
from prediction.hand_path import HandPath, orientation_error
from prediction.joint_limits import TOLERANCE_RAD, settle
from prediction.null_space import of_rows, weighted_rows
from prediction.small_systems import solve_spd

if TYPE_CHECKING:
    from prediction.rollout import Follower

Array = NDArray[np.float64]
Noise = Literal["coherent", "white", "none"]
NOISES: tuple[Noise, ...] = ("coherent", "white", "none")

#: Hand error after a step above which more corrections are made, m and rad.
FINE_M = 1e-4
FINE_RAD = 1e-3
#: Hand error at which a point counts as out of reach, m and rad.
REACH_M = 2e-3
REACH_RAD = 2e-2


@dataclass(frozen=True, slots=True)
class Propagation:
    """Roll-outs of several paths at once; row 0 of each is its central path.

    Attributes:
        q: All joints, ``(C, 1 + S, T, n)``.
        hand_error_m: Of the tip, led or held, that is furthest off, ``(C, 1 + S, T)``.
        hand_error_rad: The same of orientation, ``(C, 1 + S, T)``.
        familiarity: ``(C, T)``.
        followed: ``(C, 1 + S, T)``.
        travelled: What the band's process runs in, along the central path, ``(C, T)`` s.
    """

    q: Array
    hand_error_m: Array
    hand_error_rad: Array
    familiarity: Array
    followed: NDArray[np.bool_]
    travelled: Array


def propagate(
    follower: "Follower",
    paths: list[HandPath],
    q0: Array,
    draws: Array,
    *,
    robot: Array | None = None,
    noise: Noise = "coherent",
) -> Propagation:
    """Integrates several paths of equal length side by side.

    Args:
        follower: The law.
        paths: C checked paths of T points each.
        q0: ``(C, n)`` all joints.
        draws: Standard normal numbers ``(S, T, r)``, the same for every path.
        robot: Hand target errors ``(S, T, 6)``, or ``(C, S, T, 6)`` for one set a path, m and
            rad; none if not given.
        noise: See `Follower.rollout`.

    Returns:
        The roll-outs. Nothing is raised for a hand that cannot follow: ``followed`` says so.
    """
    state = _State(follower, q0, draws.shape[0])
    substeps = max(path.substeps() for path in paths)
    fine = [path.refined(substeps) for path in paths]
    targets = state.targets(fine)
    times = np.stack([p.time_s for p in fine])
    count, samples, points = len(paths), draws.shape[0], len(paths[0].time_s)
    offsets = np.zeros((points, count, samples + 1, 6))
    if robot is not None:
        offsets[:, :, 1:] = np.moveaxis(np.broadcast_to(robot, (count, samples, points, 6)), 2, 0)
    out = _Record.empty(count, samples + 1, points, len(follower.reduction.names))
    state.correct_start(targets.at(0))
    state.store(out, 0)
    deviation = np.zeros((count, samples + 1, len(follower.reduction.kept)))
    for point in range(1, points):
        familiarity = out.familiarity[:, point - 1]
        change = np.zeros_like(deviation)
        end = point * substeps
        step = state.central_step(targets.at(end))
        if follower.band is not None:
            elapsed = times[:, end] - times[:, end - substeps]
            du = follower.band.travelled(step, state.central_jacobian(), elapsed)
            out.travelled[:, point] = out.travelled[:, point - 1] + du
            if noise == "coherent" and samples:
                rho = np.exp(-du / follower.band.length)[:, None, None]
                fresh = draws[:, point] @ follower.band.factor.T
                fresh = widening(familiarity)[:, None, None] * fresh
                moved = rho * deviation[:, 1:] + np.sqrt(1.0 - rho**2) * fresh
                change[:, 1:] = moved - deviation[:, 1:]
                deviation[:, 1:] = moved
        for sub in range(1, substeps + 1):
            index = (point - 1) * substeps + sub
            share = sub / substeps
            offset = (1 - share) * offsets[point - 1] + share * offsets[point]
            target = targets.at(index)
            dt = times[:, index] - times[:, index - 1]
            white = draws[:, point] if noise == "white" and sub == 1 else None
            state.advance(target, offset, dt, change / substeps, white, substeps)
        state.store(out, point)
    return Propagation(
        out.q, out.error_m, out.error_rad, out.familiarity, out.followed, out.travelled
    )


@dataclass(frozen=True, slots=True)
class _Targets:
    """Where all tips must be: the held ones where they start, the led ones along the paths.

    Attributes:
        position: ``(C, T, p)`` m.
        rotation: ``(C, T, t, 3, 3)`` of the tips whose orientation is the task's.
        held: How many tips are held.
    """

    position: Array
    rotation: Array
    held: int

    def at(self, index: int) -> "_Targets":
        """Returns the targets at one point, as ``(C, p)`` and ``(C, t, 3, 3)``."""
        return _Targets(self.position[:, index], self.rotation[:, index], self.held)

    def moved(self, offset: Array) -> "_Targets":
        """Returns the led tips' targets, ``(..., p)``, moved by the robot's error ``(..., 6)``.

        One robot leads them, so several are moved as one body, turning about their middle.
        """
        # A planar arm has two coordinates and one tip.
        size = min(3, self.position.shape[-1])
        position = self.position.reshape(*self.position.shape[:-1], -1, size)
        turn = _small_rotation(offset[..., 3:])[..., None, :, :]
        led = position[..., self.held :, :]
        if led.shape[-2] > 1:
            middle = led.mean(axis=-2, keepdims=True)
            led = middle + (turn @ (led - middle)[..., None])[..., 0]
        led = led + offset[..., None, :size]
        rotation = self.rotation
        if rotation.shape[-3] > self.held:
            kept = rotation[..., : self.held, :, :]
            rotation = np.concatenate([kept, turn @ rotation[..., self.held :, :, :]], axis=-3)
        position = np.concatenate([position[..., : self.held, :], led], axis=-2)
        return _Targets(position.reshape(self.position.shape), rotation, self.held)


@dataclass(slots=True)
class _Record:
    q: Array
    error_m: Array
    error_rad: Array
    familiarity: Array
    followed: NDArray[np.bool_]
    travelled: Array

    @classmethod
    def empty(cls, count: int, rows: int, points: int, joints: int) -> "_Record":
        shape = (count, rows, points)
        return cls(
            np.empty((*shape, joints)),
            np.zeros(shape),
            np.zeros(shape),
            np.zeros((count, points)),
            np.ones(shape, dtype=np.bool_),
            np.zeros((count, points)),
        )


class _State:
    """Postures of all rows and the poses and Jacobians of the tips that belong to them."""

    def __init__(self, follower: "Follower", q0: Array, samples: int) -> None:
        self.follower = follower
        self.count, self.rows = len(q0), samples + 1
        rows = np.repeat(q0[:, None], self.rows, axis=1).reshape(-1, q0.shape[1])
        reduction = follower.reduction
        self.chain = ReducedChain(follower.chain, reduction, rows, follower.task)
        self.q = rows[:, reduction.kept]
        self.anchor = rows
        self.offset = rows - self.q @ reduction.expansion.T
        self.limits = follower.limits.widened_to(rows)
        self.followed = np.ones(len(self.q), dtype=np.bool_)
        self.previous = self.q
        self._evaluate()
        self.linear = self.position.shape[1]
        self.target_position, self.target_rotation = self.position, self.rotation

    def _evaluate(self) -> None:
        self.weights = self.follower.predictor.weights_at(self.q)
        self.position, self.rotation, self.jacobian = self.chain.forward_and_jacobian(self.q)

    def _central(self, values: Array) -> Array:
        return np.asarray(values.reshape(self.count, self.rows, *values.shape[1:])[:, 0])

    def targets(self, paths: list[HandPath]) -> _Targets:
        """Returns the targets of all tips on the paths; held ones stay where they are now."""
        held, points = held_tips(self.follower.chain), len(paths[0].time_s)
        shape = (self.count, points)
        still = self._central(self.position)[:, None, : 3 * held]
        led = np.stack([path.position.reshape(points, -1) for path in paths])
        position = np.concatenate([np.broadcast_to(still, (*shape, 3 * held)), led], axis=2)
        unturned = self._central(self.rotation)[:, None, :held]
        rotation = np.broadcast_to(unturned, (*shape, held, 3, 3))
        if self.follower.task == "pose":
            turned = [p.rotation.reshape(points, -1, 3, 3) for p in paths if p.rotation is not None]
            rotation = np.concatenate([rotation, np.stack(turned)], axis=2)
        return _Targets(position, rotation, held)

    def _aim(self, target: _Targets, offset: Array | None) -> None:
        shape = (self.count, self.rows)
        aimed = _Targets(
            np.broadcast_to(target.position[:, None], (*shape, self.linear)),
            np.broadcast_to(target.rotation[:, None], (*shape, *target.rotation.shape[1:])),
            target.held,
        )
        if offset is not None and offset.any():
            aimed = aimed.moved(offset)
        self.target_position = aimed.position.reshape(-1, self.linear)
        self.target_rotation = aimed.rotation.reshape(len(self.q), *target.rotation.shape[1:])

    def _residual(self, position: Array, rotation: Array, rows: NDArray[np.int64] | slice) -> Array:
        error = self.target_position[rows] - position
        return _with_turn(error, self.target_rotation[rows], rotation)

    def _all(self) -> Array:
        return self._residual(self.position, self.rotation, slice(None))

    def central_jacobian(self) -> Array:
        return self._central(self.jacobian)

    def central_step(self, target: _Targets) -> Array:
        """Returns the displacement from the central hands to a target, ``(C, m)``."""
        error = target.position - self._central(self.position)
        return _with_turn(error, target.rotation, self._central(self.rotation))

    def correct_start(self, target: _Targets) -> None:
        """Brings hands that are nearly at the first point onto it."""
        self._aim(target, None)
        self._settle()

    def advance(
        self,
        target: _Targets,
        offset: Array,
        dt: Array,
        change: Array,
        white: Array | None,
        substeps: int,
    ) -> None:
        """Moves all rows by one step and corrects the hand."""
        self._aim(target, offset)
        self.previous = self.q
        step = self._all()
        per_row = np.repeat(dt, self.rows)[:, None]
        predictor = self.follower.predictor
        xdot = step / per_row
        drift = per_row * predictor.null_velocity(self.q, xdot, self.jacobian)
        stray = change.reshape(-1, change.shape[-1])
        if white is not None:
            noise = np.zeros((self.count, self.rows, white.shape[-1]))
            noise[:, 1:] = white
            drawn = self._white(xdot, noise.reshape(-1, white.shape[-1]))
            stray = stray + drawn * per_row * substeps
        wanted = step - np.einsum("bmn,bn->bm", self.jacobian, stray)
        self.q = self.q + drift + stray + self._gain(wanted)
        self._evaluate()
        # One Newton correction where the hand now is; old Jacobians would not do.
        self.q = self.q + self._gain(self._all())
        self._evaluate()
        self._settle()

    def _gain(self, wanted: Array) -> Array:
        weighted = weighted_rows(self.weights, self.jacobian)
        gram = weighted @ np.swapaxes(self.jacobian, 1, 2)
        multiplier = solve_spd(gram, wanted[..., None])
        return np.asarray((np.swapaxes(multiplier, 1, 2) @ weighted)[:, 0])

    def _white(self, xdot: Array, normal: Array) -> Array:
        predictor = self.follower.predictor
        frame = predictor.basis.frame(self.jacobian)
        covariance = predictor.null_covariance(self.q, xdot, frame, self.jacobian)
        factor = np.linalg.cholesky(covariance)
        y = (factor @ normal[:, : factor.shape[-1], None])[..., 0]
        return frame.compose(y)

    def _tolerance(self, linear: float, angular: float) -> Array:
        size = self.jacobian.shape[1]
        return np.array([linear] * self.linear + [angular] * (size - self.linear))

    def _settle(self) -> None:
        """Corrects further, within limits, the few rows that need it."""
        error = self._all()
        fine = (np.abs(error) <= self._tolerance(FINE_M, FINE_RAD)).all(axis=1)
        excess = np.abs(self.limits.excess(self.q, self.offset))
        fine &= (excess <= TOLERANCE_RAD).all(axis=1)
        self.followed = np.ones(len(self.q), dtype=np.bool_)
        if fine.all():
            return
        rows = touched = np.flatnonzero(~fine)

        def residual(q: Array, local: NDArray[np.int64]) -> tuple[Array, Array]:
            position, rotation, jacobian = self._chain_of(rows[local]).forward_and_jacobian(q)
            return self._residual(position, rotation, rows[local]), jacobian

        # First from where the step went; failing that, from the posture before it, without
        # deviation.
        for start in (self.q, self.previous):
            settled, _ = settle(
                start[rows],
                self.offset[rows],
                self.limits,
                of_rows(self.weights, rows),
                residual,
                self._tolerance(FINE_M, FINE_RAD),
            )
            error, _ = residual(settled, np.arange(len(rows)))
            reached = (np.abs(error) <= self._tolerance(REACH_M, REACH_RAD)).all(axis=1)
            excess = np.abs(self.limits.excess(settled, self.offset[rows])).max(axis=1)
            reached &= excess <= 1e-3
            self.q[rows[reached]] = settled[reached]
            rows = rows[~reached]
            if len(rows) == 0:
                break
        else:
            error = error[~reached]
            nearer = np.linalg.norm(error, axis=1) < np.linalg.norm(self._all()[rows], axis=1)
            settled = np.where(nearer[:, None], settled[~reached], self.previous[rows])
            self.q[rows] = settled
            self.followed[rows] = False
        chain = self._chain_of(touched)
        self.position, self.rotation = self.position.copy(), self.rotation.copy()
        (
            self.position[touched],
            self.rotation[touched],
            self.jacobian[touched],
        ) = chain.forward_and_jacobian(self.q[touched])

    def _chain_of(self, rows: NDArray[np.int64]) -> ReducedChain:
        chain = self.chain
        return ReducedChain(chain.chain, chain.reduction, self.anchor[rows], chain.task)

    def store(self, out: _Record, point: int) -> None:
        """Writes the present state at one point of the paths."""
        shape = (self.count, self.rows)
        error = self._all()
        out.q[:, :, point] = self.chain.expand(self.q).reshape(*shape, -1)
        out.error_m[:, :, point] = _furthest(error[:, : self.linear]).reshape(shape)
        out.error_rad[:, :, point] = _furthest(error[:, self.linear :]).reshape(shape)
        out.followed[:, :, point] = self.followed.reshape(shape)
        central = self.q.reshape(*shape, -1)[:, 0]
        out.familiarity[:, point] = self.follower.familiarity.relative(central)


def _with_turn(error: Array, target: Array, rotation: Array) -> Array:
    """Adds what orientations ``(B, t, 3, 3)`` lack to position errors, as ``(B, p + 3 t)``."""
    if target.shape[1] == 0:
        return error
    turn = orientation_error(target, rotation)
    return np.concatenate([error, turn.reshape(len(error), -1)], axis=1)


def _furthest(error: Array) -> Array:
    """Returns the length of the longest of the tips' errors, ``(B,)``."""
    if error.shape[1] == 0:
        return np.zeros(len(error))
    tips = error.reshape(len(error), -1, min(3, error.shape[1]))
    return np.asarray(np.linalg.norm(tips, axis=2).max(axis=1))


def _small_rotation(vector: Array) -> Array:
    """Rotation matrices of small rotation vectors, by the Cayley map: exactly orthonormal."""
    x, y, z = np.moveaxis(0.5 * vector, -1, 0)
    zero = np.zeros_like(x)
    skew = np.stack(
        [np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2
    )
    return np.asarray(np.linalg.solve(np.eye(3) - skew, np.eye(3) + skew))
