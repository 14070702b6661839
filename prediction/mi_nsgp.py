"""MI-NsGP: a Gaussian process in the null space, with the weights of the pseudo-inverse learned."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from prediction.compression import Posterior, compressed_posterior
from prediction.cov_ik import shrunk_moment
from prediction.demonstrations import Demonstrations
from prediction.errors import UnsupportedMethodError
from prediction.held_out_likelihood import HeldOutEngine
from prediction.kernels import KERNELS, InputScaling, KernelKind
from prediction.marginal_likelihood import FastEngine, LikelihoodEngine
from prediction.null_space import NullSpaceBasis, NullSpaceFrame
from prediction.predictor import Predictor, Progress, ShouldStop, check_stop
from prediction.weight_search import (
    OPTIMIZERS,
    NullSpaceTargets,
    Optimizer,
    WeightSearch,
    scaled_correlation,
    search_bipop,
    search_gradient,
)

Array = NDArray[np.float64]
EngineName = Literal["fast", "gpytorch"]
ENGINES: tuple[EngineName, ...] = ("fast", "gpytorch")
#: ``marginal`` likelihood, or the density of parts ``held-out`` in turn, for autocorrelated motion.
Criterion = Literal["marginal", "held-out"]
CRITERIA: tuple[Criterion, ...] = ("marginal", "held-out")
#: ``diagonal`` W as in the paper, or ``correlated``: joint correlations from the demonstrations.
WeightKind = Literal["diagonal", "correlated"]
WEIGHTS: tuple[WeightKind, ...] = ("diagonal", "correlated")
#: Contiguous parts of the held-out criterion.
HELD_OUT_PARTS = 8

#: Most samples the exact likelihood is taken on; neighbours in time beyond that are left out.
MAX_SAMPLES = 900
#: Alternations of weights and hyper-parameters.
ROUNDS = 6
#: Gain in log likelihood a sample below which alternation ends, nats.
ROUND_TOLERANCE = 1e-4


@dataclass(frozen=True, slots=True)
class MiNsGp(Predictor):
    """The operator's law with a posture-dependent preference: W from data, y a Gaussian process.

    Fitted by maximising the marginal likelihood of the null-space coordinates over log W and the
    kernel,
    alternating: for given kernel W is searched with mean, output covariance and noise level at
    their closed-form or grid optimum; for given W the kernel is searched. Use `CovIk` when
    demonstrations are few or another motion must be predicted from them.

    Attributes:
        log_weights: Log of the diagonal of W, mean zero, ``(n,)``.
        correlation: Correlation of the joints in W, ``(n, n)``; None if W is diagonal.
        theta: Log length-scales and log noise ratio.
        mean: Constant mean of y, ``(k,)`` rad/s.
        output_covariance: S, ``(k, k)`` (rad/s)^2.
        scaling: Input scaling.
        posterior: The process on its centres.
        scale: Calibration of the variance.
        reference: Null-space axes.
        score: Log likelihood a sample reached, nats.
        evaluations: Candidates W scored.

    Source: Vianello et al. 2021, section V, with the marginal likelihood in place of the likelihood
    of the training set (which does not identify W), a full S in place of k independent processes,
    and an axis choice that does not flip.
    """

    name: ClassVar[str] = "mi-nsgp"

    log_weights: Array
    correlation: Array | None
    theta: Array
    mean: Array
    output_covariance: Array
    scaling: InputScaling
    posterior: Posterior
    scale: float
    reference: NullSpaceBasis
    score: float
    evaluations: int

    @classmethod
    def fit(
        cls,
        demonstrations: Demonstrations,
        rng: np.random.Generator,
        *,
        progress: Progress | None = None,
        should_stop: ShouldStop | None = None,
        kernel: KernelKind = "separate",
        optimizer: Optimizer = "bipop",
        engine: EngineName = "fast",
        criterion: Criterion = "marginal",
        weights: WeightKind = "diagonal",
        max_evaluations: int = 3000,
        max_samples: int = MAX_SAMPLES,
    ) -> Self:
        """Fits W and the process.

        Args:
            demonstrations: Learned joints only; see `find_reduction`.
            rng: Randomness of the search.
            progress: Told the log likelihood a sample.
            should_stop: Asked often; see `TrainingCancelledError`.
            kernel: ``separate``, or the paper's single length-scale.
            optimizer: ``bipop`` (the paper's), or ``gradient``: the same optimum in fewer
                evaluations.
            engine: ``fast``, or ``gpytorch`` as the slow reference.
            criterion: ``marginal`` likelihood as in the paper, or ``held-out``: the density of
                contiguous parts given the rest, for motion whose samples repeat their neighbours.
            weights: ``diagonal``, or ``correlated``: W has the correlations of the demonstrated
                joint velocities and its diagonal is searched from theirs, where it is `CovIk`'s.
            max_evaluations: Budget of candidates W over all rounds.
            max_samples: Samples kept for the likelihood.

        Returns:
            The fitted predictor.

        Raises:
            DemonstrationError: Too few samples.
            TrainingCancelledError: ``should_stop`` said so.
            UnsupportedMethodError: An option is not known.
        """
        for kind, asked, known in (
            ("kernel", kernel, KERNELS),
            ("optimizer", optimizer, OPTIMIZERS),
            ("engine", engine, ENGINES),
            ("criterion", criterion, CRITERIA),
            ("weights", weights, WEIGHTS),
        ):
            if asked not in known:
                raise UnsupportedMethodError(kind, asked, known)
        demonstrations.check_enough()
        check_stop(should_stop)
        kept = demonstrations.thinned(max_samples)
        basis = NullSpaceBasis.around(kept.jacobian)
        scaling = InputScaling.of(kernel, kept.q, kept.xdot, kept.linear_rows)
        likelihood = _engine(engine, criterion, scaling, kept)
        correlation, start = None, np.zeros(kept.q.shape[1])
        if weights == "correlated":
            start, correlation = demonstrated_weights(kept)
        targets = NullSpaceTargets(kept, basis, correlation)
        search = WeightSearch(start, -np.inf, 0)
        theta = np.array([0.0] * scaling.scales + [np.log(0.1)])
        if scaling.scales == 2:
            theta[1] = 1.0
        theta = likelihood.optimise(theta, targets.one(search.log_weights), 60)
        used = 0
        for turn in range(ROUNDS):
            check_stop(should_stop)
            scorer = likelihood.scorer(theta)

            def score(log_weights: Array) -> Array:
                return scorer.scores(targets.many(log_weights))  # noqa: B023 (used within the turn)

            def score_and_slope(log_weights: Array) -> tuple[float, Array]:
                value, slope = scorer.score_and_slope(targets.one(log_weights))  # noqa: B023
                return value, targets.pull_back(log_weights, slope)

            before = search.score
            if optimizer == "bipop":
                share = max_evaluations // 2 if turn == 0 else (max_evaluations - used) // 2
                search = search_bipop(
                    score,
                    search.log_weights,
                    rng,
                    max_evaluations=max(share, 20),
                    step=0.5 if turn == 0 else 0.1,
                    restarts=2 if turn == 0 else 0,
                    progress=progress,
                    should_stop=should_stop,
                )
            else:
                search = search_gradient(
                    score_and_slope,
                    search.log_weights,
                    max_evaluations=max_evaluations,
                    should_stop=should_stop,
                )
            used += search.evaluations
            theta = likelihood.optimise(theta, targets.one(search.log_weights), 40)
            reached = likelihood.log_likelihood(theta, targets.one(search.log_weights))
            search = replace(search, score=reached)
            if progress is not None:
                progress("fitting the kernel", (turn + 1) / ROUNDS, reached)
            if reached - before < ROUND_TOLERANCE or used >= max_evaluations:
                break
        return cls._conditioned(
            kept, basis, scaling, search.log_weights, correlation, theta, search.score, used
        )

    @classmethod
    def _conditioned(
        cls,
        demonstrations: Demonstrations,
        basis: NullSpaceBasis,
        scaling: InputScaling,
        log_weights: Array,
        correlation: Array | None,
        theta: Array,
        score: float,
        evaluations: int,
    ) -> Self:
        y = NullSpaceTargets(demonstrations, basis, correlation).one(log_weights)
        inputs = scaling.inputs(demonstrations.q, demonstrations.xdot, theta[:-1])
        noise = float(np.exp(theta[-1]))
        plain = compressed_posterior(
            inputs, np.concatenate([y, np.ones((len(y), 1))], axis=1), noise
        )
        # A z = (z - K A z) / rho, with K A z the posterior mean at the training inputs
        smooth = plain.mean(inputs)
        whitened = (np.concatenate([y, np.ones((len(y), 1))], axis=1) - smooth) / noise
        mean = whitened[:, -1] @ y / whitened[:, -1].sum()
        residual = y - mean
        half = whitened[:, :-1] - whitened[:, -1:] * mean
        S = residual.T @ half / len(y)
        weights = plain.mean_weights[:, :-1] - plain.mean_weights[:, -1:] * mean
        return cls(
            log_weights=log_weights,
            correlation=correlation,
            theta=theta,
            mean=mean,
            output_covariance=0.5 * (S + S.T),
            scaling=scaling,
            posterior=replace(plain, mean_weights=weights),
            scale=1.0,
            reference=basis,
            score=score,
            evaluations=evaluations,
        )

    @property
    def basis(self) -> NullSpaceBasis:
        """The null-space axes."""
        return self.reference

    @property
    def weights(self) -> Array:
        """The learned W; the geometric mean of its diagonal is one."""
        return scaled_correlation(self.log_weights, self.correlation)

    def null_mean(self, q: Array, xdot: Array, frame: NullSpaceFrame) -> Array:
        """The mean of the process."""
        return self.mean + self.posterior.mean(self._inputs(q, xdot))

    def null_covariance(
        self, q: Array, xdot: Array, frame: NullSpaceFrame, jacobian: Array
    ) -> Array:
        """Noise and what the demonstrations leave open, in the proportions S."""
        variance = self.posterior.variance(self._inputs(q, xdot)) + np.exp(self.theta[-1])
        return np.asarray(self.scale * variance[..., None, None] * self.output_covariance)

    def rescaled(self, factor: float) -> Self:
        """Multiplies the variance."""
        return replace(self, scale=self.scale * factor)

    def refitted(self, demonstrations: Demonstrations) -> Self:
        """Conditions the process on other demonstrations; W and the kernel stay."""
        kept = demonstrations.thinned(MAX_SAMPLES)
        return self._conditioned(
            kept,
            self.reference,
            self.scaling,
            self.log_weights,
            self.correlation,
            self.theta,
            self.score,
            self.evaluations,
        )

    def implied_costs(self) -> Array:
        """Returns the diagonal of ``W^-1``, ``(n,)``: joint costs for IK libraries."""
        if self.correlation is None:
            return np.asarray(np.exp(-self.log_weights))
        return np.asarray(np.diagonal(np.linalg.inv(self.weights)))

    def to_arrays(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Everything but the training data."""
        arrays = {
            "log_weights": self.log_weights,
            "theta": self.theta,
            "mean": self.mean,
            "output_covariance": self.output_covariance,
            "input_divisor": self.scaling.divisor,
            "centres": self.posterior.centres,
            "mean_weights": self.posterior.mean_weights,
            "variance_root": self.posterior.variance_root,
            "rows": self.reference.rows,
            "null": self.reference.null,
        }
        if self.correlation is not None:
            arrays["correlation"] = self.correlation
        values = {
            "kernel": self.scaling.kind,
            "scale": self.scale,
            "score": self.score,
            "evaluations": self.evaluations,
        }
        return arrays, values

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array], values: Mapping[str, Any]) -> Self:
        """Rebuilds."""
        if values["kernel"] not in KERNELS:
            raise UnsupportedMethodError("kernel", str(values["kernel"]), KERNELS)
        return cls(
            log_weights=arrays["log_weights"],
            correlation=arrays.get("correlation"),
            theta=arrays["theta"],
            mean=arrays["mean"],
            output_covariance=arrays["output_covariance"],
            scaling=InputScaling(
                values["kernel"], arrays["input_divisor"], len(arrays["log_weights"])
            ),
            posterior=Posterior(arrays["centres"], arrays["mean_weights"], arrays["variance_root"]),
            scale=float(values["scale"]),
            reference=NullSpaceBasis(arrays["rows"], arrays["null"]),
            score=float(values["score"]),
            evaluations=int(values["evaluations"]),
        )

    def _inputs(self, q: Array, xdot: Array) -> Array:
        return self.scaling.inputs(q, xdot, self.theta[:-1])


def demonstrated_weights(demonstrations: Demonstrations) -> tuple[Array, Array]:
    """Returns log scale (mean zero) and correlation of demonstrated rates, shrunk."""
    moment = shrunk_moment(demonstrations.qdot)
    variance = np.diagonal(moment)
    log_variance = np.log(variance)
    root = np.sqrt(variance)
    return log_variance - log_variance.mean(), moment / (root[:, None] * root)


def _engine(
    name: EngineName, criterion: Criterion, scaling: InputScaling, kept: Demonstrations
) -> LikelihoodEngine:
    if criterion == "held-out":
        if name != "fast":
            raise UnsupportedMethodError(f"criterion of engine {name}", criterion, ("marginal",))
        return HeldOutEngine(scaling, kept.q, kept.xdot, kept.blocks(HELD_OUT_PARTS))
    if name == "fast":
        return FastEngine(scaling, kept.q, kept.xdot)
    from prediction.gpytorch_engine import GpytorchEngine  # torch only when it is asked for

    return GpytorchEngine(scaling, kept.q, kept.xdot)
