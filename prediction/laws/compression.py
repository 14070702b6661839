"""A trained Gaussian process on few centres, for thousands of evaluations a millisecond."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from prediction.laws.kernels import squared_exponential

Array = NDArray[np.float64]

#: Most centres kept.
MAX_CENTRES = 384
#: Prior variance left unexplained at every training input, relative, at which no more are added.
RESIDUAL_TOLERANCE = 1e-4
#: The same as a share of the noise, whichever is less, but not below the rounding of the factor.
NOISE_SHARE = 1e-2
TOLERANCE_FLOOR = 1e-7
_JITTER = 1e-9
#: Postures worked on at once: their features then stay in the processor's cache.
_CHUNK = 256


@dataclass(frozen=True, slots=True)
class Posterior:
    """Mean and variance of a Gaussian process with unit prior variance.

    Attributes:
        centres: Scaled inputs, ``(M, d)``.
        mean_weights: ``(M, k)``: the mean is ``k(x, centres) @ mean_weights``.
        variance_root: ``(M, M)``: the variance is ``1 - |k(x, centres) @ variance_root|^2``.
    """

    centres: Array
    mean_weights: Array
    variance_root: Array

    def mean(self, inputs: Array) -> Array:
        """Returns the mean, ``(..., k)``, at scaled inputs ``(..., d)``."""
        flat = inputs.reshape(-1, inputs.shape[-1])
        mean = np.empty((len(flat), self.mean_weights.shape[1]), dtype=flat.dtype)
        for start in range(0, len(flat), _CHUNK):
            part = slice(start, start + _CHUNK)
            mean[part] = squared_exponential(flat[part], self.centres) @ self.mean_weights
        return mean.reshape(*inputs.shape[:-1], -1)

    def variance(self, inputs: Array) -> Array:
        """Returns the variance of the noise-free function, ``(...)`` in [0, 1]."""
        flat = inputs.reshape(-1, inputs.shape[-1])
        explained = np.empty(len(flat), dtype=flat.dtype)
        for start in range(0, len(flat), _CHUNK):
            part = slice(start, start + _CHUNK)
            known = squared_exponential(flat[part], self.centres) @ self.variance_root
            explained[part] = (known**2).sum(-1)
        return np.asarray(np.clip(1.0 - explained, 0.0, 1.0).reshape(inputs.shape[:-1]))


def exact_posterior(inputs: Array, residual: Array, noise: float) -> Posterior:
    """Conditions on every training point.

    Args:
        inputs: Scaled inputs, ``(N, d)``.
        residual: Targets less their mean, ``(N, k)``.
        noise: Noise ratio rho.

    Returns:
        The posterior on N centres.
    """
    K = squared_exponential(inputs, inputs)
    K[np.diag_indices(len(K))] += noise
    factor = scipy.linalg.cholesky(K, lower=True, overwrite_a=True, check_finite=False)
    weights = scipy.linalg.cho_solve((factor, True), residual, check_finite=False)
    root = scipy.linalg.solve_triangular(
        factor, np.eye(len(factor)), lower=True, trans="T", check_finite=False
    )
    return Posterior(inputs, weights, root)


def pivoted_centres(inputs: Array, at_most: int, tolerance: float) -> NDArray[np.int64]:
    """Chooses the training inputs that explain the others best, greedily.

    Args:
        inputs: Scaled inputs, ``(N, d)``.
        at_most: Most centres.
        tolerance: Largest prior variance left at any input.

    Returns:
        Indices of the centres.

    Source: partial Cholesky factorisation with diagonal pivoting (Harbrecht, Peters and Schneider
        2012).
    """
    count = len(inputs)
    rows = np.zeros((min(at_most, count), count))
    left = np.ones(count)
    chosen: list[int] = []
    for step in range(len(rows)):
        pivot = int(np.argmax(left))
        if left[pivot] <= tolerance:
            break
        column = squared_exponential(inputs[pivot : pivot + 1], inputs)[0]
        column -= rows[:step, pivot] @ rows[:step]
        rows[step] = column / np.sqrt(left[pivot])
        left = np.maximum(left - rows[step] ** 2, 0.0)
        left[pivot] = 0.0
        chosen.append(pivot)
    return np.array(chosen, dtype=np.int64)


def compressed_posterior(
    inputs: Array,
    residual: Array,
    noise: float,
    *,
    at_most: int = MAX_CENTRES,
    tolerance: float | None = None,
) -> Posterior:
    """Conditions on every training point, through few centres.

    The function is written on the kernel's features at the centres and regressed on all targets
    with the same noise, so nothing seen is thrown away; only variation between centres is lost, at
    most ``tolerance`` of the prior variance at any training input unless ``at_most`` stops earlier.

    Args:
        inputs: Scaled inputs, ``(N, d)``.
        residual: Targets less their mean, ``(N, k)``.
        noise: Noise ratio rho.
        at_most: Most centres.
        tolerance: See `pivoted_centres`; from the constants above if not given.

    Returns:
        The posterior on M <= N centres; the exact one when all inputs would be centres.

    Source: deterministic training conditional, Quinonero-Candela and Rasmussen 2005, eq. 20.
    """
    if tolerance is None:
        tolerance = max(min(RESIDUAL_TOLERANCE, NOISE_SHARE * noise), TOLERANCE_FLOOR)
    chosen = pivoted_centres(inputs, at_most, tolerance)
    if len(chosen) == len(inputs):
        return exact_posterior(inputs, residual, noise)
    centres = inputs[chosen]
    K = squared_exponential(centres, centres)
    K[np.diag_indices(len(K))] += _JITTER
    factor = scipy.linalg.cholesky(K, lower=True, overwrite_a=True, check_finite=False)
    whitener = scipy.linalg.solve_triangular(
        factor, np.eye(len(factor)), lower=True, trans="T", check_finite=False
    )
    features = squared_exponential(inputs, centres) @ whitener
    precision = features.T @ features / noise + np.eye(len(centres))
    lower = scipy.linalg.cholesky(precision, lower=True, check_finite=False)
    weights = scipy.linalg.cho_solve((lower, True), features.T @ residual / noise)
    # prior explained by the features, less what the data leave open about their weights
    covariance = scipy.linalg.cho_solve((lower, True), np.eye(len(centres)))
    values, vectors = np.linalg.eigh(np.eye(len(centres)) - covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return Posterior(centres, whitener @ weights, whitener @ root)
