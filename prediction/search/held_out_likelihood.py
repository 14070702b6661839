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
each sample is scored on its own. Errors are linear in Y, so W keeps its exact gradient.

With each demonstration a part of its own this is the leave-one-trajectory-out density.
"""

import numpy as np
from numpy.typing import NDArray

from prediction.laws.kernels import InputScaling
from prediction.search.marginal_likelihood import LOG_NOISE_BOUNDS, FastEngine, inverse_and_log_det

Array = NDArray[np.float64]


class HeldOutEngine(FastEngine):
    """Mean log density of samples predicted from the other parts of the demonstrations.

    Args:
        scaling: Input scaling.
        q: Training postures, ``(N, n)``.
        xdot: Training hand velocities, ``(N, m)``.
        parts: Masks ``(N,)`` of the parts; every sample is in one.
    """

    # Human motion is never repeated to better than this; below lies interpolation.
    noise_bounds = (float(np.log(1e-3)), LOG_NOISE_BOUNDS[1])

    def __init__(
        self, scaling: InputScaling, q: Array, xdot: Array, parts: list[NDArray[np.bool_]]
    ) -> None:
        """Keeps the inputs and parts."""
        super().__init__(scaling, q, xdot)
        self._parts = parts

    @property
    def constant_mean(self) -> bool:
        """Never, see above."""
        return False

    def log_likelihood(self, theta: Array, Y: Array) -> float:
        """Returns the held-out log density a sample, S at its optimum."""
        try:
            return float(self.scorer(theta).scores(Y[None])[0])
        except np.linalg.LinAlgError:
            return -np.inf

    def slopes(self, theta: Array, Y: Array) -> tuple[float, Array, Array]:
        """See `LikelihoodEngine.slopes`.

        Derived here: with ``M_B = A_BB^-1 A_B`` the errors are ``r_B = M_B Y`` and their variances
        ``v_B = diag A_BB^-1``. A change of K moves them by ``dr_B = -M_B dK Z_B`` and
        ``dv_i = M_i dK M_i'``, where ``Z_B = A Y - A_:B r_B`` are the weights of a process
        conditioned without B. S is at its optimum and adds nothing.
        """
        count, size = Y.shape
        K = self.gram(theta)
        A, _ = inverse_and_log_det(self.noisy(K, theta))
        scorer = self._scorer(A)
        residual, variance = scorer.residuals(Y)
        S = (residual / variance[:, None]).T @ residual / count
        if np.linalg.slogdet(S)[0] <= 0:
            raise np.linalg.LinAlgError("the targets do not span their space")
        pull = np.linalg.solve(S, residual.T).T / variance[:, None] / count
        share = 0.5 * ((residual * pull).sum(axis=1) - size / count) / variance
        rows = scorer.residual_map
        by_gram = rows.T @ (share[:, None] * rows)
        solved = A @ Y
        left = np.concatenate([rows[part].T @ pull[part] for part in self._parts], axis=1)
        right = np.concatenate([solved - A[:, p] @ residual[p] for p in self._parts], axis=1)
        by_gram += left @ right.T
        by_gram = 0.5 * (by_gram + by_gram.T)
        value = float(scorer.scores(Y[None])[0])
        return value, self.by_theta(theta, K, by_gram), -rows.T @ pull

    def residual_map(self, theta: Array) -> Array:
        """Returns B, ``(N, N)``: held-out errors in deviations are ``B Y``."""
        scorer = self.scorer(theta)
        return np.asarray(scorer.residual_map / np.sqrt(scorer.variance)[:, None])

    def scorer(self, theta: Array) -> "HeldOutScorer":
        """See `LikelihoodEngine.scorer`; the noise ratio is that of theta."""
        return self._scorer(inverse_and_log_det(self.noisy(self.gram(theta), theta))[0])

    def _scorer(self, A: Array) -> "HeldOutScorer":
        residual_map, variance = np.empty_like(A), np.empty(len(A))
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
        self.residual_map, self.variance = residual_map, variance
        self._constant = 1.0 + np.log(2 * np.pi) + np.log(variance).mean()

    def residuals(self, target: Array) -> tuple[Array, Array]:
        """Returns held-out errors ``(N, k)`` of one target and their variances ``(N,)`` over S."""
        return np.asarray(self.residual_map @ target), self.variance

    def scores(self, targets: Array) -> Array:
        """See `TargetScorer.scores`."""
        residual = np.matmul(self.residual_map, targets)
        weighted = residual / self.variance[:, None]
        moment = np.swapaxes(weighted, 1, 2) @ residual / targets.shape[1]
        sign, log_det = np.linalg.slogdet(moment)
        score = -0.5 * (log_det + targets.shape[2] * self._constant)
        return np.where(sign > 0, score, -np.inf)
