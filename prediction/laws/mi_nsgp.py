"""MI-NsGP: a Gaussian process in the null space, with the weights of the pseudo-inverse learned."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from prediction.demonstrations import Demonstrations
from prediction.laws.kernels import KernelKind
from prediction.laws.null_space import NullSpaceBasis, NullSpaceFrame
from prediction.laws.predictor import Predictor, Progress, ShouldStop, gaussian_log_density
from prediction.laws.process import Process
from prediction.laws.student_t import ninety, student_t_log_density
from prediction.search.law_search import (
    Criterion,
    EngineName,
    Law,
    SearchOptions,
    WeightKind,
    criterion_engine,
    search_law,
)
from prediction.search.marginal_likelihood import FastEngine
from prediction.search.recall import Remember, ask
from prediction.search.weight_interval import PARTS, Profile, WeightInterval, weight_interval
from prediction.search.weight_search import NullSpaceTargets, Optimizer, scaled_correlation

Array = NDArray[np.float64]

#: Most samples the exact likelihood is taken on; neighbours in time beyond that are left out.
MAX_SAMPLES = 900


@dataclass(frozen=True, slots=True)
class MiNsGp(Predictor):
    """The operator's law with a posture-dependent preference: W from data, y a Gaussian process.

    W and the kernel are found by `search_law`; the process is then conditioned on the
    demonstrations. Use `CovIk` when demonstrations are few, or another motion must be predicted
    from them.

    Attributes:
        law: W, kernel and axes.
        process: The process of y, rad/s.
        scale: Calibration of the variance.
        degrees: Degrees of freedom of y about its mean: a t if finite, of the same covariance.
        interval: What the demonstrations leave open of W; None if it was not asked for.

    Source: Vianello et al. 2021, section V, with the marginal likelihood in place of the likelihood
    of the training set (which does not identify W), a full S in place of k independent processes,
    and an axis choice that does not flip.
    """

    name: ClassVar[str] = "mi-nsgp"
    #: Which W, where `fit` is not told.
    default_weights: ClassVar[WeightKind] = "diagonal"

    fits_tails: ClassVar[bool] = True

    law: Law
    process: Process
    scale: float
    degrees: float = np.inf
    interval: WeightInterval | None = None

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
        weights: WeightKind | None = None,
        max_evaluations: int = 3000,
        max_samples: int = MAX_SAMPLES,
        start: Law | None = None,
        remember: Remember = ask,
    ) -> Self:
        """Fits W and the process.

        Args:
            demonstrations: Learned joints only; see `find_reduction`.
            rng: Randomness of the search.
            progress: Told the log likelihood a sample.
            should_stop: Asked often; see `TrainingCancelledError`.
            kernel: ``separate``, or the paper's single length-scale.
            optimizer: ``bipop`` (the paper's), or ``gradient``: the nearest optimum, in fewer
                evaluations.
            engine: ``fast``, or ``gpytorch`` as the slow reference.
            criterion: ``marginal`` likelihood; ``held-out``: the density of contiguous parts given
                the rest, for motion whose samples repeat their neighbours;
                ``leave-one-trajectory-out``: the same, each demonstration a part; ``in-sample``:
                the paper's, for reproduction only, see `prediction.search.in_sample`.
            weights: ``diagonal`` W as in the paper; ``correlated``: W has the correlations of the
                demonstrated joint velocities and its diagonal is searched from theirs, where it is
                `CovIk`'s; ``auto``: both, and the criterion decides; ``identity``: none learned.
            max_evaluations: Budget of candidates W over all rounds.
            max_samples: Samples kept for the likelihood.
            start: A law of the same joints to set out from; see `search_law`.
            remember: Answers what is costly; see `search_law`.

        Returns:
            The fitted predictor.

        Raises:
            DemonstrationError: Too few samples.
            TrainingCancelledError: ``should_stop`` said so.
            UnsupportedMethodError: An option is not known.
        """
        kind = weights or cls.default_weights
        options = SearchOptions(kernel, optimizer, engine, criterion, kind, max_evaluations)
        kept = demonstrations.thinned(max_samples)
        law = search_law(
            kept,
            rng,
            options,
            start=start,
            remember=remember,
            progress=progress,
            should_stop=should_stop,
        )
        return cls._conditioned(kept, law)

    @classmethod
    def _conditioned(cls, demonstrations: Demonstrations, law: Law) -> Self:
        targets = NullSpaceTargets(demonstrations, law.basis, law.correlation)
        process = Process.conditioned(
            law.scaling,
            law.theta,
            demonstrations.q,
            demonstrations.xdot,
            targets.one(law.log_weights),
            constant_mean=law.constant_mean,
        )
        return cls(law, process, 1.0)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know of how W was found."""
        return self.law.notes

    @property
    def ninety(self) -> float:
        """A t's, if it has tails."""
        return ninety(self.degrees)

    @property
    def basis(self) -> NullSpaceBasis:
        """The null-space axes."""
        return self.law.basis

    @property
    def log_weights(self) -> Array:
        """Log of the diagonal of W, mean zero, ``(n,)``."""
        return self.law.log_weights

    @property
    def weights(self) -> Array:
        """The learned W; the geometric mean of its diagonal is one."""
        return scaled_correlation(self.law.log_weights, self.law.correlation)

    def null_mean(self, q: Array, xdot: Array, frame: NullSpaceFrame) -> Array:
        """The mean of the process."""
        return self.process.mean(q, xdot)

    def null_covariance(
        self, q: Array, xdot: Array, frame: NullSpaceFrame, jacobian: Array
    ) -> Array:
        """Noise and what the demonstrations leave open, in the proportions S."""
        variance = self.process.variance(q, xdot)[..., None, None]
        return np.asarray(self.scale * variance * self.process.output_covariance)

    def null_log_density(self, residual: Array, covariance: Array) -> Array:
        """Gaussian, or the t's."""
        if np.isinf(self.degrees):
            return gaussian_log_density(residual, covariance)
        return student_t_log_density(residual, covariance, self.degrees)

    def rescaled(self, factor: float) -> Self:
        """Multiplies the variance."""
        return replace(self, scale=self.scale * factor)

    def with_tails(self, degrees: float) -> Self:
        """Sets the degrees of freedom."""
        return replace(self, degrees=degrees)

    def refitted(self, demonstrations: Demonstrations) -> Self:
        """Conditions the process on other demonstrations; W and the kernel stay."""
        return self._conditioned(demonstrations.thinned(MAX_SAMPLES), self.law)

    def with_interval(self, demonstrations: Demonstrations, criterion: Criterion) -> Self:
        """Measures what the demonstrations it was fitted on leave open of W.

        Args:
            demonstrations: Those of `fit`.
            criterion: That of `fit`. The paper's in-sample score has no interval: it does not
                identify W.
        """
        if criterion == "in-sample":
            return self
        kept = demonstrations.thinned(MAX_SAMPLES)
        law, options = self.law, SearchOptions(self.process.scaling.kind, criterion=criterion)
        engine, _ = criterion_engine(options, law.scaling, kept)
        assert isinstance(engine, FastEngine)
        targets = NullSpaceTargets(kept, law.basis, law.correlation)
        profile = Profile(engine.residual_map(law.theta), targets)
        found = weight_interval(profile, law.log_weights, kept.blocks(PARTS))
        return replace(self, interval=found)

    def to_arrays(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Everything but the training data."""
        law = self.law
        arrays, values = self.process.to_arrays()
        arrays |= {"log_weights": law.log_weights, "rows": law.basis.rows, "null": law.basis.null}
        if law.correlation is not None:
            arrays["correlation"] = law.correlation
        if self.interval is not None:
            arrays |= self.interval.to_arrays()
        values |= {
            "constant_mean": law.constant_mean,
            "scale": self.scale,
            "degrees": None if np.isinf(self.degrees) else self.degrees,
            "score": law.score,
            "evaluations": law.evaluations,
            "notes": list(law.notes),
        }
        return arrays, values

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array], values: Mapping[str, Any]) -> Self:
        """Rebuilds."""
        process = Process.from_arrays(arrays, values)
        law = Law(
            basis=NullSpaceBasis(arrays["rows"], arrays["null"]),
            scaling=process.scaling,
            log_weights=arrays["log_weights"],
            correlation=arrays.get("correlation"),
            theta=process.theta,
            constant_mean=bool(values["constant_mean"]),
            score=float(values["score"]),
            evaluations=int(values["evaluations"]),
            notes=tuple(map(str, values.get("notes", ()))),
        )
        degrees = values.get("degrees")
        return cls(
            law,
            process,
            float(values["scale"]),
            np.inf if degrees is None else float(degrees),
            WeightInterval.from_arrays(arrays),
        )


class NsGp(MiNsGp):
    """The same process in the null space with all joints alike: the paper's ablation without W.

    Source: NsGP of Vianello et al. 2021, section VI.
    """

    name: ClassVar[str] = "nsgp"
    default_weights: ClassVar[WeightKind] = "identity"
