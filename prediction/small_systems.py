"""Batches of small dense systems: task-sized (2 to 6) matrices, thousands at a time.

A posture at the edge of reach makes one matrix of a batch singular. LAPACK then refuses the whole
batch; here that batch alone is solved again with a ridge of 1e-10 of the mean eigenvalue, which
bounds joint velocities and leaves the remaining hand error to be measured by the caller.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_RIDGE = 1e-10


def solve_spd(matrix: Array, right: Array) -> Array:
    """Solves ``matrix @ x = right`` for symmetric positive definite matrices.

    Args:
        matrix: ``(..., m, m)``.
        right: ``(..., m, r)``.

    Returns:
        ``(..., m, r)``.
    """
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.solve(_ridged(matrix), right), dtype=np.float64)


def upper_cholesky(matrix: Array) -> Array:
    """Returns the upper triangular ``C`` with a positive diagonal and ``C' C = matrix``."""
    try:
        lower = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        lower = np.linalg.cholesky(_ridged(matrix))
    return np.swapaxes(lower, -1, -2)


def solve_lower(lower: Array, right: Array) -> Array:
    """Solves a regular lower triangular system.

    LU with pivoting is as fast as substitution at this size and stays in one call for a batch.

    Args:
        lower: ``(..., m, m)``.
        right: ``(..., m, r)``.

    Returns:
        ``(..., m, r)``.
    """
    return np.asarray(np.linalg.solve(lower, right), dtype=np.float64)


def _ridged(matrix: Array) -> Array:
    size = matrix.shape[-1]
    scale = np.trace(matrix, axis1=-2, axis2=-1) / size
    floor = np.finfo(np.float64).tiny
    return np.asarray(matrix + (_RIDGE * scale[..., None, None] + floor) * np.eye(size))
