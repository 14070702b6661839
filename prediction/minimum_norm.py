"""Minimum-norm inverse kinematics with the demonstrated amount of scatter around it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from prediction.demonstrations import Demonstrations
from prediction.null_space import NullSpaceBasis, NullSpaceFrame
from prediction.predictor import Predictor, Progress, ShouldStop, check_stop

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class MinimumNormIk(Predictor):
    """The smallest joint velocity that moves the hand as led; y is isotropic about zero.

    The floor every method must beat: it learns one number, the scatter. Use `CovIk` for a
    prediction that knows the person.

    Attributes:
        variance: Variance of each null-space coordinate, (rad/s)^2.
        reference: Null-space axes.
    """

    name: ClassVar[str] = "minimum-norm"

    variance: float
    reference: NullSpaceBasis

    @classmethod
    def fit(
        cls,
        demonstrations: Demonstrations,
        rng: np.random.Generator,
        *,
        progress: Progress | None = None,
        should_stop: ShouldStop | None = None,
    ) -> Self:
        """Measures the scatter; ``rng`` is not used."""
        check_stop(should_stop)
        demonstrations.check_enough()
        return cls._of(demonstrations)

    @classmethod
    def _of(cls, demonstrations: Demonstrations) -> Self:
        basis = NullSpaceBasis.around(demonstrations.jacobian)
        y = basis.frame(demonstrations.jacobian).coordinates(demonstrations.qdot)
        return cls(variance=float((y**2).mean()), reference=basis)

    @property
    def basis(self) -> NullSpaceBasis:
        """The null-space axes."""
        return self.reference

    @property
    def weights(self) -> Array:
        """All joints alike."""
        return np.ones(self.reference.null.shape[0])

    def null_mean(self, q: Array, xdot: Array, frame: NullSpaceFrame) -> Array:
        """Zero: nothing moves that need not."""
        return np.zeros((*q.shape[:-1], self.reference.redundancy))

    def null_covariance(
        self, q: Array, xdot: Array, frame: NullSpaceFrame, jacobian: Array
    ) -> Array:
        """The same in every direction."""
        size = self.reference.redundancy
        return np.broadcast_to(self.variance * np.eye(size), (*q.shape[:-1], size, size))

    def null_velocity(self, q: Array, xdot: Array, jacobian: Array) -> Array:
        """Zero, without working out the basis."""
        return np.zeros_like(q)

    def rescaled(self, factor: float) -> Self:
        """Multiplies the variance."""
        return replace(self, variance=self.variance * factor)

    def refitted(self, demonstrations: Demonstrations) -> Self:
        """Measures the scatter of other demonstrations, however few."""
        return self._of(demonstrations)

    def to_arrays(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Axes and variance."""
        arrays = {"rows": self.reference.rows, "null": self.reference.null}
        return arrays, {"variance": self.variance}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array], values: Mapping[str, Any]) -> Self:
        """Rebuilds."""
        return cls(float(values["variance"]), NullSpaceBasis(arrays["rows"], arrays["null"]))
