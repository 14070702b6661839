"""Held-out density of null-space coordinates in closed form, for autocorrelated samples.

Neighbouring samples of a movement repeat each other. The marginal likelihood takes that for a
smooth, noise-free law, shortens the length-scales and interpolates; what it then says between and
beyond the demonstrations is worth little. Here each contiguous part of the demonstrations is
predicted from the others, sample by sample.

The prior mean is zero: far from what was demonstrated y fades, and W alone follows the hand. A
constant estimated from strongly correlated samples would be carried everywhere.

Derived here (and known as the block form of leave-one-out, Rasmussen and Williams, section 5.4.2):
with ``A = (K + rho I)^-1`` the prediction error of block B given all other samples is
``A_BB^-1 (A Y)_B`` and its covariance ``A_BB^-1 (x) S``. Only the diagonal of ``A_BB^-1`` is used:
each sample is scored on its own. Its error is linear in Y, so W keeps its exact gradient.
"""

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from prediction.kernels import InputScaling
from prediction.marginal_likelihood import LOG_NOISE_BOUNDS, FastEngine

Array = NDArray[np.float64]


class HeldOutEngine(FastEngine):
    """Mean log density of samples predicted from the other parts of the demonstrations.

    Args:
        scaling: Input scaling.
        q: Training postures, ``(N, n)``.
        xdot: Training hand velocities, ``(N, m)``.
        parts: Masks ``(N,)`` of the contiguous parts.
    """

    # Human motion is never repeated to better than this; below lies interpolation.
    noise_bounds = (float(np.log(1e-3)), LOG_NOISE_BOUNDS[1])

    def __init__(
        self, scaling: InputScaling, q: Array, xdot: Array, parts: list[NDArray[np.bool_]]
    ) -> None:
        """Keeps the inputs and parts."""
        super().__init__(scaling, q, xdot)
        self._parts = parts

    def log_likelihood(self, theta: Array, Y: Array) -> float:
        """Returns the held-out log density a sample, S at its optimum."""
        try:
            return float(self.scorer(theta).scores(Y[None])[0])
        except np.linalg.LinAlgError:
            return -np.inf

    def scorer(self, theta: Array) -> "HeldOutScorer":  # type: ignore[override]
        """See `LikelihoodEngine.scorer`; the noise ratio is that of theta."""
        K = self.gram(theta)
        count = len(K)
        K[np.diag_indices(count)] += np.exp(theta[-1])
        factor = scipy.linalg.cho_factor(K, lower=True, overwrite_a=True, check_finite=False)
        A = scipy.linalg.cho_solve(factor, np.eye(count), overwrite_b=True, check_finite=False)
        residual_map, variance = np.empty_like(A), np.empty(count)
        for part in self._parts:
            inverse = np.linalg.inv(A[np.ix_(part, part)])
            residual_map[part] = inverse @ A[part]
            variance[part] = np.diagonal(inverse)
        return HeldOutScorer(residual_map, variance)


class HeldOutScorer:
    """Scores targets by their held-out density.

    Args:
        residual_map: ``(N, N)``: held-out errors are ``residual_map @ Y``.
        variance: Their variances before S, ``(N,)``.
    """

    def __init__(self, residual_map: Array, variance: Array) -> None:
        """Keeps both."""
        if not (variance > 0).all():
            raise np.linalg.LinAlgError("a held-out variance is not positive")
        self._map, self._variance = residual_map, variance
        self._constant = 1.0 + np.log(2 * np.pi) + np.log(variance).mean()

    def residuals(self, target: Array) -> tuple[Array, Array]:
        """Returns held-out errors ``(N, k)`` of one target and their variances ``(N,)`` over S."""
        return np.asarray(self._map @ target), self._variance

    def scores(self, targets: Array) -> Array:
        """See `TargetScorer.scores`."""
        residual = np.matmul(self._map, targets)
        weighted = residual / self._variance[:, None]
        moment = np.swapaxes(weighted, 1, 2) @ residual / targets.shape[1]
        sign, log_det = np.linalg.slogdet(moment)
        score = -0.5 * (log_det + targets.shape[2] * self._constant)
        return np.where(sign > 0, score, -np.inf)

    def score_and_slope(self, target: Array) -> tuple[float, Array]:
        """See `TargetScorer.score_and_slope`; ``d score = -tr(S^-1 R' C^-1 dR) / N``."""
        residual = self._map @ target
        weighted = residual / self._variance[:, None]
        S = weighted.T @ residual / len(target)
        slope = -self._map.T @ np.linalg.solve(S, weighted.T).T / len(target)
        return float(self.scores(target[None])[0]), slope
