"""Marginal likelihood of null-space coordinates under one kernel shared by all of them.

``Y ~ N(1 m', S (x) (K + rho I))`` with ``Y`` of N samples and k coordinates: one kernel, one full
covariance S between coordinates (what the paper leaves as the multidimensional Gaussian process),
one noise ratio rho. Mean m and S have closed-form optima and are always taken there, so what is
left to search is ``theta`` = (log length-scales..., log rho). Only the paper's kernel has a mean:
with a length-scale for each input, a constant is carried to where nothing was demonstrated, and
errs there (x1.15 on the time blocks of the planar operator).

Derived here: with ``E = Y - 1 m'`` and ``A = (K + rho I)^-1`` the log likelihood is
``-(N k log 2 pi + k log|K + rho I| + N log|S| + tr(S^-1 E' A E)) / 2``; setting derivatives to zero
gives ``m = Y' A 1 / (1' A 1)`` and ``S = E' A E / N``, at which the trace is N k.
"""

from typing import Protocol

import numpy as np
import scipy.linalg
import scipy.optimize
from numpy.typing import NDArray

from prediction.laws.kernels import InputScaling, squared_exponential

Array = NDArray[np.float64]

#: Bounds of theta: length-scales in deviations, and the noise ratio.
LOG_SCALE_BOUNDS = (float(np.log(0.05)), float(np.log(100.0)))
LOG_NOISE_BOUNDS = (float(np.log(1e-6)), float(np.log(1e3)))
#: Spread of the noise ratios tried for each candidate W around the current one.
NOISE_STEPS = np.linspace(-3.0, 3.0, 13)
#: What a search is told where the numbers give out; its line search then turns back.
OUT_OF_REACH = -1e10


class LikelihoodEngine(Protocol):
    """Computes a likelihood of null-space targets: fast here, gpytorch as the reference."""

    noise_bounds: tuple[float, float]

    def log_likelihood(self, theta: Array, Y: Array) -> float:
        """Returns the log likelihood a sample at ``theta``, m and S at their optimum."""

    def slopes(self, theta: Array, Y: Array) -> tuple[float, Array, Array]:
        """Returns the log likelihood a sample, and its derivatives by ``theta`` and by ``Y``.

        Raises:
            numpy.linalg.LinAlgError: The kernel is singular there.
        """

    def scorer(self, theta: Array) -> "TargetScorer":
        """Returns what scores candidate targets under this kernel."""


class TargetScorer(Protocol):
    """Scores null-space targets under one kernel."""

    def scores(self, targets: Array) -> Array:
        """Returns the log likelihood a sample, ``(P,)``, of targets ``(P, N, k)``."""


def theta_bounds(engine: LikelihoodEngine, size: int) -> list[tuple[float, float]]:
    """Returns the bounds of each number of a theta of ``size`` numbers."""
    return [LOG_SCALE_BOUNDS] * (size - 1) + [engine.noise_bounds]


def optimise_kernel(engine: LikelihoodEngine, theta: Array, Y: Array, iterations: int) -> Array:
    """Returns a theta at least as likely as the one given, by L-BFGS on the exact slope.

    Args:
        engine: What says how likely.
        theta: Where to begin.
        Y: Targets, ``(N, k)``.
        iterations: Most evaluations.
    """
    bounds = theta_bounds(engine, len(theta))
    start = np.clip(theta, *np.transpose(bounds))
    best, reached = np.asarray(start, dtype=np.float64), -np.inf

    def negative(candidate: Array) -> tuple[float, Array]:
        nonlocal best, reached
        try:
            value, slope, _ = engine.slopes(candidate, Y)
        except np.linalg.LinAlgError:
            return -OUT_OF_REACH, np.zeros_like(candidate)
        if value > reached:
            best, reached = candidate.copy(), value
        return -value, -slope

    options = {"maxfun": iterations, "ftol": 1e-10, "gtol": 1e-5}
    scipy.optimize.minimize(
        negative, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options
    )
    return best


def clip_theta(theta: Array, noise_bounds: tuple[float, float] = LOG_NOISE_BOUNDS) -> Array:
    """Keeps theta where the numbers stay sound."""
    theta = np.array(theta, dtype=np.float64)
    theta[:-1] = np.clip(theta[:-1], *LOG_SCALE_BOUNDS)
    theta[-1] = np.clip(theta[-1], *noise_bounds)
    return theta


def inverse_and_log_det(matrix: Array) -> tuple[Array, float]:
    """Returns inverse and log determinant of a symmetric matrix, which is overwritten.

    Raises:
        numpy.linalg.LinAlgError: It is not positive definite.
    """
    factor, failed = scipy.linalg.lapack.dpotrf(matrix, lower=1, overwrite_a=1, clean=0)
    if failed:
        raise np.linalg.LinAlgError("the kernel matrix is singular")
    log_det = 2.0 * float(np.log(np.diagonal(factor)).sum())
    inverse, failed = scipy.linalg.lapack.dpotri(factor, lower=1, overwrite_c=1)
    if failed:
        raise np.linalg.LinAlgError("the kernel matrix is singular")
    lower = np.tril(inverse)
    return np.asarray(lower + np.tril(lower, -1).T), log_det


class FastEngine:
    """Exact float64 marginal likelihood in numpy, one eigenbasis of K for all candidates.

    Args:
        scaling: Input scaling.
        q: Training postures, ``(N, n)``.
        xdot: Training hand velocities, ``(N, m)``.
    """

    noise_bounds: tuple[float, float] = LOG_NOISE_BOUNDS

    def __init__(self, scaling: InputScaling, q: Array, xdot: Array) -> None:
        """Keeps the inputs."""
        self._scaling, self._q, self._xdot = scaling, q, xdot

    @property
    def constant_mean(self) -> bool:
        """Whether m is searched, or zero; see `InputScaling.constant_mean`."""
        return self._scaling.constant_mean

    def gram(self, theta: Array) -> Array:
        """Returns K, ``(N, N)``, unit variance, without noise."""
        inputs = self._scaling.inputs(self._q, self._xdot, theta[:-1])
        return squared_exponential(inputs, inputs)

    def noisy(self, gram: Array, theta: Array) -> Array:
        """Returns ``K + rho I``, a copy."""
        K = gram.copy()
        K[np.diag_indices(len(K))] += np.exp(theta[-1])
        return K

    def log_likelihood(self, theta: Array, Y: Array) -> float:
        """See `LikelihoodEngine.log_likelihood`."""
        count, size = Y.shape
        K = self.noisy(self.gram(theta), theta)
        try:
            factor = scipy.linalg.cholesky(K, lower=True, overwrite_a=True, check_finite=False)
        except np.linalg.LinAlgError:
            return -np.inf
        right = np.concatenate([Y, np.ones((count, 1))], axis=1)
        white = scipy.linalg.solve_triangular(factor, right, lower=True, check_finite=False)
        residual, one = white[:, :-1], white[:, -1]
        if self.constant_mean:
            residual = residual - one[:, None] * ((one @ residual) / (one @ one))
        sign, log_det_S = np.linalg.slogdet(residual.T @ residual / count)
        if sign <= 0:
            return -np.inf
        log_det_K = 2.0 * np.log(np.diagonal(factor)).sum()
        total = count * size * (np.log(2 * np.pi) + 1.0) + size * log_det_K + count * log_det_S
        return float(-0.5 * total / count)

    def slopes(self, theta: Array, Y: Array) -> tuple[float, Array, Array]:
        """See `LikelihoodEngine.slopes`.

        Derived here: mean and S are at their optimum and add nothing to a derivative, so with
        ``F = A E`` that by K is ``(F S^-1 F' - k A) / 2 N`` and that by Y is ``-F S^-1 / N``.
        """
        count, size = Y.shape
        K = self.gram(theta)
        A, log_det_K = inverse_and_log_det(self.noisy(K, theta))
        solved, residual = A @ Y, Y
        if self.constant_mean:
            one = A.sum(axis=1)
            mean = one @ Y / one.sum()
            solved, residual = solved - np.outer(one, mean), Y - mean
        S = residual.T @ solved / count
        sign, log_det_S = np.linalg.slogdet(S)
        if sign <= 0:
            raise np.linalg.LinAlgError("the targets do not span their space")
        total = count * size * (np.log(2 * np.pi) + 1.0) + size * log_det_K + count * log_det_S
        scaled = np.linalg.solve(S, solved.T).T
        by_gram = scaled @ solved.T
        by_gram -= size * A
        by_gram *= 0.5 / count
        return -0.5 * total / count, self.by_theta(theta, K, by_gram), -scaled / count

    def by_theta(self, theta: Array, gram: Array, slope: Array) -> Array:
        """Returns the derivative by theta of what has the derivative ``slope`` by ``K + rho I``.

        Derived here: ``K_ij = exp(-sum_s d_s^2 / 2)`` gives ``dK_ij / d log l_s = K_ij d_s^2``,
        and ``d_s^2`` is ``|a_i|^2 + |a_j|^2 - 2 a_i' a_j``, so no matrix of distances is needed.

        Args:
            theta: Where.
            gram: K there, without noise.
            slope: Symmetric, ``(N, N)``; overwritten.
        """
        noise = np.exp(theta[-1]) * np.trace(slope)
        slope *= gram
        row = slope.sum(axis=1)
        inputs = self._scaling.inputs(self._q, self._xdot, theta[:-1])
        lengths = []
        for group in self._scaling.groups:
            a = inputs[:, group]
            lengths.append(2.0 * (row @ (a**2).sum(axis=1) - (a * (slope @ a)).sum()))
        return np.array([*lengths, noise])

    def residual_map(self, theta: Array) -> Array:
        """Returns B, ``(N, N)``: the likelihood of Y is ``-log|(B Y)' B Y / N| / 2`` and constants.

        Its rows are the innovations: each sample less what those before it predict, in deviations.
        """
        count = len(self._q)
        K = self.noisy(self.gram(theta), theta)
        factor = scipy.linalg.cholesky(K, lower=True, overwrite_a=True, check_finite=False)
        whiten = scipy.linalg.solve_triangular(
            factor, np.eye(count), lower=True, overwrite_b=True, check_finite=False
        )
        if self.constant_mean:
            one = whiten.sum(axis=1)
            whiten -= np.outer(one, one @ whiten) / (one @ one)
        return np.asarray(whiten)

    def scorer(self, theta: Array) -> "TargetScorer":
        """See `LikelihoodEngine.scorer`; the noise ratio is profiled for each target."""
        values, vectors = np.linalg.eigh(self.gram(theta))
        levels = np.exp(np.clip(theta[-1] + NOISE_STEPS, *LOG_NOISE_BOUNDS))
        return EigenScorer(np.maximum(values, 0.0), vectors, levels, self.constant_mean)


class EigenScorer:
    """Scores targets in the eigenbasis of K, where every noise level is a diagonal.

    Args:
        values: Eigenvalues of K, ``(N,)``.
        vectors: Eigenvectors, ``(N, N)``.
        noise_levels: Noise ratios tried, ``(L,)``.
        constant_mean: Whether the mean is at its optimum, or zero.
    """

    def __init__(
        self, values: Array, vectors: Array, noise_levels: Array, constant_mean: bool
    ) -> None:
        """Precomputes what is the same for every target."""
        self._vectors = vectors
        self._one = vectors.sum(axis=0) if constant_mean else None
        self._inverse = 1.0 / (values + noise_levels[:, None])
        self._log_det_K = -np.log(self._inverse).sum(axis=1)

    def scores(self, targets: Array) -> Array:
        """See `TargetScorer.scores`."""
        rotated = np.matmul(self._vectors.T, targets)
        count, size = rotated.shape[1:]
        scores = []
        for inverse, log_det_K in zip(self._inverse, self._log_det_K, strict=True):
            residual = rotated
            if self._one is not None:
                mean = np.matmul(inverse * self._one, rotated) / (inverse @ self._one**2)
                residual = rotated - self._one[:, None] * mean[:, None, :]
            weighted = residual * inverse[:, None]
            sign, log_det_S = np.linalg.slogdet(np.swapaxes(weighted, 1, 2) @ residual / count)
            total = count * size * (np.log(2 * np.pi) + 1.0) + size * log_det_K + count * log_det_S
            scores.append(np.where(sign > 0, -0.5 * total / count, -np.inf))
        return np.asarray(np.max(scores, axis=0))
