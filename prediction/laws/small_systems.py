"""Batches of small dense systems: task-sized (2 to 12) matrices, thousands at a time.

LAPACK visits such matrices one by one; here the batch is the innermost loop of every operation,
which is three to five times faster at a thousand matrices. A posture at the edge of reach makes
one matrix of a batch singular: that one alone is factored again with a ridge, which bounds joint
velocities and leaves the remaining hand error to be measured by the caller.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Ridge as a share of the mean eigenvalue, by bytes a number.
_RIDGE = {8: 1e-10, 4: 1e-5}


@dataclass(frozen=True, slots=True)
class Cholesky:
    """Factors ``L L'`` of symmetric positive definite matrices.

    Attributes:
        lower: L with the batch last, ``(m, m, B)``; above the diagonal it is not defined.
        inverse: Reciprocals of its diagonal, ``(m, B)``.
        batch: Shape of the batch.
    """

    lower: Array
    inverse: Array
    batch: tuple[int, ...]

    @classmethod
    def of(cls, matrix: Array) -> "Cholesky":
        """Factors ``(..., m, m)``, with a ridge where a matrix is singular."""
        size = matrix.shape[-1]
        columns = np.array(matrix.reshape(-1, size * size).T, order="C")  # a copy, even of one
        lower = columns.reshape(size, size, -1)
        trace = np.einsum("iib->b", lower)
        least = np.maximum(np.finfo(lower.dtype).eps * trace, np.finfo(lower.dtype).tiny)
        inverse, singular = _factor_in_place(lower, least)
        if singular.any():
            rows = matrix.reshape(-1, size, size)[singular]
            again = np.ascontiguousarray(np.moveaxis(rows, 0, -1))
            ridge = _RIDGE[lower.itemsize] / size * trace[singular] + least[singular]
            again[np.arange(size), np.arange(size)] += ridge
            inverse[:, singular], _ = _factor_in_place(again, least[singular])
            lower[..., singular] = again
        return cls(lower, inverse, matrix.shape[:-2])

    @property
    def half_log_det(self) -> Array:
        """``log det(L)``, ``(...)``."""
        return np.asarray(-np.log(self.inverse).sum(axis=0).reshape(self.batch))

    def solve(self, right: Array) -> Array:
        """Returns ``(L L')^-1 right`` for ``(..., m, r)``."""
        return self._out(self._backward(self._forward(self._in(right))))

    def whiten(self, right: Array) -> Array:
        """Returns ``L^-1 right`` for ``(..., m, r)``."""
        return self._out(self._forward(self._in(right)))

    def unwhiten(self, right: Array) -> Array:
        """Returns ``L'^-1 right`` for ``(..., m, r)``."""
        return self._out(self._backward(self._in(right)))

    def upper(self) -> Array:
        """Returns ``L'``, ``(..., m, m)``."""
        size = len(self.lower)
        whole = np.tril(np.moveaxis(self.lower, -1, 0))
        return np.swapaxes(whole, -1, -2).reshape(*self.batch, size, size)

    def shifted(self) -> "Cholesky":
        """Returns the factors of ``(L + I) (L + I)'``."""
        lower = self.lower.copy()
        diagonal = np.arange(len(lower))
        lower[diagonal, diagonal] += 1.0
        return Cholesky(lower, 1.0 / lower[diagonal, diagonal], self.batch)

    def _in(self, right: Array) -> Array:
        """Brings the batch last, in memory that may be written to."""
        shape = (*self.batch, *right.shape[-2:])
        if right.shape != shape:
            right = np.broadcast_to(right, shape)
        flat = right.reshape(-1, right.shape[-2] * right.shape[-1])
        return np.array(flat.T, order="C").reshape(*right.shape[-2:], -1)

    def _out(self, right: Array) -> Array:
        size, columns, _ = right.shape
        flat = np.ascontiguousarray(right.reshape(size * columns, -1).T)
        return flat.reshape(*self.batch, size, columns)

    def _forward(self, x: Array) -> Array:
        for i in range(len(x)):
            x[i] *= self.inverse[i]
            if i + 1 < len(x):
                x[i + 1 :] -= self.lower[i + 1 :, i, None] * x[i]
        return x

    def _backward(self, x: Array) -> Array:
        for i in range(len(x) - 1, -1, -1):
            x[i] *= self.inverse[i]
            if i:
                x[:i] -= self.lower[i, :i, None] * x[i]
        return x


def _factor_in_place(matrix: Array, least: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Replaces ``(m, m, B)`` by lower factors.

    Args:
        matrix: Overwritten.
        least: Pivots up to this are taken to be none, ``(B,)``.

    Returns:
        Reciprocals of the diagonal ``(m, B)``, and which matrices are singular ``(B,)``.
    """
    size = len(matrix)
    inverse = np.empty((size, matrix.shape[-1]), dtype=matrix.dtype)
    smallest = matrix[0, 0].copy()
    for j in range(size):
        np.minimum(smallest, matrix[j, j], out=smallest)
        np.divide(1.0, np.sqrt(np.maximum(matrix[j, j], least)), out=inverse[j])
        matrix[j:, j] *= inverse[j]
        if j + 1 < size:
            below = matrix[j + 1 :, j]
            matrix[j + 1 :, j + 1 :] -= below[:, None] * below[None]
    return inverse, ~(smallest > least)


def solve_spd(matrix: Array, right: Array) -> Array:
    """Solves ``matrix @ x = right`` for symmetric positive definite matrices.

    Args:
        matrix: ``(..., m, m)``.
        right: ``(..., m, r)``.

    Returns:
        ``(..., m, r)``.
    """
    return Cholesky.of(matrix).solve(right)
