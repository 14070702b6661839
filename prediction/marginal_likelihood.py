"""Marginal likelihood of null-space coordinates under one kernel shared by all of them.

``Y ~ N(1 m', S (x) (K + rho I))`` with ``Y`` of N samples and k coordinates: one kernel, one full
covariance S between coordinates (what the paper leaves as the multidimensional Gaussian process),
one noise ratio rho. Mean m and S have closed-form optima and are always taken there, so what is
left to search is ``theta`` = (log length-scales..., log rho).

Derived here: with ``E = Y - 1 m'`` and ``A = (K + rho I)^-1`` the log likelihood is
``-(N k log 2 pi + k log|K + rho I| + N log|S| + tr(S^-1 E' A E)) / 2``; setting derivatives to zero
gives ``m = Y' A 1 / (1' A 1)`` and ``S = E' A E / N``, at which the trace is N k.
"""

from typing import Protocol

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import NDArray

from prediction.kernels import InputScaling, squared_exponential

Array = NDArray[np.float64]

#: Bounds of theta: length-scales in deviations, and the noise ratio.
LOG_SCALE_BOUNDS = (float(np.log(0.05)), float(np.log(100.0)))
LOG_NOISE_BOUNDS = (float(np.log(1e-6)), float(np.log(1e3)))
#: Spread of the noise ratios tried for each candidate W around the current one.
NOISE_STEPS = np.linspace(-3.0, 3.0, 13)


class LikelihoodEngine(Protocol):
    """Computes and maximises the marginal likelihood: fast here, gpytorch as the reference."""

    def log_likelihood(self, theta: Array, Y: Array) -> float:
        """Returns the log likelihood a sample at ``theta``, m and S at their optimum."""

    def optimise(self, theta: Array, Y: Array, iterations: int) -> Array:
        """Returns a theta at least as likely as the one given."""

    def scorer(self, theta: Array) -> "TargetScorer":
        """Returns what scores candidate targets under this kernel."""


class TargetScorer(Protocol):
    """Scores null-space targets under one kernel; the noise ratio is profiled for each."""

    def scores(self, targets: Array) -> Array:
        """Returns the log likelihood a sample, ``(P,)``, of targets ``(P, N, k)``."""

    def score_and_slope(self, target: Array) -> tuple[float, Array]:
        """Returns the score of one target ``(N, k)`` and its derivative by it, ``(N, k)``."""


def clip_theta(theta: Array, noise_bounds: tuple[float, float] = LOG_NOISE_BOUNDS) -> Array:
    """Keeps theta where the numbers stay sound."""
    theta = np.array(theta, dtype=np.float64)
    theta[:-1] = np.clip(theta[:-1], *LOG_SCALE_BOUNDS)
    theta[-1] = np.clip(theta[-1], *noise_bounds)
    return theta


class FastEngine:
    """Exact float64 likelihood in numpy, one eigenbasis of K for all candidates.

    Args:
        scaling: Input scaling.
        q: Training postures, ``(N, n)``.
        xdot: Training hand velocities, ``(N, m)``.
    """

    noise_bounds: tuple[float, float] = LOG_NOISE_BOUNDS

    def __init__(self, scaling: InputScaling, q: Array, xdot: Array) -> None:
        """Keeps the inputs."""
        self._scaling, self._q, self._xdot = scaling, q, xdot

    def gram(self, theta: Array) -> Array:
        """Returns K, ``(N, N)``, unit variance, without noise."""
        inputs = self._scaling.inputs(self._q, self._xdot, theta[:-1])
        return squared_exponential(inputs, inputs)

    def log_likelihood(self, theta: Array, Y: Array) -> float:
        """See `LikelihoodEngine.log_likelihood`."""
        count, size = Y.shape
        K = self.gram(theta)
        K[np.diag_indices(count)] += np.exp(theta[-1])
        try:
            factor = scipy.linalg.cholesky(K, lower=True, overwrite_a=True, check_finite=False)
        except np.linalg.LinAlgError:
            return -np.inf
        right = np.concatenate([Y, np.ones((count, 1))], axis=1)
        white = scipy.linalg.solve_triangular(factor, right, lower=True, check_finite=False)
        Z, one = white[:, :-1], white[:, -1]
        residual = Z - one[:, None] * ((one @ Z) / (one @ one))
        sign, log_det_S = np.linalg.slogdet(residual.T @ residual / count)
        if sign <= 0:
            return -np.inf
        log_det_K = 2.0 * np.log(np.diagonal(factor)).sum()
        total = count * size * (np.log(2 * np.pi) + 1.0) + size * log_det_K + count * log_det_S
        return float(-0.5 * total / count)

    def optimise(self, theta: Array, Y: Array, iterations: int) -> Array:
        """See `LikelihoodEngine.optimise`; Nelder-Mead, since theta has two or three numbers."""

        def negative(candidate: Array) -> float:
            clipped = clip_theta(candidate, self.noise_bounds)
            outside = float(((candidate - clipped) ** 2).sum())
            return -self.log_likelihood(clipped, Y) + outside

        start = clip_theta(theta, self.noise_bounds)
        simplex = np.vstack([start, start + 0.7 * np.eye(len(start))])
        found = scipy.optimize.minimize(
            negative,
            start,
            method="Nelder-Mead",
            options={
                "maxfev": iterations,
                "initial_simplex": simplex,
                "xatol": 1e-3,
                "fatol": 1e-6,
            },
        )
        best = clip_theta(found.x, self.noise_bounds)
        return best if -negative(best) >= -negative(start) else start

    def scorer(self, theta: Array) -> "EigenScorer":
        """See `LikelihoodEngine.scorer`."""
        values, vectors = np.linalg.eigh(self.gram(theta))
        levels = np.exp(np.clip(theta[-1] + NOISE_STEPS, *LOG_NOISE_BOUNDS))
        return EigenScorer(np.maximum(values, 0.0), vectors, levels)


class EigenScorer:
    """Scores targets in the eigenbasis of K, where every noise level is a diagonal.

    Args:
        values: Eigenvalues of K, ``(N,)``.
        vectors: Eigenvectors, ``(N, N)``.
        noise_levels: Noise ratios tried, ``(L,)``.
    """

    def __init__(self, values: Array, vectors: Array, noise_levels: Array) -> None:
        """Precomputes what is the same for every target."""
        self._vectors = vectors
        self._one = vectors.sum(axis=0)
        self._inverse = 1.0 / (values + noise_levels[:, None])
        self._log_det_K = -np.log(self._inverse).sum(axis=1)

    def scores(self, targets: Array) -> Array:
        """See `TargetScorer.scores`."""
        return np.asarray(self._profile(np.matmul(self._vectors.T, targets)).max(axis=0))

    def score_and_slope(self, target: Array) -> tuple[float, Array]:
        """See `TargetScorer.score_and_slope`.

        Derived here: the profiled score is ``-log|S| / 2`` plus constants, so its derivative is
        ``-A E S^-1 / N``; mean and noise level are at their optimum and add nothing.
        """
        rotated = self._vectors.T @ target
        profile = self._profile(rotated[None])[:, 0]
        level = int(np.argmax(profile))
        residual, weighted = self._residual(rotated[None], self._inverse[level])
        S = np.swapaxes(weighted[0], 0, 1) @ residual[0] / len(rotated)
        slope = -np.linalg.solve(S, (self._vectors @ weighted[0]).T).T / len(rotated)
        return float(profile[level]), slope

    def _residual(self, rotated: Array, inverse: Array) -> tuple[Array, Array]:
        one = self._one
        mean = np.matmul(inverse * one, rotated) / (inverse @ one**2)
        residual = rotated - one[:, None] * mean[:, None, :]
        return residual, residual * inverse[:, None]

    def _profile(self, rotated: Array) -> Array:
        count, size = rotated.shape[1:]
        scores = []
        for inverse, log_det_K in zip(self._inverse, self._log_det_K, strict=True):
            residual, weighted = self._residual(rotated, inverse)
            sign, log_det_S = np.linalg.slogdet(np.swapaxes(weighted, 1, 2) @ residual / count)
            total = count * size * (np.log(2 * np.pi) + 1.0) + size * log_det_K + count * log_det_S
            scores.append(np.where(sign > 0, -0.5 * total / count, -np.inf))
        return np.array(scores)
