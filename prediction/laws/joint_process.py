"""Gaussian processes on the joint velocity itself: conditioned on the hand, or not."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from prediction.demonstrations import Demonstrations
from prediction.laws.joint_gaussian import JointGaussian
from prediction.laws.kernels import InputScaling, KernelKind
from prediction.laws.null_space import NullSpaceBasis, weighted_solution
from prediction.laws.predictor import Prediction, Previous, Progress, ShouldStop, check_stop
from prediction.laws.process import Process
from prediction.search.held_out_likelihood import HeldOutEngine
from prediction.search.law_search import HELD_OUT_PARTS, START_SAMPLES, STARTS
from prediction.search.marginal_likelihood import clip_theta

Array = NDArray[np.float64]

#: Most samples: the cost of the search grows with their cube.
MAX_SAMPLES = 600
#: Kernels tried from the best start.
_EVALUATIONS = 40
#: How far from the start each number is tried first, in logarithm.
_FIRST_STEP = 1.0
#: Diagonal added to the output covariance, as a share of it; as for `CovIk`, less strongly.
_RAISED = 1e-3


@dataclass(frozen=True, slots=True)
class CcGp(JointGaussian):
    """A process on all joint velocities, each prediction conditioned on the hand moving as led.

    Neither weights nor axes are searched: the covariance S between the joints takes the place of
    W, and three numbers of the kernel are found on parts held out in turn.

    Attributes:
        process: The process of ``dq``, rad/s.
        scale: Calibration of the variance.
        reference: Null-space axes.

    Source: `docs/theory/prediction.md`; Gaussian conditioning of a coregionalised process.
    """

    name: ClassVar[str] = "cc-gp"

    process: Process
    scale: float
    reference: NullSpaceBasis

    @classmethod
    def fit(
        cls,
        demonstrations: Demonstrations,
        rng: np.random.Generator,
        *,
        progress: Progress | None = None,
        should_stop: ShouldStop | None = None,
        kernel: KernelKind = "separate",
    ) -> Self:
        """Finds the kernel and conditions the process; ``rng`` is not used.

        Raises:
            DemonstrationError: Too few samples.
            TrainingCancelledError: ``should_stop`` said so.
        """
        check_stop(should_stop)
        demonstrations.check_enough()
        kept = demonstrations.thinned(MAX_SAMPLES)
        scaling = InputScaling.of(kernel, kept.q, kept.xdot, kept.linear_rows)
        few = _HeldOut(cls, scaling, kept.thinned(START_SAMPLES))
        candidates = [
            np.array([length] * scaling.scales + [noise], dtype=np.float64)
            for length, noise in STARTS
        ]
        start = max(candidates, key=few.score)
        search = _HeldOut(cls, scaling, kept)
        best, reached, done = start, -np.inf, 0

        def cost(theta: Array) -> float:
            nonlocal best, reached, done
            check_stop(should_stop)
            clipped = clip_theta(theta, HeldOutEngine.noise_bounds)
            score = search.score(clipped)
            if score > reached:
                best, reached = clipped, score
            done += 1
            if progress is not None:
                progress("fitting the kernel", min(done / _EVALUATIONS, 1.0), reached)
            return -score + float(((theta - clipped) ** 2).sum())

        # The simplex that scipy makes of a start at zero is too small to go anywhere.
        simplex = np.vstack([start, start + _FIRST_STEP * np.eye(len(start))])
        minimize(
            cost,
            start,
            method="Nelder-Mead",
            options={
                "maxfev": _EVALUATIONS,
                "xatol": 0.1,
                "fatol": 1e-3,
                "initial_simplex": simplex,
            },
        )
        return cls._of(kept, scaling, best)

    @classmethod
    def _of(cls, kept: Demonstrations, scaling: InputScaling, theta: Array) -> Self:
        process = Process.conditioned(
            scaling, theta, kept.q, kept.xdot, kept.qdot, constant_mean=False
        )
        covariance = raised(process.output_covariance)
        basis = NullSpaceBasis.around(kept.jacobian)
        return cls(replace(process, output_covariance=covariance), 1.0, basis)

    @staticmethod
    def held_out_score(residual: Array, variance: Array, jacobian: Array) -> float:
        """Returns the density of held-out errors, of what the hand leaves open of them.

        Args:
            residual: Held-out ``dq`` less its prediction, ``(N, n)``.
            variance: Of each, in units of S, ``(N,)``.
            jacobian: ``(N, m, n)``.

        Derived here: with ``x = (I - K J) r`` and V an orthonormal null-space basis the quadratic
        form is ``x' S^-1 x / v`` and the precision ``V' S^-1 V / v``, whose determinant is
        ``|S^-1| |J S J'| / |J J'|``; no basis is needed. The last factor does not depend on S.
        """
        S = raised((residual / variance[:, None]).T @ residual / len(residual))
        moved = np.einsum("tmn,tn->tm", jacobian, residual)
        free = residual - weighted_solution(S, jacobian, moved)
        quadratic = (free * np.linalg.solve(S, free.T).T).sum(axis=1) / variance
        _, log_S = np.linalg.slogdet(S)
        _, log_task = np.linalg.slogdet(jacobian @ S @ np.swapaxes(jacobian, 1, 2))
        size = residual.shape[1] - jacobian.shape[1]
        log_det = log_S - log_task + size * np.log(variance)
        return float(-0.5 * (quadratic + log_det + size * np.log(2.0 * np.pi)).mean())

    @property
    def weights(self) -> Array:
        """S: the covariance between the joints."""
        return self.process.output_covariance

    def joint_mean(self, q: Array, xdot: Array) -> Array:
        """The mean of the process."""
        return self.process.mean(q, xdot)

    def joint_variance(self, q: Array, xdot: Array) -> Array:
        """Noise and what the demonstrations leave open."""
        return np.asarray(self.scale * self.process.variance(q, xdot))

    def rescaled(self, factor: float) -> Self:
        """Multiplies the variance."""
        return replace(self, scale=self.scale * factor)

    def refitted(self, demonstrations: Demonstrations) -> Self:
        """Conditions on other demonstrations; the kernel stays."""
        kept = demonstrations.thinned(MAX_SAMPLES)
        return self._of(kept, self.process.scaling, self.process.theta)

    def to_arrays(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Everything but the training data."""
        arrays, values = self.process.to_arrays()
        arrays |= {"rows": self.reference.rows, "null": self.reference.null}
        return arrays, {**values, "scale": self.scale}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array], values: Mapping[str, Any]) -> Self:
        """Rebuilds."""
        basis = NullSpaceBasis(arrays["rows"], arrays["null"])
        return cls(Process.from_arrays(arrays, values), float(values["scale"]), basis)


class Gp(CcGp):
    """The process as it is: its mean does not move the hand as led.

    The paper's ablation without the null space. A roll-out, which must keep the hand on its path,
    uses what the process says beyond that, as `CcGp` does.

    Source: GP of Vianello et al. 2021, section VI, with one kernel for all joints.
    """

    name: ClassVar[str] = "gp"
    keeps_hand: ClassVar[bool] = False

    @staticmethod
    def held_out_score(residual: Array, variance: Array, jacobian: Array) -> float:
        """Returns the density of held-out joint velocities."""
        S = raised((residual / variance[:, None]).T @ residual / len(residual))
        quadratic = (residual * np.linalg.solve(S, residual.T).T).sum(axis=1) / variance
        size = residual.shape[1]
        log_det = np.linalg.slogdet(S)[1] + size * np.log(variance)
        return float(-0.5 * (quadratic + log_det + size * np.log(2.0 * np.pi)).mean())

    def predict(
        self, q: Array, xdot: Array, jacobian: Array, previous: Previous | None = None
    ) -> Prediction:
        """The process's own mean and covariance; the hand is not held to anything.

        What is known of the step before is in the null space and narrows the law there alone.
        """
        free = super().predict(q, xdot, jacobian, previous)
        expected, spread = self.task_law(q, xdot, jacobian, np.zeros(()))
        gain = free.task_gain
        mean = free.mean + np.einsum("...nm,...m->...n", gain, expected - xdot)
        factor = np.concatenate([gain @ np.linalg.cholesky(spread), free.null_factor], axis=-1)
        return Prediction(mean=mean, task_gain=np.zeros_like(gain), null_factor=factor)

    def task_law(
        self, q: Array, xdot: Array, jacobian: Array, sigma_x: Array
    ) -> tuple[Array, Array]:
        """The hand moves as the process happens to move it."""
        mean = np.einsum("...mn,...n->...m", jacobian, self.process.mean(q, xdot))
        variance = self.joint_variance(q, xdot)[..., None, None]
        spread = jacobian @ self.process.output_covariance @ np.swapaxes(jacobian, -1, -2)
        return mean, variance * spread


class _HeldOut:
    """Scores kernels by the density of parts predicted from the others."""

    def __init__(
        self, method: type[CcGp], scaling: InputScaling, demonstrations: Demonstrations
    ) -> None:
        self.method, self.data = method, demonstrations
        parts = demonstrations.blocks(HELD_OUT_PARTS)
        self.engine = HeldOutEngine(scaling, demonstrations.q, demonstrations.xdot, parts)

    def score(self, theta: Array) -> float:
        try:
            scorer = self.engine.scorer(theta)
        except np.linalg.LinAlgError:
            return -np.inf
        residual, variance = scorer.residuals(self.data.qdot)
        return self.method.held_out_score(residual, variance, self.data.jacobian)


def raised(covariance: Array) -> Array:
    """Returns a covariance between joints with its diagonal raised a little, symmetric."""
    even = 0.5 * (covariance + covariance.T)
    return np.asarray(even + _RAISED * np.diag(np.diagonal(even)))
