"""Search for the weights W of the pseudo-inverse that make the demonstrations most likely.

W and c W are the same model, so the search runs over log weights of mean zero.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import Literal, cast

import numpy as np
import scipy.optimize
from numpy.typing import NDArray

from prediction.demonstrations import Demonstrations
from prediction.laws.null_space import NullSpaceBasis, weighted_rows, weighted_solution
from prediction.laws.predictor import Progress, ShouldStop, check_stop
from prediction.laws.small_systems import solve_spd

Array = NDArray[np.float64]
Optimizer = Literal["bipop", "gradient"]
OPTIMIZERS: tuple[Optimizer, ...] = ("bipop", "gradient")

#: Generations of a leading run of BIPOP after which its score is made anew.
GENERATIONS = 50
#: Bound of |log w| about its mean: beyond a ratio of e^8 a joint is locked or free for any purpose.
LOG_WEIGHT_BOUND = 4.0


class NullSpaceTargets:
    """Null-space coordinates of the demonstrations as a function of W.

    ``y(W) = V' (dq - J_W^+ J dq)``; only ``J_W^+`` depends on W, so W acts as a mean function and
    the Gram matrix of the inputs never changes.

    Args:
        demonstrations: N samples.
        basis: Null-space axes.
        correlation: Correlation R of the joints in ``W = D R D``, ``D_jj = sqrt(w_j)``, ``(n, n)``;
            a diagonal W if not given.
    """

    def __init__(
        self,
        demonstrations: Demonstrations,
        basis: NullSpaceBasis,
        correlation: Array | None = None,
    ) -> None:
        """Precomputes what does not depend on W."""
        self._correlation = correlation
        J = demonstrations.jacobian
        self._jacobian = J
        self._xdot = demonstrations.xdot
        frame = basis.frame(J)
        self._V = frame.matrix()
        self._free = np.einsum("tnk,tn->tk", self._V, demonstrations.qdot)
        # Products of Jacobian rows: J W J' is then one matrix product for a whole population.
        self._products = np.einsum("tin,tjn->tijn", J, J)

    def many(self, log_weights: Array) -> Array:
        """Returns y for log weights ``(P, n)``, as ``(P, N, k)``."""
        if self._correlation is not None:
            return np.stack([self._correlated(row) for row in log_weights])
        weights = np.exp(log_weights)
        count, task_dim, _, joints = self._products.shape
        gram = self._products.reshape(-1, joints) @ weights.T
        gram = np.moveaxis(gram.reshape(count, task_dim, task_dim, len(weights)), -1, 1)
        right = np.broadcast_to(self._xdot[:, None, :, None], (count, len(weights), task_dim, 1))
        multiplier = solve_spd(gram, right)[..., 0]
        moved = (multiplier @ self._jacobian) * weights
        return np.asarray(self._free - np.swapaxes(moved @ self._V, 0, 1))

    def one(self, log_weights: Array) -> Array:
        """Returns y for log weights ``(n,)``, as ``(N, k)``."""
        return np.asarray(self.many(log_weights[None])[0])

    def _correlated(self, log_weights: Array) -> Array:
        W = scaled_correlation(log_weights, self._correlation)
        followed = weighted_solution(W, self._jacobian, self._xdot)
        return np.asarray(self._free - np.einsum("tnk,tn->tk", self._V, followed))

    def sensitivity(self, log_weights: Array) -> Array:
        """Returns the derivative of y ``(N, k)`` by log weights ``(n,)``, ``(N, k, n)``.

        Derived here: as in `pull_back`, with ``V' P_W`` instead of its product with a slope.
        """
        W = scaled_correlation(log_weights, self._correlation)
        rows = weighted_rows(W, self._jacobian)
        gram = rows @ np.swapaxes(self._jacobian, 1, 2)
        across = np.swapaxes(self._V, 1, 2)
        both = solve_spd(gram, np.concatenate([self._xdot[..., None], rows], axis=-1))
        multiplier = np.einsum("tmn,tm->tn", self._jacobian, both[..., 0])
        free = across - (across @ np.swapaxes(both[..., 1:], 1, 2)) @ self._jacobian
        if W.ndim == 1:
            return np.asarray(-free * (W * multiplier)[:, None, :])
        first = free * (multiplier @ W)[:, None, :]
        return np.asarray(-0.5 * (first + (free @ W) * multiplier[:, None, :]))

    def pull_back(self, log_weights: Array, slope: Array) -> Array:
        """Returns the derivative by log weights ``(n,)`` of a score with ``slope`` = d score / d y.

        Derived here: with ``lam = J' (J W J')^-1 u`` a change of W moves ``J_W^+ u`` by
        ``P_W dW lam``, ``P_W = I - J_W^+ J``; ``dW / d log w_j`` is half of row and column j of W.
        """
        W = scaled_correlation(log_weights, self._correlation)
        rows = weighted_rows(W, self._jacobian)
        gram = rows @ np.swapaxes(self._jacobian, 1, 2)
        in_joints = np.einsum("tnk,tk->tn", self._V, slope)
        inner = np.einsum("tmn,tn->tm", rows, in_joints)
        both = solve_spd(gram, np.stack([self._xdot, inner], axis=-1))
        multiplier = np.einsum("tmn,tm->tn", self._jacobian, both[..., 0])
        # P_W' v = v - J' (J W J')^-1 J W v, the transpose acting on joint-space rows.
        projected = in_joints - np.einsum("tmn,tm->tn", self._jacobian, both[..., 1])
        if W.ndim == 1:
            return np.asarray(-(projected * W * multiplier).sum(axis=0))
        return np.asarray(
            -0.5 * (projected * (multiplier @ W) + (projected @ W) * multiplier).sum(axis=0)
        )


def scaled_correlation(log_weights: Array, correlation: Array | None) -> Array:
    """Returns W: ``exp(log_weights)`` as a diagonal, or ``D R D`` with its square roots in D."""
    if correlation is None:
        return np.asarray(np.exp(log_weights))
    root = np.exp(0.5 * log_weights)
    return np.asarray(root[:, None] * correlation * root)


def optimiser() -> ModuleType:
    """Returns pycma, loaded only when a search runs: prediction itself needs no optimiser."""
    with warnings.catch_warnings():
        # Without matplotlib pycma says that its plots, which nobody here asks for, are off.
        warnings.filterwarnings("ignore", "Could not import matplotlib", UserWarning)
        import cma
    return cast(ModuleType, cma)


@dataclass(frozen=True, slots=True)
class WeightSearch:
    """Result of a search.

    Attributes:
        log_weights: ``(n,)`` of mean zero.
        score: Log likelihood a sample there.
        evaluations: How many candidates were scored.
    """

    log_weights: Array
    score: float
    evaluations: int


def mean_zero_axes(joints: int) -> Array:
    """Returns orthonormal axes ``(joints, joints - 1)`` of the log weights of mean zero."""
    centred = np.eye(joints) - 1.0 / joints
    _, vectors = np.linalg.eigh(centred)
    return np.asarray(vectors[:, 1:])


def _bounded(log_weights: Array) -> tuple[Array, Array]:
    clipped = np.clip(log_weights, -LOG_WEIGHT_BOUND, LOG_WEIGHT_BOUND)
    return clipped, ((log_weights - clipped) ** 2).sum(-1)


def search_bipop(
    score: Callable[[Array], Array],
    start: Array,
    rng: np.random.Generator,
    *,
    max_evaluations: int,
    step: float = 0.5,
    restarts: int = 2,
    refresh: Callable[[Array], Callable[[Array], Array]] | None = None,
    progress: Progress | None = None,
    should_stop: ShouldStop | None = None,
) -> WeightSearch:
    """Maximises a score over log weights by BIPOP-CMA-ES.

    Args:
        score: Scores log weights ``(P, n)``, ``(P,)``.
        start: First log weights, ``(n,)``.
        rng: All randomness.
        max_evaluations: Budget of candidates.
        step: First standard deviation.
        restarts: Restarts after the first run, alternating large and small populations.
        refresh: Told the best log weights every `GENERATIONS` of the runs that lead, answers the
            score to go on with (that of a kernel fitted anew); restarts are scored by the last.
        progress: Told the best score after each generation.
        should_stop: Asked after each generation.

    Returns:
        The best log weights seen.

    Source: Hansen 2009, BIPOP-CMA-ES (the regimes' population sizes and steps); pycma runs each.
    """
    cma = optimiser()
    axes = mean_zero_axes(len(start))
    best, best_score, spent = start - start.mean(), -np.inf, 0
    default = 4 + int(3 * np.log(axes.shape[1]))
    large, budget_large, budget_small = default, 0, 0
    for run in range(restarts + 1):
        small_run = run > 0 and budget_small < budget_large
        if run == 0:
            population, sigma, centre = default, step, start
        elif small_run:
            u = rng.uniform()
            population = int(default * max(1.0, 0.5 * large / default) ** (u**2))
            sigma, centre = step * 10 ** (-2 * rng.uniform()), rng.normal(0, 1, len(start))
        else:
            large *= 2
            population, sigma, centre = large, step, rng.normal(0, 1, len(start))
        options = {
            "popsize": population,
            "seed": np.nan,
            "randn": lambda *shape: rng.standard_normal(shape),
            "verbose": -9,
            "verb_log": 0,
            "tolfun": 1e-7,
            "tolx": 1e-5,
            "maxfevals": max_evaluations - spent,
        }
        strategy = cma.CMAEvolutionStrategy(axes.T @ centre, sigma, options)
        before, generation, leads = spent, 0, False
        while not strategy.stop() and spent + population <= max_evaluations:
            check_stop(should_stop)
            asked = strategy.ask()
            log_weights, excess = _bounded(np.asarray(asked) @ axes.T)
            values = score(log_weights) - excess
            values = np.where(np.isfinite(values), values, -1e12)
            strategy.tell(asked, (-values).tolist())
            spent += population
            top = int(np.argmax(values))
            if values[top] > best_score:
                best, best_score, leads = log_weights[top], float(values[top]), True
            generation += 1
            if refresh is not None and leads and generation % GENERATIONS == 0:
                score = refresh(best - best.mean())
                best_score = float(score(best[None])[0])
            if progress is not None:
                progress("searching the joint weights", spent / max_evaluations, best_score)
        if small_run:
            budget_small += spent - before
        else:
            budget_large += spent - before
        if spent + default > max_evaluations:
            break
    return WeightSearch(best - best.mean(), best_score, spent)


def search_gradient(
    score_and_slope: Callable[[Array], tuple[float, Array]],
    start: Array,
    *,
    max_evaluations: int,
    should_stop: ShouldStop | None = None,
) -> WeightSearch:
    """Maximises a score over log weights by L-BFGS-B with its exact gradient.

    Args:
        score_and_slope: Score and its derivative ``(n,)`` at log weights ``(n,)``.
        start: First log weights.
        max_evaluations: Budget of evaluations.
        should_stop: Asked at each evaluation.

    Returns:
        The best log weights.
    """

    def negative(log_weights: Array) -> tuple[float, Array]:
        check_stop(should_stop)
        value, slope = score_and_slope(log_weights)
        return -value, -slope

    found = scipy.optimize.minimize(
        negative,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=[(-LOG_WEIGHT_BOUND, LOG_WEIGHT_BOUND)] * len(start),
        options={"maxfun": max_evaluations, "ftol": 1e-12, "gtol": 1e-7},
    )
    log_weights = found.x - found.x.mean()
    return WeightSearch(log_weights, float(-found.fun), int(found.nfev))
