"""What every method answers: the law of the joint velocity given posture and hand velocity.

All methods of this package share one form,
``dq = J_W^+ xdot + V(q) y``, ``y ~ N(mu_y, Sigma_y)`` (Vianello et al. 2021, eq. 7-8), and differ
in W and in the law of y. A method is fitted once and then immutable.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from prediction.demonstrations import Demonstrations
from prediction.errors import TrainingCancelledError
from prediction.laws.null_space import (
    NullSpaceBasis,
    NullSpaceFrame,
    weighted_pseudo_inverse,
    weighted_solution,
)
from prediction.laws.student_t import NINETY

Array = NDArray[np.float64]

#: Called with what is being done, the share done (0 to 1) and the log-likelihood a sample so far.
Progress = Callable[[str, float, float], None]
#: Asked now and then; training stops with `TrainingCancelledError` once it answers True.
ShouldStop = Callable[[], bool]


def check_stop(should_stop: ShouldStop | None) -> None:
    """Raises `TrainingCancelledError` if the caller wants training to stop."""
    if should_stop is not None and should_stop():
        raise TrainingCancelledError("training was cancelled; no model was written")


@dataclass(frozen=True, slots=True)
class Prediction:
    """Mean and covariance of the joint velocity at one or many postures.

    The law is Gaussian, or a t of this covariance: `Predictor.ninety` tells its intervals.

    Attributes:
        mean: ``(..., n)`` rad/s.
        task_gain: ``J_W^+``, ``(..., n, m)``.
        null_factor: ``F`` with the null-space covariance ``F F'``, ``(..., n, k)``.
    """

    mean: Array
    task_gain: Array
    null_factor: Array

    def covariance(self, sigma_x: Array) -> Array:
        """Returns the full covariance ``(..., n, n)``, for hand velocity noise ``(m, m)``.

        Source: Vianello et al. 2021, eq. 8.
        """
        task = self.task_gain @ sigma_x @ np.swapaxes(self.task_gain, -1, -2)
        return np.asarray(task + self.null_factor @ np.swapaxes(self.null_factor, -1, -2))


@dataclass(frozen=True, slots=True)
class LogDensity:
    """Log density of observed joint velocities, in the parts that mean something on their own.

    Attributes:
        task: ``log N(J dq; xdot, Sigma_x)``: how the hand obeyed, ``(...)``.
        null_space: ``log N(y; mu_y, Sigma_y)``: how the posture was chosen, ``(...)``; the part
            methods differ in.
        volume: ``log det(J J') / 2``, ``(...)``.
    """

    task: Array
    null_space: Array
    volume: Array

    @property
    def total(self) -> Array:
        """The log density of the joint velocity, nats."""
        return self.task + self.null_space + self.volume


@dataclass(frozen=True, slots=True)
class Previous:
    """What the step before says about this one; see `prediction.laws.memory.NullSpaceMemory`.

    Attributes:
        residual: Joint velocity there beyond the law's mean, in its null space, ``(..., n)`` rad/s.
        kept: Share of it that is still there, ``(...)``.
        spread: Factor on the null-space covariance, ``(...)``.
    """

    residual: Array
    kept: Array
    spread: Array


class Predictor(ABC):
    """One fitted method for one chain and one task.

    To add a method: subclass, give it a ``name``, the four abstract members and a row in
    ``prediction.laws.methods``; the cases of ``tests/prediction/test_methods.py`` then run on it.
    """

    name: ClassVar[str]
    #: Whether the mean moves the hand exactly as led.
    keeps_hand: ClassVar[bool] = True
    #: Whether the law takes the heavier tails that held-out motion shows; see `with_tails`.
    fits_tails: ClassVar[bool] = False

    @classmethod
    @abstractmethod
    def fit(
        cls,
        demonstrations: Demonstrations,
        rng: np.random.Generator,
        *,
        progress: Progress | None = None,
        should_stop: ShouldStop | None = None,
    ) -> Self:
        """Fits the method; see the subclasses for what else they take."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know of how it was fitted; most methods have nothing to say."""
        return ()

    @property
    def ninety(self) -> float:
        """Half the width of a joint's 90 % interval one step ahead, in standard deviations."""
        return NINETY

    @property
    @abstractmethod
    def basis(self) -> NullSpaceBasis:
        """The null-space axes y is written in."""

    @property
    @abstractmethod
    def weights(self) -> Array:
        """W: ``(n,)`` diagonal or ``(n, n)``; which joints take part in following the hand.

        Where it depends on the posture, see `weights_at`, this is W far from all demonstrations.
        """

    def weights_at(self, q: Array) -> Array:
        """W at postures ``(..., n)``: the same everywhere unless the method says otherwise."""
        return self.weights

    @abstractmethod
    def null_mean(self, q: Array, xdot: Array, frame: NullSpaceFrame) -> Array:
        """Returns ``mu_y`` ``(..., k)`` rad/s."""

    @abstractmethod
    def null_covariance(
        self, q: Array, xdot: Array, frame: NullSpaceFrame, jacobian: Array
    ) -> Array:
        """Returns ``Sigma_y`` ``(..., k, k)``, calibrated."""

    def task_law(
        self, q: Array, xdot: Array, jacobian: Array, sigma_x: Array
    ) -> tuple[Array, Array]:
        """Returns mean ``(..., m)`` and covariance of the hand velocity: as led, give or take."""
        return xdot, sigma_x

    def null_log_density(self, residual: Array, covariance: Array) -> Array:
        """Returns the log density of ``y - mu_y`` under `null_covariance`: Gaussian by default."""
        return gaussian_log_density(residual, covariance)

    @abstractmethod
    def rescaled(self, factor: float) -> Self:
        """Returns the same predictor with its null-space covariance multiplied by ``factor``."""

    def with_tails(self, degrees: float) -> Self:
        """Returns the predictor with a t of these degrees of freedom, if it fits tails.

        The covariance stays.
        """
        return self

    @abstractmethod
    def refitted(self, demonstrations: Demonstrations) -> Self:
        """Returns the predictor of other demonstrations with the same hyper-parameters and W."""

    @abstractmethod
    def to_arrays(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Returns everything needed to rebuild the predictor: arrays and JSON values."""

    @classmethod
    @abstractmethod
    def from_arrays(cls, arrays: Mapping[str, Array], values: Mapping[str, Any]) -> Self:
        """Rebuilds a predictor from `to_arrays`."""

    def null_velocity(self, q: Array, xdot: Array, jacobian: Array) -> Array:
        """Returns the mean null-space velocity ``V mu_y`` ``(..., n)``; cheaper than `predict`."""
        frame = self.basis.frame(jacobian)
        return frame.compose(self.null_mean(q, xdot, frame))

    def predict(
        self, q: Array, xdot: Array, jacobian: Array, previous: Previous | None = None
    ) -> Prediction:
        """Predicts the joint velocity.

        Args:
            q: Postures, ``(..., n)`` rad.
            xdot: Hand velocity, ``(..., m)``, linear rows (m/s) first, base axes.
            jacobian: ``(..., m, n)`` at ``q``.
            previous: What the step before was, where it was measured.

        Returns:
            The law; its mean has ``J mean = xdot`` to rounding.
        """
        frame = self.basis.frame(jacobian)
        covariance = self._covariance(q, xdot, frame, jacobian, previous)
        values, vectors = np.linalg.eigh(covariance)
        factor = vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
        weights = self.weights_at(q)
        mean = weighted_solution(weights, jacobian, xdot)
        mean = mean + frame.compose(self._mean(q, xdot, frame, weights, previous))
        # Near a singularity both parts are large and their rounding is too: one refinement.
        missed = xdot - np.einsum("...mn,...n->...m", jacobian, mean)
        mean = mean + weighted_solution(weights, jacobian, missed)
        return Prediction(
            mean=mean,
            task_gain=weighted_pseudo_inverse(weights, jacobian),
            null_factor=frame.matrix() @ factor,
        )

    def log_prob(
        self,
        q: Array,
        xdot: Array,
        qdot: Array,
        jacobian: Array,
        sigma_x: Array,
        previous: Previous | None = None,
    ) -> LogDensity:
        """Returns the log density of observed joint velocities.

        With ``u = J dq``, ``log p(dq) = log N(u; xdot, Sigma_x) + log N(y; mu_y, Sigma_y)
        + log det(J J') / 2`` where ``y = V' (dq - J_W^+ u)``. It is the density of eq. 7-8 with its
        normalisation in n dimensions; the paper's formula has k.

        Args:
            q: ``(..., n)`` rad.
            xdot: Commanded hand velocity, ``(..., m)``.
            qdot: Observed joint velocity, ``(..., n)`` rad/s.
            jacobian: ``(..., m, n)``.
            sigma_x: Covariance of the hand velocity about the commanded one, ``(m, m)``.
            previous: What the step before was, where it was measured.

        Returns:
            Its three terms.

        Derived here: ``[J; V']`` maps dq to ``(u, V' dq)`` with volume ``sqrt(det J J')``, and
        subtracting ``V' J_W^+ u`` shears without changing volume.
        """
        frame = self.basis.frame(jacobian)
        moved = np.einsum("...mn,...n->...m", jacobian, qdot)
        residual = self._residual(q, qdot, moved, frame, previous)
        covariance = self._covariance(q, moved, frame, jacobian, previous)
        expected, spread = self.task_law(q, xdot, jacobian, sigma_x)
        return LogDensity(
            task=gaussian_log_density(moved - expected, spread),
            null_space=self.null_log_density(residual, covariance),
            volume=frame.log_volume,
        )

    def null_residual(self, q: Array, qdot: Array, jacobian: Array) -> Array:
        """Returns ``V (y - mu_y)``: what was done beyond the law's mean, ``(..., n)`` rad/s.

        Args:
            q: ``(..., n)`` rad.
            qdot: Observed joint velocity, ``(..., n)`` rad/s.
            jacobian: ``(..., m, n)``.
        """
        frame = self.basis.frame(jacobian)
        moved = np.einsum("...mn,...n->...m", jacobian, qdot)
        return frame.compose(self._residual(q, qdot, moved, frame, None))

    def standardised_residuals(
        self, demonstrations: Demonstrations, previous: Previous | None = None
    ) -> Array:
        """Returns null-space residuals whitened by the predicted covariance, ``(N, k)``.

        Independent standard normal if the method's law is the person's.
        """
        q, xdot, J = demonstrations.q, demonstrations.xdot, demonstrations.jacobian
        frame = self.basis.frame(J)
        residual = self._residual(q, demonstrations.qdot, xdot, frame, previous)
        factor = np.linalg.cholesky(self._covariance(q, xdot, frame, J, previous))
        return np.asarray(np.linalg.solve(factor, residual[..., None])[..., 0])

    def _residual(
        self,
        q: Array,
        qdot: Array,
        moved: Array,
        frame: NullSpaceFrame,
        previous: Previous | None,
    ) -> Array:
        """Returns ``y - mu_y`` ``(..., k)`` for a hand that moved with ``moved``."""
        weights = self.weights_at(q)
        y = frame.coordinates(qdot - weighted_solution(weights, frame.jacobian, moved))
        return np.asarray(y - self._mean(q, moved, frame, weights, previous))

    def _mean(
        self,
        q: Array,
        xdot: Array,
        frame: NullSpaceFrame,
        weights: Array,
        previous: Previous | None,
    ) -> Array:
        """Returns ``mu_y`` with what is left of the step before, carried to this null space."""
        mean = self.null_mean(q, xdot, frame)
        if previous is None:
            return mean
        left = previous.kept[..., None] * previous.residual
        moved = np.einsum("...mn,...n->...m", frame.jacobian, left)
        return mean + frame.coordinates(left - weighted_solution(weights, frame.jacobian, moved))

    def _covariance(
        self,
        q: Array,
        xdot: Array,
        frame: NullSpaceFrame,
        jacobian: Array,
        previous: Previous | None,
    ) -> Array:
        covariance = self.null_covariance(q, xdot, frame, jacobian)
        return covariance if previous is None else previous.spread[..., None, None] * covariance


def gaussian_log_density(residual: Array, covariance: Array) -> Array:
    """Returns ``log N(residual; 0, covariance)`` for ``(..., d)`` and ``(..., d, d)``."""
    size = residual.shape[-1]
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, residual[..., None])[..., 0]
    log_det = np.log(np.diagonal(factor, axis1=-2, axis2=-1)).sum(-1)
    return np.asarray(-0.5 * (white**2).sum(-1) - log_det - 0.5 * size * np.log(2 * np.pi))
