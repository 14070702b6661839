"""Postures of many roll-outs side by side, and the step that leads their hands on."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prediction.chain import ReducedChain, held_tips
from prediction.following.hand_path import HandPath
from prediction.following.joint_limits import TOLERANCE_RAD, settle
from prediction.following.tip_targets import TipTargets, with_turn
from prediction.laws.null_space import of_rows, weighted_rows
from prediction.laws.small_systems import solve_spd

if TYPE_CHECKING:
    from prediction.following.rollout import Follower

Array = NDArray[np.float64]

#: Hand error after a step above which more corrections are made, m and rad.
FINE_M = 5e-5
FINE_RAD = 5e-4
#: Hand error at which a point counts as out of reach, m and rad.
REACH_M = 2e-3
REACH_RAD = 2e-2


class PostureBatch:
    """Postures of all rows and the poses and Jacobians of the tips that belong to them.

    Attributes:
        count: Paths, C.
        rows: Roll-outs of each, the central one first.
        linear: Linear rows of the task.
        q: Learned joints, ``(B, r)`` rad, B = C x rows.
        error: What the tips lack to their targets, ``(B, m)``.
        before: The same before the corrections of the last step.
        followed: Whether the last target was reached within limits, ``(B,)``.
    """

    def __init__(self, follower: "Follower", q0: Array) -> None:
        """Stands at the start.

        Args:
            follower: The law, in the precision to work in.
            q0: All joints, ``(C, rows, n)`` rad.
        """
        self.follower = follower
        self.count, self.rows = q0.shape[:2]
        self._kind = follower.predictor.weights.dtype
        rows = q0.reshape(-1, q0.shape[2]).astype(self._kind)
        reduction = follower.reduction
        self.chain = ReducedChain(follower.chain, reduction, rows, follower.task)
        self.q = rows[:, reduction.kept]
        self._anchor = rows
        self._offset = rows - self.q @ reduction.expansion.T
        self._limits = follower.limits.widened_to(rows)
        self._previous = self.q
        self.followed = np.ones(len(self.q), dtype=np.bool_)
        self._evaluate()
        self.linear = self._position.shape[1]
        self._target_position, self._target_rotation = self._position, self._rotation
        self.error = self.before = np.zeros(self.jacobian.shape[:2], dtype=self._kind)

    def _evaluate(self) -> None:
        position, rotation, jacobian = self.chain.forward_and_jacobian(self.q)
        self._position = position.astype(self._kind, copy=False)
        self._rotation = rotation.astype(self._kind, copy=False)
        self.jacobian = jacobian.astype(self._kind, copy=False)

    def central(self, values: Array) -> Array:
        """Returns the central roll-outs' rows of ``(B, ...)``, ``(C, ...)``."""
        return np.asarray(values.reshape(self.count, self.rows, *values.shape[1:])[:, 0])

    def targets(self, paths: list[HandPath]) -> TipTargets:
        """Returns the targets of all tips on the paths; held ones stay where they are now."""
        held, points = held_tips(self.follower.chain), len(paths[0].time_s)
        shape = (self.count, points)
        still = self.central(self._position)[:, None, : 3 * held]
        led = np.stack([path.position.reshape(points, -1) for path in paths])
        position = np.concatenate([np.broadcast_to(still, (*shape, 3 * held)), led], axis=2)
        unturned = self.central(self._rotation)[:, None, :held]
        rotation = np.broadcast_to(unturned, (*shape, held, 3, 3))
        if self.follower.task == "pose":
            turned = [p.rotation.reshape(points, -1, 3, 3) for p in paths if p.rotation is not None]
            rotation = np.concatenate([rotation, np.stack(turned)], axis=2)
        return TipTargets(
            position.astype(self._kind, copy=False), rotation.astype(self._kind, copy=False), held
        )

    def central_step(self, target: TipTargets) -> Array:
        """Returns the displacement from the central hands to a target, ``(C, m)``."""
        error = target.position - self.central(self._position)
        return with_turn(error, target.rotation, self.central(self._rotation))

    def correct_start(self, target: TipTargets) -> None:
        """Brings hands that are nearly at the first point onto it."""
        self._aim(target, None)
        self.weights = self.follower.predictor.weights_at(self.q)
        self._settle()

    def advance(
        self,
        target: TipTargets,
        offset: Array | None,
        dt: Array,
        change: Array,
        white: Array | None,
    ) -> None:
        """Moves all rows by one step and corrects the hand.

        Args:
            target: Where the tips go.
            offset: The robot's error, ``(C, rows, 6)`` m and rad; None if it has none.
            dt: Time the step takes, ``(C,)`` s.
            change: Change of the deviation in this step, ``(C, rows, r)`` rad.
            white: Standard normal numbers for noise of its own, ``(C, rows, r)``, times how many
                steps this one stands for; None if there is none.
        """
        predictor = self.follower.predictor
        self._aim(target, offset)
        self._previous = self.q
        # W belongs to the posture the step starts from; so no correction within it, not even one
        # that limits force, leaves it behind, and it is worked out once a step.
        self.weights = predictor.weights_at(self.q)
        step = self._lack()
        per_row = np.repeat(dt, self.rows)[:, None].astype(self._kind)
        xdot = step / per_row
        drift = per_row * predictor.null_velocity(self.q, xdot, self.jacobian)
        stray = change.reshape(self.q.shape)
        if white is not None:
            stray = stray + self._white(xdot, white.reshape(self.q.shape)) * per_row
        wanted = step - np.einsum("bmn,bn->bm", self.jacobian, stray)
        self.q = self.q + drift + stray + self._gain(wanted)
        self._evaluate()
        self.before = self._lack()
        # One Newton correction where the hand now is; old Jacobians would not do.
        self.q = self.q + self._gain(self.before)
        self._evaluate()
        self._settle()

    def all_joints(self) -> Array:
        """Returns the postures with the joints that follow, ``(B, n)`` rad."""
        return self.chain.expand(self.q)

    def _aim(self, target: TipTargets, offset: Array | None) -> None:
        shape = (self.count, self.rows)
        aimed = TipTargets(
            np.broadcast_to(target.position[:, None], (*shape, self.linear)),
            np.broadcast_to(target.rotation[:, None], (*shape, *target.rotation.shape[1:])),
            target.held,
        )
        if offset is not None:
            aimed = aimed.moved(offset)
        self._target_position = aimed.position.reshape(-1, self.linear)
        self._target_rotation = aimed.rotation.reshape(len(self.q), *target.rotation.shape[1:])

    def _residual(self, position: Array, rotation: Array, rows: NDArray[np.int64] | slice) -> Array:
        error = self._target_position[rows] - position
        return with_turn(error, self._target_rotation[rows], rotation)

    def _lack(self) -> Array:
        return self._residual(self._position, self._rotation, slice(None))

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
        self.error = self._lack()
        fine = (np.abs(self.error) <= self._tolerance(FINE_M, FINE_RAD)).all(axis=1)
        excess = np.abs(self._limits.excess(self.q, self._offset))
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
        for start in (self.q, self._previous):
            settled, _ = settle(
                start[rows],
                self._offset[rows],
                self._limits,
                of_rows(self.weights, rows),
                residual,
                self._tolerance(FINE_M, FINE_RAD),
            )
            error, _ = residual(settled, np.arange(len(rows)))
            reached = (np.abs(error) <= self._tolerance(REACH_M, REACH_RAD)).all(axis=1)
            excess = np.abs(self._limits.excess(settled, self._offset[rows])).max(axis=1)
            reached &= excess <= 1e-3
            self.q[rows[reached]] = settled[reached]
            rows = rows[~reached]
            if len(rows) == 0:
                break
        else:
            error = error[~reached]
            nearer = np.linalg.norm(error, axis=1) < np.linalg.norm(self.error[rows], axis=1)
            settled = np.where(nearer[:, None], settled[~reached], self._previous[rows])
            self.q[rows] = settled
            self.followed[rows] = False
        position, rotation, jacobian = self._chain_of(touched).forward_and_jacobian(self.q[touched])
        self._position, self._rotation = self._position.copy(), self._rotation.copy()
        self._position[touched], self._rotation[touched] = position, rotation
        self.jacobian[touched] = jacobian
        self.error[touched] = self._residual(
            self._position[touched], self._rotation[touched], touched
        )

    def _chain_of(self, rows: NDArray[np.int64]) -> ReducedChain:
        chain = self.chain
        return ReducedChain(chain.chain, chain.reduction, self._anchor[rows], chain.task)
