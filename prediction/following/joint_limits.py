"""Keeps predicted postures within joint limits while the hand stays where it is led."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prediction.laws.null_space import of_rows, weighted_rows

Array = NDArray[np.float64]
#: Returns hand error ``(B, m)`` and Jacobian ``(B, m, n)`` at learned joints ``(B, n)``.
TaskResidual = Callable[[Array, NDArray[np.int64]], tuple[Array, Array]]

#: Violation that counts, rad.
TOLERANCE_RAD = 1e-6
#: Largest hand correction asked of one iteration, m or rad.
_LONGEST_CORRECTION = 0.05
_ITERATIONS = 12


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Linear bounds on learned joints: ``lower <= matrix @ q + offset <= upper``.

    Joints that follow others are bounded through the joints they follow.

    Attributes:
        matrix: ``(L, n)``.
        lower: ``(L,)`` rad.
        upper: ``(L,)`` rad.
    """

    matrix: Array
    lower: Array
    upper: Array

    def widened_to(self, *postures: Array) -> "JointLimits":
        """Returns limits that hold the given postures ``(..., L)`` (all joints).

        People exceed tabulated ranges; what was measured is possible.
        """
        rows = np.concatenate([p.reshape(-1, p.shape[-1]) for p in postures])
        return JointLimits(
            self.matrix,
            np.minimum(self.lower, rows.min(axis=0)),
            np.maximum(self.upper, rows.max(axis=0)),
        )

    def excess(self, q: Array, offset: Array) -> Array:
        """Returns how far each bound is passed, signed, ``(B, L)`` rad; 0 within."""
        joints = q @ self.matrix.T + offset
        return np.asarray(joints - np.clip(joints, self.lower, self.upper))


def settle(
    q: Array,
    offset: Array,
    limits: JointLimits,
    weights: Array,
    residual: TaskResidual,
    tolerance: Array,
) -> tuple[Array, NDArray[np.bool_]]:
    """Brings postures onto the hand target with every joint within its limits.

    Newton steps on the hand error in which joints past a limit are sent to it and held there; the
    rest make up for them, in the proportions W. A joint is let go once holding it would take a pull
    outwards.

    Args:
        q: Learned joints, ``(B, n)`` rad.
        offset: All joints less ``matrix @ q``, ``(B, L)`` rad.
        limits: Bounds.
        weights: W, ``(n,)`` or ``(n, n)`` for all, or ``(B, n, n)``.
        residual: Hand error at given rows of the batch.
        tolerance: Accepted hand error per task row, ``(m,)``.

    Returns:
        The postures, and which of them met both, ``(B,)``.

    Derived here: minimise ``dq' W^-1 dq`` subject to ``J dq = e`` and ``a_i' dq = -excess_i``; the
    multiplier system is that of the pseudo-inverse with the held joints' rows added to J. Rows of
    joints that are not held are blanked, which leaves the system of each posture independent.
    """
    q = q.copy()
    done = np.zeros(len(q), dtype=np.bool_)
    held = np.zeros((len(q), len(limits.lower)))  # -1 at a lower limit, 1 at an upper one
    open_rows = np.arange(len(q))
    for _ in range(_ITERATIONS):
        error, jacobian = residual(q[open_rows], open_rows)
        excess = limits.excess(q[open_rows], offset[open_rows])
        over = np.abs(excess) > TOLERANCE_RAD
        fine = (np.abs(error) <= tolerance).all(axis=1) & ~over.any(axis=1)
        done[open_rows[fine]] = True
        if fine.all():
            break
        keep = ~fine
        open_rows, error, jacobian = open_rows[keep], error[keep], jacobian[keep]
        excess = excess[keep]
        over = over[keep]
        held[open_rows] = np.where(over, np.sign(excess), held[open_rows])
        active = held[open_rows] != 0
        columns = np.flatnonzero(active.any(axis=0))
        length = np.linalg.norm(error, axis=1, keepdims=True)
        error = error * np.minimum(1.0, _LONGEST_CORRECTION / np.maximum(length, 1e-300))
        rows = limits.matrix[columns] * active[:, columns, None]
        system = np.concatenate([jacobian, rows], axis=1)
        right = np.concatenate([error, -excess[:, columns]], axis=1)
        weighted = weighted_rows(of_rows(weights, open_rows), system)
        gram = weighted @ np.swapaxes(system, 1, 2)
        task_dim = jacobian.shape[1]
        diagonal = np.einsum("bii->bi", gram)  # a view: written through
        # Each kind of row in its own unit; the ridge only matters where a posture is pinned.
        diagonal += 1e-9 * diagonal[:, :task_dim].mean(axis=1, keepdims=True)
        diagonal[:, task_dim:] += ~active[:, columns]
        multiplier = np.linalg.solve(gram, right[..., None])[..., 0]
        q[open_rows] += np.einsum("bmn,bm->bn", weighted, multiplier)
        # A joint that its limit would have to pull outwards need not be held.
        pulled = multiplier[:, task_dim:] * held[open_rows][:, columns] > 0
        held[np.ix_(open_rows, columns)] *= ~pulled | over[:, columns]
    return q, done
