"""Laws whose null-space velocity is one Gaussian everywhere; they differ in what is fitted."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from prediction.demonstrations import Demonstrations
from prediction.laws.moment_fit import MomentFit
from prediction.laws.null_space import NullSpaceBasis, NullSpaceFrame
from prediction.laws.predictor import Predictor, Progress, ShouldStop, check_stop
from prediction.search.weight_search import (
    NullSpaceTargets,
    Optimizer,
    search_bipop,
    search_gradient,
)

Array = NDArray[np.float64]

#: Share of the mean variance added to the diagonal of a fitted covariance.
_RIDGE = 1e-6


@dataclass(frozen=True, slots=True)
class GaussianLaw(MomentFit):
    """``dq = J_W^+ xdot + V y`` with ``y ~ N(mean, covariance)`` at every posture.

    Attributes:
        diagonal: Diagonal of W, ``(n,)``.
        mean: ``(k,)`` rad/s.
        covariance: ``(k, k)`` (rad/s)^2.
        scale: Calibration of the variance.
        reference: Null-space axes.
    """

    diagonal: Array
    mean: Array
    covariance: Array
    scale: float
    reference: NullSpaceBasis

    @classmethod
    def of_moments(cls, demonstrations: Demonstrations) -> Self:
        """Takes the moments, all joints alike."""
        return cls._of(demonstrations, np.ones(demonstrations.q.shape[1]))

    @classmethod
    def _of(cls, demonstrations: Demonstrations, diagonal: Array) -> Self:
        basis = NullSpaceBasis.around(demonstrations.jacobian)
        y = NullSpaceTargets(demonstrations, basis).one(np.log(diagonal))
        mean, covariance = cls._moments(y)
        return cls(diagonal, mean, covariance, 1.0, basis)

    @classmethod
    def _moments(cls, y: Array) -> tuple[Array, Array]:
        """Returns the mean and covariance of null-space coordinates ``(N, k)``."""
        return np.zeros(y.shape[1]), _raised(y.T @ y / len(y))

    @property
    def basis(self) -> NullSpaceBasis:
        """The null-space axes."""
        return self.reference

    @property
    def weights(self) -> Array:
        """W."""
        return self.diagonal

    def null_mean(self, q: Array, xdot: Array, frame: NullSpaceFrame) -> Array:
        """The same everywhere."""
        return np.broadcast_to(self.mean, (*q.shape[:-1], len(self.mean)))

    def null_covariance(
        self, q: Array, xdot: Array, frame: NullSpaceFrame, jacobian: Array
    ) -> Array:
        """The same everywhere."""
        size = len(self.mean)
        return np.broadcast_to(self.scale * self.covariance, (*q.shape[:-1], size, size))

    def null_velocity(self, q: Array, xdot: Array, jacobian: Array) -> Array:
        """Without working out the basis where the mean is zero."""
        if not self.mean.any():
            return np.zeros_like(q)
        return Predictor.null_velocity(self, q, xdot, jacobian)

    def rescaled(self, factor: float) -> Self:
        """Multiplies the variance."""
        return replace(self, scale=self.scale * factor)

    def refitted(self, demonstrations: Demonstrations) -> Self:
        """Takes the moments of other demonstrations, however few; W stays."""
        return self._of(demonstrations, self.diagonal)

    def to_arrays(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Everything."""
        arrays = {
            "diagonal": self.diagonal,
            "mean": self.mean,
            "covariance": self.covariance,
            "rows": self.reference.rows,
            "null": self.reference.null,
        }
        return arrays, {"scale": self.scale}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array], values: Mapping[str, Any]) -> Self:
        """Rebuilds."""
        return cls(
            arrays["diagonal"],
            arrays["mean"],
            arrays["covariance"],
            float(values["scale"]),
            NullSpaceBasis(arrays["rows"], arrays["null"]),
        )


class MinimumNormIk(GaussianLaw):
    """The smallest joint velocity that moves the hand as led; y is isotropic about zero.

    The floor every method must beat: it learns one number, the scatter. Use `CovIk` for a
    prediction that knows the person.
    """

    name: ClassVar[str] = "minimum-norm"

    @classmethod
    def _moments(cls, y: Array) -> tuple[Array, Array]:
        size = y.shape[1]
        return np.zeros(size), float((y**2).mean()) * np.eye(size)


class SbM(GaussianLaw):
    """The smallest joint velocity, and y with the demonstrated mean and covariance.

    Source: Sb-M of Vianello et al. 2021, section VI.
    """

    name: ClassVar[str] = "sb-m"

    @classmethod
    def _moments(cls, y: Array) -> tuple[Array, Array]:
        mean = y.mean(axis=0)
        return mean, _raised((y - mean).T @ (y - mean) / len(y))


class WIk(GaussianLaw):
    """The weighted pseudo-inverse alone: W is learned, y is noise about zero.

    Source: W-IK of Vianello et al. 2021, section VI, which gives it no density; here W makes the
    demonstrations most likely under ``y ~ N(0, S)`` with the best S for each W.
    """

    name: ClassVar[str] = "w-ik"

    @classmethod
    def fit(
        cls,
        demonstrations: Demonstrations,
        rng: np.random.Generator,
        *,
        progress: Progress | None = None,
        should_stop: ShouldStop | None = None,
        optimizer: Optimizer = "gradient",
        max_evaluations: int = 3000,
    ) -> Self:
        """Searches W.

        Derived here: with S at its optimum ``Y'Y / N`` the log likelihood a sample is
        ``-log|S| / 2`` and constants, and its slope by Y is ``-Y (Y'Y)^-1``.
        """
        check_stop(should_stop)
        demonstrations.check_enough()
        basis = NullSpaceBasis.around(demonstrations.jacobian)
        targets = NullSpaceTargets(demonstrations, basis)
        start = np.zeros(demonstrations.q.shape[1])

        def score(log_weights: Array) -> Array:
            return _gaussian_score(targets.many(log_weights))

        def score_and_slope(log_weights: Array) -> tuple[float, Array]:
            y = targets.one(log_weights)
            slope = np.asarray(-np.linalg.solve(y.T @ y, y.T).T, dtype=np.float64)
            return float(_gaussian_score(y[None])[0]), targets.pull_back(log_weights, slope)

        if optimizer == "gradient":
            found = search_gradient(
                score_and_slope, start, max_evaluations=max_evaluations, should_stop=should_stop
            )
        else:
            found = search_bipop(
                score,
                start,
                rng,
                max_evaluations=max_evaluations,
                step=0.5,
                restarts=2,
                progress=progress,
                should_stop=should_stop,
            )
        return cls._of(demonstrations, np.exp(found.log_weights))


def _raised(covariance: Array) -> Array:
    """Keeps a covariance of few samples positive definite."""
    ridge = _RIDGE * max(float(np.diagonal(covariance).mean()), 1e-12)
    return np.asarray(covariance + ridge * np.eye(len(covariance)))


def _gaussian_score(y: Array) -> Array:
    """Log likelihood a sample, ``(P,)``, of coordinates ``(P, N, k)`` about zero."""
    count, size = y.shape[1:]
    sign, log_det = np.linalg.slogdet(np.swapaxes(y, 1, 2) @ y / count)
    score = -0.5 * (log_det + size * (np.log(2.0 * np.pi) + 1.0))
    return np.where(sign > 0, score, -np.inf)
