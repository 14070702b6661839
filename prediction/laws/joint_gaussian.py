"""Methods that know a Gaussian of the whole joint velocity and condition it on the hand."""

from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from prediction.laws.null_space import NullSpaceBasis, NullSpaceFrame, weighted_solution
from prediction.laws.predictor import Predictor

Array = NDArray[np.float64]


class JointGaussian(Predictor):
    """``dq ~ N(mu, v C)`` before anything is known of the hand, given ``J dq = xdot`` after.

    In the form of every method: ``W = C``, ``V mu_y = (I - K J) mu`` and
    ``Sigma_y = v V' (C - C J' (J C J')^-1 J C) V``, with ``K = C J' (J C J')^-1``.

    Derived here: Gaussian conditioning; eq. 3 of Vianello et al. 2021 with W = C has the same gain.
    """

    reference: NullSpaceBasis

    @abstractmethod
    def joint_mean(self, q: Array, xdot: Array) -> Array:
        """Returns ``mu``, ``(..., n)`` rad/s."""

    @abstractmethod
    def joint_variance(self, q: Array, xdot: Array) -> Array:
        """Returns ``v``, ``(...)``, calibrated; C is `weights_at`."""

    @property
    def basis(self) -> NullSpaceBasis:
        """The null-space axes."""
        return self.reference

    def null_mean(self, q: Array, xdot: Array, frame: NullSpaceFrame) -> Array:
        """What the Gaussian says beyond moving the hand."""
        return frame.coordinates(self.null_velocity(q, xdot, frame.jacobian))

    def null_velocity(self, q: Array, xdot: Array, jacobian: Array) -> Array:
        """``(I - K J) mu``, without working out the basis."""
        mean = self.joint_mean(q, xdot)
        moved = np.einsum("...mn,...n->...m", jacobian, mean)
        return np.asarray(mean - weighted_solution(self.weights_at(q), jacobian, moved))

    def null_covariance(
        self, q: Array, xdot: Array, frame: NullSpaceFrame, jacobian: Array
    ) -> Array:
        """What the hand leaves open.

        Computed as ``v (V' C^-1 V)^-1``, equal by the inverse of a partitioned matrix and positive
        definite however small it is.
        """
        V = frame.matrix()
        precision = np.swapaxes(V, -1, -2) @ np.linalg.solve(self.weights_at(q), V)
        variance = self.joint_variance(q, xdot)
        return np.asarray(variance[..., None, None] * np.linalg.inv(precision))
