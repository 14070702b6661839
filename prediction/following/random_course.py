"""Random functions that every candidate is measured against: one person, whatever the path.

Numbers drawn point by point belong to the sampling of a path: the same path at another rate would
meet another person. Here each sample has functions of what its deviation runs in (travelled
distance, time), fixed once the seed is, and every candidate reads them where it is.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class RandomCourse:
    """Ornstein-Uhlenbeck functions that start at zero, several a sample.

    Each is ``f(s) = exp(-s) B(exp(2 s) - 1)`` for a Brownian motion B, with s in correlation
    lengths; ``cov f(s) = (1 - exp(-2 s)) root root'``. They are drawn on an even grid, in which
    they are exact, and joined by straight lines between, which are scaled to keep the variance
    exact everywhere. Only the correlation of two places in one cell is then too great, by
    at most half a cell's width in lengths.

    Places are visited onwards: what lies behind is forgotten.

    Derived here: between grid values ``a`` and ``b`` with variances ``v_a``, ``v_b`` and
    covariance ``exp(-h) v_a`` the line has variance ``(1-t)^2 v_a + t^2 v_b + 2 t (1-t) exp(-h)
    v_a``.
    """

    def __init__(
        self, rng: np.random.Generator, samples: int, root: Array, cell: float = 1.0 / 16.0
    ) -> None:
        """Draws nothing yet.

        Args:
            rng: Randomness, of these functions alone.
            samples: How many samples, S.
            root: Root of the covariance, ``(n, n)``.
            cell: Width of a grid cell, correlation lengths.
        """
        self._rng, self._root, self._cell = rng, root, cell
        self._first = 0  # grid index of the first value kept
        self._values = np.zeros((1, samples, len(root)), dtype=root.dtype)

    def at(self, place: Array) -> Array:
        """Returns the functions at C places, ``(C, S, n)``.

        Args:
            place: ``(C,)`` correlation lengths; none before the least of the last visit.
        """
        grid = place / self._cell
        index = np.floor(grid).astype(np.int64)
        self._extend(int(index.max()) + 1)
        share = grid - index
        value = self._values[index - self._first]
        after = self._values[index - self._first + 1]
        start = np.asarray(self._cell * index, dtype=np.float64)
        here, there = self._variance(start), self._variance(start + self._cell)
        between = np.exp(-self._cell) * here
        drawn = (1 - share) ** 2 * here + share**2 * there + 2 * share * (1 - share) * between
        wanted = self._variance(place)
        factor = np.sqrt(np.divide(wanted, drawn, out=np.zeros_like(wanted), where=drawn > 0))
        left, right = factor * (1.0 - share), factor * share
        kind = self._values.dtype
        out = left.astype(kind)[:, None, None] * value + right.astype(kind)[:, None, None] * after
        passed = int(index.min()) - self._first
        if passed > 0:
            self._values, self._first = self._values[passed:], self._first + passed
        return np.asarray(out)

    def _extend(self, last: int) -> None:
        missing = last - self._first - len(self._values) + 1
        if missing <= 0:
            return
        rho = np.exp(-self._cell)
        values = [*self._values]
        shape = values[0].shape
        for _ in range(missing):
            normal = self._rng.standard_normal(shape).astype(self._values.dtype, copy=False)
            fresh = float(np.sqrt(1.0 - rho**2)) * (normal @ self._root.T)
            values.append(float(rho) * values[-1] + fresh)
        self._values = np.stack(values)

    @staticmethod
    def _variance(place: Array) -> Array:
        return np.asarray(-np.expm1(-2.0 * place))
