"""Quantiles of the length of an uncertain vector, which is no Gaussian where it is near zero."""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from estimation.errors import MeasurementError
from estimation.spatial import Array, BoolArray

#: Points of the lattice that stands for a three-dimensional normal distribution.
_POINTS = 1024
#: Vectors worked on at once: their points then stay in the processor's cache.
_CHUNK = 64
#: The series holds where the length is this many times the spread, and where what is across the
#: vector adds less skew and less length, in units of the spread along it, than this.
_LONG, _LEAST_SKEW, _LEAST_ACROSS = 2.5, 0.8, 1.0


def norm_quantiles(mean: ArrayLike, covariance: ArrayLike, probabilities: Sequence[float]) -> Array:
    """Returns quantiles of ``|x|`` for ``x`` normal in three dimensions.

    Args:
        mean: ``(..., 3)``.
        covariance: ``(..., 3, 3)``; it may be singular.
        probabilities: ``n`` of them, between zero and one.

    Returns:
        ``(..., n)``, in the units of ``mean``; within a twentieth of the spread.

    Raises:
        MeasurementError: a probability is not between zero and one.

    Derived here: with ``u`` along the vector of length ``L`` and ``w`` the square of what is across
    it, the length is ``L + u + w / (2 L) - u w / (2 L^2) + ...``; its first three cumulants give
    quantiles by Cornish and Fisher's expansion. Where that is too short, a lattice whose points are
    equally likely stands for the distribution. No random numbers.
    """
    p = np.asarray(probabilities, dtype=np.float64)
    if not np.all((p > 0.0) & (p < 1.0)):
        raise MeasurementError(f"probabilities: expected between zero and one, got {probabilities}")
    vectors = np.asarray(mean, dtype=np.float64)
    flat = vectors.reshape(-1, 3)
    spread = np.asarray(covariance, dtype=np.float64).reshape(-1, 3, 3)
    out = np.empty((len(flat), len(p)))
    near, out[:] = _series(flat, spread, ndtri(p))
    rest = np.flatnonzero(~near)
    for start in range(0, len(rest), _CHUNK):
        part = rest[start : start + _CHUNK]
        value, vector = np.linalg.eigh(spread[part])
        root = vector * np.sqrt(np.maximum(value, 0.0))[:, None, :]
        points = flat[part, :, None] + root @ _lattice()
        # Sorting is several times as fast here as selecting a few places.
        squares = np.sort(np.einsum("nij,nij->nj", points, points), axis=1)
        place = p * (squares.shape[1] - 1)
        low = np.minimum(place.astype(np.intp), squares.shape[1] - 2)
        step = (squares[:, low + 1] - squares[:, low]) * (place - low)
        out[part] = np.sqrt(squares[:, low] + step)
    return out.reshape(*vectors.shape[:-1], len(p))


def _series(mean: Array, covariance: Array, z: Array) -> tuple[BoolArray, Array]:
    """Returns where the series holds ``(n,)`` and its quantiles ``(n, p)``, zero elsewhere."""
    length = np.linalg.norm(mean, axis=1)
    out = np.zeros((len(mean), len(z)))
    total = np.trace(covariance, axis1=1, axis2=2)
    near = (length > 0.0) & (total <= (length / _LONG) ** 2)
    L, C = length[near], covariance[near]
    n = mean[near] / L[:, None]
    turned = np.einsum("nij,nj->ni", C, n)
    along = np.maximum(np.sum(n * turned, axis=1), 0.0)
    mixed = np.sum(turned**2, axis=1) - along**2
    across = total[near] - along
    squares = np.sum(C * C, axis=(1, 2)) - 2.0 * np.sum(turned**2, axis=1) + along**2
    third = along * across + 2.0 * mixed
    middle = L + across / (2.0 * L) + (third / 2.0 - (across**2 + 2.0 * squares) / 8.0) / L**3
    variance = along + squares / (2.0 * L**2) - third / L**2
    skew = 3.0 * mixed / L
    sd = np.sqrt(np.maximum(variance, 0.0))
    good = (skew <= _LEAST_SKEW * along**1.5) & (across <= _LEAST_ACROSS * L * np.sqrt(along))
    shape = np.divide(skew, sd**3, out=np.zeros_like(sd), where=sd > 0.0)
    found = middle[:, None] + sd[:, None] * (z + shape[:, None] * (z**2 - 1.0) / 6.0)
    places = np.flatnonzero(near)
    near[places] = good
    out[places[good]] = found[good]
    return near, out


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
