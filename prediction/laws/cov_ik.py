"""Cov-IK: condition the demonstrated joint-velocity covariance on the hand velocity."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from prediction.demonstrations import Demonstrations
from prediction.laws.joint_gaussian import JointGaussian
from prediction.laws.moment_fit import MomentFit
from prediction.laws.null_space import NullSpaceBasis

Array = NDArray[np.float64]

#: Weight of the diagonal added to the covariance: one motion's covariance is near low rank, and the
#: hand must stay reachable when a joint that hardly moved is needed.
SHRINKAGE = 0.1


def shrunk_moment(qdot: Array) -> Array:
    """Returns the second moment ``(n, n)`` of joint velocities ``(N, n)``, its diagonal raised."""
    moment = qdot.T @ qdot / len(qdot)
    return np.asarray(moment + SHRINKAGE * np.diag(np.diagonal(moment)))


@dataclass(frozen=True, slots=True)
class CovIk(MomentFit, JointGaussian):
    """The joint velocity of a Gaussian, given that the hand moves as led.

    One second moment of the demonstrations says how the joints move together; it is the strongest
    baseline known and has nothing to tune. Use `MiNsGp` when the posture preference depends on
    where the person is. The mean is zero, not the demonstrated one: a hand at rest means a body at
    rest.

    Attributes:
        second_moment: Shrunk second moment C of joint velocities, ``(n, n)``.
        scale: Calibration of the variance (does not move the mean).
        reference: Null-space axes.

    Source: Gaussian conditioning; eq. 3 of Vianello et al. 2021 with W = C, whose minimiser of
    ``dq' C^-1 dq`` is the conditional mean ``C J' (J C J')^-1 xdot``.
    """

    name: ClassVar[str] = "cov-ik"

    second_moment: Array
    scale: float
    reference: NullSpaceBasis

    @classmethod
    def of_moments(cls, demonstrations: Demonstrations) -> Self:
        """Takes the moments."""
        moment = shrunk_moment(demonstrations.qdot)
        return cls(moment, 1.0, NullSpaceBasis.around(demonstrations.jacobian))

    @property
    def weights(self) -> Array:
        """The second moment is the weight matrix."""
        return self.second_moment

    def joint_mean(self, q: Array, xdot: Array) -> Array:
        """Zero: a hand at rest means a body at rest."""
        return np.zeros_like(q)

    def joint_variance(self, q: Array, xdot: Array) -> Array:
        """The calibration alone."""
        return np.full(q.shape[:-1], self.scale)

    def null_velocity(self, q: Array, xdot: Array, jacobian: Array) -> Array:
        """Zero, without working out the basis."""
        return np.zeros_like(q)

    def rescaled(self, factor: float) -> Self:
        """Multiplies the variance; W and so the mean stay."""
        return replace(self, scale=self.scale * factor)

    def to_arrays(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Axes, second moment and calibration."""
        arrays = {
            "second_moment": self.second_moment,
            "rows": self.reference.rows,
            "null": self.reference.null,
        }
        return arrays, {"scale": self.scale}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array], values: Mapping[str, Any]) -> Self:
        """Rebuilds."""
        basis = NullSpaceBasis(arrays["rows"], arrays["null"])
        return cls(arrays["second_moment"], float(values["scale"]), basis)
