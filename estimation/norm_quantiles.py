"""Quantiles of the length of an uncertain vector, which is no Gaussian where it is near zero."""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from estimation.map_errors import SensorError
from estimation.spatial import Array

#: Points of the lattice that stands for a three-dimensional normal distribution.
_POINTS = 4096
#: Vectors worked on at once.
_CHUNK = 512
#: Where the spread is below this share of the length, two terms of its series are enough.
_SMALL = 0.08


def norm_quantiles(mean: ArrayLike, covariance: ArrayLike, probabilities: Sequence[float]) -> Array:
    """Returns quantiles of ``|x|`` for ``x`` normal in three dimensions.

    Args:
        mean: ``(..., 3)``.
        covariance: ``(..., 3, 3)``; it may be singular.
        probabilities: ``n`` of them, between zero and one.

    Returns:
        ``(..., n)``, in the units of ``mean``; within a fortieth of the spread.

    Raises:
        SensorError: a probability is not between zero and one.

    Derived here: to second order the length is ``|m| + n'd + (d'd - (n'd)^2) / (2 |m|)``; beyond
    that, a lattice whose points are equally likely stands for the distribution. No random numbers.
    """
    p = np.asarray(probabilities, dtype=np.float64)
    if not np.all((p > 0.0) & (p < 1.0)):
        raise SensorError("probabilities", f"expected between zero and one, got {probabilities}")
    vectors = np.asarray(mean, dtype=np.float64)
    flat = vectors.reshape(-1, 3)
    spread = np.asarray(covariance, dtype=np.float64).reshape(-1, 3, 3)
    length = np.linalg.norm(flat, axis=1)
    total = np.trace(spread, axis1=1, axis2=2)
    near = total < (_SMALL * length) ** 2
    out = np.empty((len(flat), len(p)))
    along = flat[near] / length[near, None]
    variance = np.einsum("ni,nij,nj->n", along, spread[near], along)
    shift = (total[near] - variance) / (2.0 * length[near])
    sd = np.sqrt(np.maximum(variance, 0.0))
    out[near] = (length[near] + shift)[:, None] + sd[:, None] * ndtri(p)
    rest = np.flatnonzero(~near)
    for start in range(0, len(rest), _CHUNK):
        part = rest[start : start + _CHUNK]
        value, vector = np.linalg.eigh(spread[part])
        root = vector * np.sqrt(np.maximum(value, 0.0))[:, None, :]
        lengths = np.linalg.norm(flat[part, :, None] + root @ _lattice(), axis=1)
        out[part] = np.quantile(lengths, p, axis=1).T
    return out.reshape(*vectors.shape[:-1], len(p))


@cache
def _lattice() -> Array:
    """Points ``(3, n)``, equally likely under a standard normal distribution, mean zero.

    Source: the additive recurrence with the powers of the root of ``x^4 = x + 1``, which fills the
    cube evenly; half the points are the others' opposites.
    """
    root = 1.2207440846057596
    steps = root ** -np.arange(1.0, 4.0)
    cube = (0.5 + np.arange(1, _POINTS // 2 + 1) * steps[:, None]) % 1.0
    half = np.asarray(ndtri(cube), dtype=np.float64)
    return np.concatenate([half, -half], axis=1)
