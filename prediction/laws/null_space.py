"""Weighted pseudo-inverses and a null-space basis that never flips.

The singular value decomposition fixes the null space of a Jacobian but not the axes in it: signs
and rotations are up to the LAPACK at hand, and a regression on coordinates that jump learns
nothing. Here the axes are those of one reference null space, carried to each posture by an
orthogonal map that is smooth in the posture, so coordinates of neighbouring postures can be
compared.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prediction.laws.small_systems import Cholesky, solve_spd

Array = NDArray[np.float64]


def weighted_rows(weights: Array, jacobian: Array) -> Array:
    """Returns ``J W``, for diagonal or full weights.

    Args:
        weights: Diagonal ``(n,)`` or full ``(..., n, n)`` symmetric positive definite.
        jacobian: ``(..., m, n)``.

    Returns:
        ``(..., m, n)``.
    """
    if weights.ndim == 1:
        return jacobian * weights
    if weights.ndim == 2:  # one product for the whole batch, not one a posture
        return np.asarray((jacobian.reshape(-1, len(weights)) @ weights).reshape(jacobian.shape))
    return jacobian @ weights


def of_rows(weights: Array, rows: NDArray[np.int64]) -> Array:
    """Returns the weights of some rows of a batch: one set each, or the one set of all."""
    return weights[rows] if weights.ndim == 3 else weights


def weighted_solution(weights: Array, jacobian: Array, task: Array) -> Array:
    """Returns ``J_W^+ x``: the joint velocity with ``J dq = x`` of least ``dq' W^-1 dq``.

    Args:
        weights: ``(n,)`` or ``(..., n, n)``.
        jacobian: ``(..., m, n)``.
        task: ``(..., m)``.

    Returns:
        ``(..., n)``.

    Source: Vianello et al. 2021, section IV-A.
    """
    rows = weighted_rows(weights, jacobian)
    multiplier = solve_spd(rows @ np.swapaxes(jacobian, -1, -2), task[..., None])[..., 0]
    return np.asarray(np.einsum("...mn,...m->...n", rows, multiplier))


def weighted_pseudo_inverse(weights: Array, jacobian: Array) -> Array:
    """Returns ``J_W^+ = W J' (J W J')^-1``, shape ``(..., n, m)``; arguments as above."""
    rows = weighted_rows(weights, jacobian)
    return np.swapaxes(solve_spd(rows @ np.swapaxes(jacobian, -1, -2), rows), -1, -2)


def row_space(jacobian: Array) -> Array:
    """Returns an orthonormal basis of the row space, as rows.

    Args:
        jacobian: ``(..., m, n)`` of full row rank.

    Returns:
        ``(..., m, n)``.
    """
    return Cholesky.of(jacobian @ np.swapaxes(jacobian, -1, -2)).whiten(jacobian)


@dataclass(frozen=True, slots=True)
class NullSpaceBasis:
    """A smooth orthonormal basis ``V(q)`` of the null space, tied to one reference null space.

    With ``R`` the row space of J, its rows chosen so that ``C = R R_ref'`` is upper triangular with
    a positive diagonal (a Cholesky factor, hence unique), the map
    ``U = I - (R + R_ref)' (I + C)^-1 (R + R_ref)``, restricted to the reference null space, is
    ``V = V_ref - (R + R_ref)' (I + C)^-1 R V_ref``. It is orthonormal, spans the null space of J,
    is the identity at the reference and depends on J through its row space alone: signs and
    rotations of any decomposition cannot change it. Only triangular m x m systems are solved; no
    SVD.

    Derived here: with ``Y = -(R + R_ref)'`` and ``M = I + C``, ``Y'Y = M + M'``, so
    ``I - Y M^-1 Y'`` is orthogonal for any two orthonormal row sets, and it sends ``-R_ref`` to
    ``R``; therefore it sends the complement of the one to the complement of the other. ``I + C`` is
    always regular because the diagonal of C is positive.

    Attributes:
        rows: Orthonormal rows of the reference row space, ``(m, n)``.
        null: Orthonormal columns of the reference null space, ``(n, k)``.
    """

    rows: Array
    null: Array

    @classmethod
    def around(cls, jacobian: Array) -> "NullSpaceBasis":
        """Takes as reference the null space nearest to those of many postures.

        Args:
            jacobian: ``(samples, m, n)``.

        Returns:
            The basis whose reference is spanned by the leading eigenvectors of the mean null-space
            projector.
        """
        rows = row_space(jacobian)
        task_dim = rows.shape[-2]
        mean_projector = np.einsum("tmi,tmj->ij", rows, rows) / len(rows)
        _, vectors = np.linalg.eigh(mean_projector)
        null, reference = vectors[:, :-task_dim], vectors[:, -task_dim:]
        return cls(rows=np.ascontiguousarray(reference.T), null=np.ascontiguousarray(null))

    @property
    def redundancy(self) -> int:
        """Number of null-space coordinates, k = n - m."""
        return int(self.null.shape[1])

    def frame(self, jacobian: Array) -> "NullSpaceFrame":
        """Returns the basis at the postures of ``jacobian`` ``(..., m, n)``.

        Derived here: with ``J J' = L L'`` and ``A = L^-1 J R_ref'``, ``A' A`` is the overlap of the
        two row spaces, so its Cholesky factor is C and the aligned rows are ``C^-T A' L^-1 J``.
        """
        shape = (*jacobian.shape[:-1], self.rows.shape[0])
        onto = (jacobian.reshape(-1, jacobian.shape[-1]) @ self.rows.T).reshape(shape)
        root = Cholesky.of(jacobian @ np.swapaxes(jacobian, -1, -2))
        white = root.whiten(onto)
        overlap = Cholesky.of(np.swapaxes(white, -1, -2) @ white)
        return NullSpaceFrame(self, jacobian, root, white, overlap)


@dataclass(frozen=True, slots=True)
class NullSpaceFrame:
    """The null-space basis at given postures; see `NullSpaceBasis`.

    Attributes:
        basis: Reference.
        jacobian: ``(..., m, n)``.
        root: ``L L' = J J'``.
        white: ``A = L^-1 J R_ref'``, ``(..., m, m)``.
        overlap: ``C' C = A' A``, with ``C = R R_ref'`` upper triangular.
    """

    basis: NullSpaceBasis
    jacobian: Array
    root: Cholesky
    white: Array
    overlap: Cholesky

    @property
    def log_volume(self) -> Array:
        """``log det(J J') / 2``, ``(...)``."""
        return self.root.half_log_det

    @property
    def rows(self) -> Array:
        """Aligned orthonormal rows R, ``(..., m, n)``."""
        white = np.swapaxes(self.white, -1, -2) @ self.root.whiten(self.jacobian)
        return self.overlap.whiten(white)

    def compose(self, y: Array) -> Array:
        """Returns the joint velocity ``V y``, ``(..., n)``, of coordinates ``(..., k)``."""
        flat = y @ self.basis.null.T
        reduced = self.overlap.shifted().unwhiten(self._onto_rows(flat))
        turned = self._of_rows(reduced)
        return np.asarray(flat - turned - reduced[..., 0] @ self.basis.rows)

    def coordinates(self, velocity: Array) -> Array:
        """Returns ``V' v`` ``(..., k)`` of joint velocities ``(..., n)``."""
        both = self._onto_rows(velocity) + (velocity @ self.basis.rows.T)[..., None]
        turned = self._of_rows(self.overlap.shifted().whiten(both))
        return np.asarray((velocity - turned) @ self.basis.null)

    def matrix(self) -> Array:
        """Returns ``V`` itself, ``(..., n, k)``."""
        rows = self.rows
        reduced = self.overlap.shifted().unwhiten(rows @ self.basis.null)
        return self.basis.null - np.swapaxes(rows + self.basis.rows, -1, -2) @ reduced

    def _onto_rows(self, velocity: Array) -> Array:
        """Returns ``R v``, ``(..., m, 1)``, without working out R."""
        white = self.root.whiten(self.jacobian @ velocity[..., None])
        return self.overlap.whiten(np.swapaxes(self.white, -1, -2) @ white)

    def _of_rows(self, reduced: Array) -> Array:
        """Returns ``R' x``, ``(..., n)``, of ``(..., m, 1)``, without working out R."""
        multiplier = self.root.unwhiten(self.white @ self.overlap.unwhiten(reduced))
        return np.asarray((np.swapaxes(multiplier, -1, -2) @ self.jacobian)[..., 0, :])
