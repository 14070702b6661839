"""How well the demonstrations tell each weight of the pseudo-inverse.

The profile of the criterion over one log weight, the others at their best, says how fast the
demonstrations turn against other values. Taken at its word it trusts every sample as new; samples
of a movement repeat each other, so its drop is weighed by what demonstrations say against one
another: where the slopes of whole demonstrations differ more than the curvature promises, the
interval is wider.

Derived here, after the adjusted likelihoods of Chandler and Bate (2007): at the optimum the slopes
``s_B`` of parts B of the criterion by log W sum to zero; for the marginal likelihood they are those
of the innovations, each sample predicted from the ones before. With the curvature H in log weights
of mean zero the variance of ``log w_j`` is ``v_j = H_jj^-1`` if samples are independent, and
``c_j = (H^-1 (sum_B s_B s_B') H^-1)_jj b / (b - 1)`` if only the b parts are. The interval holds the
values at which the profile is within ``t^2 c_j / (2 v_j)`` of its peak, ``t`` the quantile of
Student's distribution with ``b - 1`` degrees. The kernel stays as it was found.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from prediction.weight_search import LOG_WEIGHT_BOUND, NullSpaceTargets, mean_zero_axes

Array = NDArray[np.float64]

#: Step of the finite differences of the slope.
_STEP = 1e-4
FLOOR = 1.0
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
        return float(-0.5 * len(residual) * np.linalg.slogdet(residual.T @ residual)[1])

    def slope(self, log_weights: Array) -> Array:
        """Returns its derivative, ``(n,)``."""
        _, scaled = self._scaled(log_weights)
        return self._targets.pull_back(log_weights, -self._map.T @ scaled)

    def rows(self, log_weights: Array) -> Array:
        """Returns what each residual adds to the slope, ``(N, n)``."""
        residual, scaled = self._scaled(log_weights)
        moved = self._targets.sensitivity(log_weights)
        moved = (self._map @ moved.reshape(len(residual), -1)).reshape(moved.shape)
        return np.asarray(-np.einsum("tk,tkn->tn", scaled, moved))

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
        parts: Masks ``(N,)`` of what may count as independent: demonstrations, or stretches.

    Returns:
        The intervals. An end at `LOG_WEIGHT_BOUND` means that nothing bounds the weight there.
    """
    axes = mean_zero_axes(len(log_weights))
    values, vectors = np.linalg.eigh(_curvature(profile.slope, log_weights, axes))
    # A direction in which the criterion is flat, or not at its peak, is one nothing is known of.
    known = np.maximum(values, 1e-6 * max(values.max(), 1.0))
    inverse = axes @ (vectors / known) @ vectors.T @ axes.T
    rows = profile.rows(log_weights)
    slopes = np.stack([rows[part].sum(axis=0) for part in parts])
    others = max(len(parts) - 1, 1)
    between = ((inverse @ slopes.T) ** 2).sum(axis=1) * len(parts) / others
    widened = np.maximum(between / np.diagonal(inverse), FLOOR)
    drop = 0.5 * widened * float(stdtrit(others, 0.95)) ** 2
    ends = [
        [_end(profile, log_weights, inverse, j, sign, drop[j]) for j in range(len(log_weights))]
        for sign in (-1.0, 1.0)
    ]
    return WeightInterval(np.array(ends[0]), np.array(ends[1]), len(parts))


def _curvature(slope: Callable[[Array], Array], at: Array, axes: Array) -> Array:
    """Returns minus the second derivative along ``axes`` (columns), by differences of the slope."""
    rows = [(slope(at - _STEP * a) - slope(at + _STEP * a)) / (2.0 * _STEP) for a in axes.T]
    curvature = np.stack(rows) @ axes
    return np.asarray(0.5 * (curvature + curvature.T))


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
        at = at + (peak[joint] + away - at[joint]) * toward
        reached = profile.value(at)
        for _ in range(_INNER):
            move = inverse @ profile.slope(at)
            move = move - toward * move[joint]
            share = 1.0
            while (value := profile.value(at + share * move)) < reached and share > _LEAST:
                share *= 0.5
            if value <= reached:
                break
            gained, reached, at = value - reached, value, at + share * move
            if gained < _NEAR * drop:
                break
        fallen = max(top - reached, 1e-12)
        at_bound = abs(peak[joint] + away) >= LOG_WEIGHT_BOUND
        if abs(fallen - drop) < _NEAR * drop or (at_bound and fallen < drop):
            break
        away *= float(np.clip(np.sqrt(drop / fallen), 0.4, 2.0))
    return float(peak[joint] + away)
