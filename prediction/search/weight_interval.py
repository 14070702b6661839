"""How well the demonstrations tell each weight of the pseudo-inverse.

The profile of the criterion over one log weight, the others at their best, says how fast the
demonstrations turn against other values. Taken at its word it trusts every sample as new; samples
of a movement repeat each other, so its drop is weighed by what demonstrations say against one
another: where the slopes of whole demonstrations differ more than the curvature promises, the
interval is wider.

Derived here, after the adjusted likelihoods of Chandler and Bate (2007): with the curvature H of
the criterion in log weights of mean zero the variance of ``log w_j`` is ``v_j = H_jj^-1`` if the
samples are independent. If only b parts B are, it is ``c_j = sum_B d_Bj^2 (b - 1) / b``, where
``d_B`` is how far the estimate moves when B is left out: ``-(H - H_B)^-1 s_B``, a Newton step with
the part's own slope and Gauss-Newton curvature (the jackknife; for the marginal likelihood they are
those of the innovations, each sample predicted from the ones before). The interval holds the values
at which the profile is within ``t^2 max(c_j / v_j, 1) / 2`` of its peak, ``t`` the quantile of
Student's distribution with ``b - 1`` degrees. The kernel stays as it was found.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from prediction.laws.student_t import NINETY
from prediction.search.weight_search import LOG_WEIGHT_BOUND, NullSpaceTargets, mean_zero_axes

Array = NDArray[np.float64]

#: Parts that are set against one another: a third of a session is about as unlike the others as
#: another session; with more, coverage of known weights falls (.89, .83, .76 for 3, 4, 6).
PARTS = 3
#: Step of the finite differences of the slope.
_STEP = 1e-4
#: Share of the bound from which on a weight counts as having run into it.
_AT_BOUND = 0.95
#: Share of the largest curvature below which a direction counts as flat.
_RIDGE = 1e-6
#: Values tried for an end of an interval, Newton steps of the others at each, the least share of
#: one, and how far from its drop an end may be, relative.
_STEPS, _INNER, _LEAST, _NEAR = 12, 4, 0.05, 5e-3


@dataclass(frozen=True, slots=True)
class WeightInterval:
    """What the demonstrations leave open of log W, 90 %.

    Attributes:
        low: Lower ends of the log weights, ``(n,)``; mean zero is that of the estimate.
        high: Upper ends, ``(n,)``.
        parts: Parts of the demonstrations that were set against one another.
    """

    low: Array
    high: Array
    parts: int

    @property
    def identified(self) -> NDArray[np.bool_]:
        """Whether the demonstrations bound each weight on both sides, ``(n,)``."""
        inside = (self.low > -LOG_WEIGHT_BOUND) & (self.high < LOG_WEIGHT_BOUND)
        return np.asarray(inside)

    def to_arrays(self) -> dict[str, Array]:
        """Returns what a file keeps."""
        return {
            "weight_low": self.low,
            "weight_high": self.high,
            "weight_parts": np.array([float(self.parts)]),
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array]) -> Self | None:
        """Rebuilds; None if there is none."""
        if "weight_low" not in arrays:
            return None
        parts = int(arrays["weight_parts"][0])
        return cls(arrays["weight_low"], arrays["weight_high"], parts)


class Profile:
    """A criterion of log W under one kernel: ``-N log|R'R / N| / 2`` with residuals ``R = B y``.

    Both the marginal likelihood and the held-out density are of this form, S at its optimum.

    Args:
        residual_map: B, ``(N, N)``; see `FastEngine.residual_map`.
        targets: y as a function of W.
    """

    def __init__(self, residual_map: Array, targets: NullSpaceTargets) -> None:
        """Keeps both."""
        self._map, self._targets = residual_map, targets

    def value(self, log_weights: Array) -> float:
        """Returns the sum over samples, nats, up to a constant."""
        residual = self._map @ self._targets.one(log_weights)
        log_det = float(np.linalg.slogdet(residual.T @ residual)[1])
        return -0.5 * len(residual) * log_det if np.isfinite(log_det) else -np.inf

    def slope(self, log_weights: Array) -> Array:
        """Returns its derivative, ``(n,)``."""
        _, scaled = self._scaled(log_weights)
        return self._targets.pull_back(log_weights, -self._map.T @ scaled)

    def moved(self, log_weights: Array, parts: list[NDArray[np.bool_]], axes: Array) -> Array:
        """Returns how far the optimum moves when each part is left out, ``(b, n)``.

        Args:
            log_weights: The optimum, ``(n,)``.
            parts: Masks ``(N,)``.
            axes: Directions of the log weights, ``(n, d)``.
        """
        residual, scaled = self._scaled(log_weights)
        by_weight = self._targets.sensitivity(log_weights)
        by_weight = (self._map @ by_weight.reshape(len(residual), -1)).reshape(by_weight.shape)
        by_weight = by_weight @ axes
        slopes = -np.einsum("tk,tkd->td", scaled, by_weight)
        # S^-1 = G G': curvature is the square of G' times the sensitivity
        root = np.linalg.cholesky(np.linalg.inv(residual.T @ residual / len(residual)))
        white = np.einsum("tkd,kl->tld", by_weight, root).reshape(len(residual), -1, axes.shape[1])
        curvature = np.einsum("tld,tle->tde", white, white)
        whole = curvature.sum(axis=0)
        ridge = _RIDGE * np.trace(whole) * np.eye(len(whole)) / len(whole)
        away = []
        for part in parts:
            left = whole - curvature[part].sum(axis=0) + ridge
            away.append(-axes @ np.linalg.solve(left, slopes[part].sum(axis=0)))
        return np.array(away).reshape(len(parts), len(log_weights))

    def _scaled(self, log_weights: Array) -> tuple[Array, Array]:
        residual = self._map @ self._targets.one(log_weights)
        S = residual.T @ residual / len(residual)
        return residual, np.asarray(np.linalg.solve(S, residual.T).T, dtype=np.float64)


def weight_interval(
    profile: Profile, log_weights: Array, parts: list[NDArray[np.bool_]]
) -> WeightInterval:
    """Returns the 90 % interval of each log weight.

    Args:
        profile: What was maximised, at the kernel that was found.
        log_weights: The estimate, mean zero, ``(n,)``.
        parts: Masks ``(N,)`` of what may count as independent: demonstrations, or stretches; none
            if every sample may, as in the plain profile likelihood.

    Returns:
        The intervals. An end at `LOG_WEIGHT_BOUND` means that nothing bounds the weight there.
    """
    curvature = _curvature(profile.slope, log_weights)
    free = np.abs(log_weights) < _AT_BOUND * LOG_WEIGHT_BOUND
    others = max(len(parts) - 1, 1)
    quantile = float(stdtrit(others, 0.95)) if parts else NINETY
    low, high = (
        np.minimum(log_weights, -LOG_WEIGHT_BOUND),
        np.maximum(log_weights, LOG_WEIGHT_BOUND),
    )
    shared = _Directions.of(free, curvature)
    moved = profile.moved(log_weights, parts, shared.axes)
    for j in range(len(log_weights)):
        # A weight at its bound stays there while others are looked at: it would take all along,
        # since only ratios mean anything.
        at, away = shared, moved
        if not free[j]:
            at = _Directions.of(free | (np.arange(len(free)) == j), curvature)
            away = profile.moved(log_weights, parts, at.axes)
        between = float((away[:, j] ** 2).sum())
        widened = max(between * others / max(len(parts), 1) / at.inverse[j, j], 1.0)
        drop = 0.5 * widened * quantile**2
        if free[j] or log_weights[j] > 0.0:
            low[j] = _end(profile, log_weights, at.inverse, j, -1.0, drop)
        if free[j] or log_weights[j] < 0.0:
            high[j] = _end(profile, log_weights, at.inverse, j, 1.0, drop)
    return WeightInterval(low, high, len(parts))


@dataclass(frozen=True, slots=True)
class _Directions:
    """Some log weights, their mean zero, and the inverse curvature among them."""

    axes: Array
    inverse: Array

    @classmethod
    def of(cls, chosen: NDArray[np.bool_], curvature: Array) -> "_Directions":
        axes = np.zeros((len(chosen), int(chosen.sum()) - 1))
        axes[chosen] = mean_zero_axes(int(chosen.sum()))
        values, vectors = np.linalg.eigh(axes.T @ curvature @ axes)
        # A direction in which the criterion is flat, or not at its peak, is one nothing is known of
        known = np.maximum(values, _RIDGE * max(values.max(), 1.0))
        return cls(axes, axes @ (vectors / known) @ vectors.T @ axes.T)


def _curvature(slope: Callable[[Array], Array], at: Array) -> Array:
    """Returns minus the second derivative, ``(n, n)``, by differences of the slope."""
    steps = _STEP * np.eye(len(at))
    curvature = np.stack([(slope(at - s) - slope(at + s)) / (2.0 * _STEP) for s in steps])
    return np.asarray(0.5 * (curvature + curvature.T))


def _kept_finite(log_weights: Array) -> Array:
    """Returns log weights no further out than their ratios at the bound of the search reach."""
    return np.clip(log_weights, -2.0 * LOG_WEIGHT_BOUND, 2.0 * LOG_WEIGHT_BOUND)


def _end(
    profile: Profile, peak: Array, inverse: Array, joint: int, sign: float, drop: float
) -> float:
    """Returns where the profile over one log weight has fallen by ``drop``.

    For each value of the one weight the others go to their best by Newton steps with the curvature
    of the peak, halved while they lose; the root of the fall is nearly linear in the value.
    """
    top = profile.value(peak)
    toward = inverse[:, joint] / inverse[joint, joint]  # how the others follow the one
    away = sign * float(np.sqrt(2.0 * drop * inverse[joint, joint]))
    at = peak
    for _ in range(_STEPS):
        away = float(np.clip(peak[joint] + away, -LOG_WEIGHT_BOUND, LOG_WEIGHT_BOUND) - peak[joint])
        at = _kept_finite(at + (peak[joint] + away - at[joint]) * toward)
        reached = profile.value(at)
        for _ in range(_INNER):
            move = inverse @ profile.slope(at)
            move = move - toward * move[joint]
            share = 1.0
            tried = _kept_finite(at + move)
            while (value := profile.value(tried)) < reached and share > _LEAST:
                share *= 0.5
                tried = _kept_finite(at + share * move)
            if not value > reached:
                break
            gained, reached, at = value - reached, value, tried
            if gained < _NEAR * drop:
                break
        fallen = max(top - reached, 1e-12)
        at_bound = abs(peak[joint] + away) >= LOG_WEIGHT_BOUND
        if abs(fallen - drop) < _NEAR * drop or (at_bound and fallen < drop):
            break
        away *= float(np.clip(np.sqrt(drop / fallen), 0.4, 2.0))
    return float(np.clip(peak[joint] + away, -LOG_WEIGHT_BOUND, LOG_WEIGHT_BOUND))
