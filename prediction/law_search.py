"""Search for the law of MI-NsGP: weights W and kernel, in turn, until neither gains."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from prediction.cov_ik import shrunk_moment
from prediction.demonstrations import Demonstrations
from prediction.errors import UnsupportedMethodError
from prediction.held_out_likelihood import HeldOutEngine
from prediction.kernels import KERNELS, InputScaling, KernelKind
from prediction.marginal_likelihood import FastEngine, LikelihoodEngine
from prediction.null_space import NullSpaceBasis
from prediction.predictor import Progress, ShouldStop, check_stop
from prediction.recall import Remember, ask
from prediction.weight_search import (
    OPTIMIZERS,
    NullSpaceTargets,
    Optimizer,
    WeightSearch,
    search_bipop,
    search_gradient,
)

Array = NDArray[np.float64]

EngineName = Literal["fast", "gpytorch"]
ENGINES: tuple[EngineName, ...] = ("fast", "gpytorch")
#: ``marginal`` likelihood, or the density of parts ``held-out`` in turn, for autocorrelated motion.
Criterion = Literal["marginal", "held-out"]
CRITERIA: tuple[Criterion, ...] = ("marginal", "held-out")
#: ``diagonal`` W as in the paper; ``correlated``: joint correlations from the demonstrations;
#: ``auto``: whichever of the two the criterion prefers; ``identity``: all joints alike, no search.
WeightKind = Literal["diagonal", "correlated", "auto", "identity"]
WEIGHTS: tuple[WeightKind, ...] = ("diagonal", "correlated", "auto", "identity")
#: Contiguous parts of the held-out criterion.
HELD_OUT_PARTS = 8
#: Alternations of weights and kernel.
ROUNDS = 6
#: Gain in log likelihood a sample below which alternation ends, nats.
ROUND_TOLERANCE = 1e-4
#: Samples the first kernel is looked for on, from each of these (log length, log noise ratio).
START_SAMPLES = 300
STARTS = ((0.0, -2.3), (1.5, -2.3), (1.0, -6.0))


@dataclass(frozen=True, slots=True)
class SearchOptions:
    """See `MiNsGp.fit`.

    Raises:
        UnsupportedMethodError: An option is not known, or the two do not go together.
    """

    kernel: KernelKind = "separate"
    optimizer: Optimizer = "bipop"
    engine: EngineName = "fast"
    criterion: Criterion = "marginal"
    weights: WeightKind = "diagonal"
    max_evaluations: int = 3000

    def __post_init__(self) -> None:
        """Refuses what is not known."""
        for kind, asked, known in (
            ("kernel", self.kernel, KERNELS),
            ("optimizer", self.optimizer, OPTIMIZERS),
            ("engine", self.engine, ENGINES),
            ("criterion", self.criterion, CRITERIA),
            ("weights", self.weights, WEIGHTS),
        ):
            if asked not in known:
                raise UnsupportedMethodError(kind, asked, known)
        if self.criterion == "held-out" and self.engine != "fast":
            raise UnsupportedMethodError(
                f"criterion of engine {self.engine}", self.criterion, ("marginal",)
            )


@dataclass(frozen=True, slots=True)
class Law:
    """What the search found; everything of MI-NsGP that is not conditioned on samples.

    Attributes:
        basis: Null-space axes.
        scaling: Input scaling.
        log_weights: Log of the diagonal of W, mean zero, ``(n,)``.
        correlation: Correlation of the joints in W, ``(n, n)``; None if W is diagonal.
        theta: Log length-scales and log noise ratio.
        constant_mean: Whether y has a constant mean, or none.
        score: Log likelihood a sample reached, nats.
        evaluations: Candidates W scored.
    """

    basis: NullSpaceBasis
    scaling: InputScaling
    log_weights: Array
    correlation: Array | None
    theta: Array
    constant_mean: bool
    score: float
    evaluations: int


def search_law(
    demonstrations: Demonstrations,
    rng: np.random.Generator,
    options: SearchOptions,
    *,
    start: Law | None = None,
    remember: Remember = ask,
    progress: Progress | None = None,
    should_stop: ShouldStop | None = None,
) -> Law:
    """Maximises the criterion over log W and the kernel, one after the other.

    For a given kernel W is searched with output covariance (and, for the marginal likelihood, mean
    and noise ratio) at their optimum; for a given W the kernel is searched. Both only ever gain.

    Args:
        demonstrations: Learned joints only.
        rng: Randomness of BIPOP.
        options: How.
        start: A law of the same joints and kernel from which the search sets out; where its W is
            of the other kind it is of no use.
        remember: Answers what is costly, in the same order each time; see `Recall`.
        progress: Told the log likelihood a sample.
        should_stop: Asked often.

    Returns:
        The law.

    Raises:
        DemonstrationError: Too few samples.
        TrainingCancelledError: ``should_stop`` said so.
    """
    if options.weights == "auto":
        # Both score the same coordinates, and W moves them without changing volume.
        kinds: tuple[WeightKind, ...] = ("diagonal", "correlated")
        laws = []
        for number, kind in enumerate(kinds):
            laws.append(
                search_law(
                    demonstrations,
                    rng,
                    replace(options, weights=kind),
                    start=start,
                    remember=remember,
                    progress=_scaled(progress, number / 2, 0.5),
                    should_stop=should_stop,
                )
            )
        return max(laws, key=lambda law: law.score)
    demonstrations.check_enough()
    check_stop(should_stop)
    basis = NullSpaceBasis.around(demonstrations.jacobian)
    scaling = InputScaling.of(
        options.kernel, demonstrations.q, demonstrations.xdot, demonstrations.linear_rows
    )
    correlation, first_weights = None, np.zeros(demonstrations.q.shape[1])
    if options.weights == "correlated":
        first_weights, correlation = demonstrated_weights(demonstrations)
    if start is not None and (start.correlation is None) != (correlation is None):
        start = None
    if start is not None:
        first_weights = start.log_weights
    targets = NullSpaceTargets(demonstrations, basis, correlation)
    likelihood = _engine(options, scaling, demonstrations)
    theta = remember(
        lambda: _first_kernel(options, scaling, basis, correlation, demonstrations, first_weights)
    )
    y = targets.one(first_weights)
    if start is not None:
        known = (theta, start.theta)
        theta = max(known, key=lambda kernel: likelihood.log_likelihood(kernel, y))
    sought = theta
    theta = remember(lambda: likelihood.optimise(sought, y, 30))
    search = WeightSearch(first_weights, -np.inf, 0)
    used = 0
    if options.weights == "identity":
        theta = likelihood.optimise(theta, y, 60)
        search = WeightSearch(first_weights, likelihood.log_likelihood(theta, y), 0)
    for turn in range(0 if options.weights == "identity" else ROUNDS):
        check_stop(should_stop)
        budget = max((options.max_evaluations - used) // 2, 20)
        done, share = used / options.max_evaluations, budget / options.max_evaluations
        found = _search_weights(
            likelihood,
            targets,
            theta,
            search.log_weights,
            options.optimizer,
            rng,
            budget,
            first=turn == 0 and start is None,
            remember=remember,
            progress=_scaled(progress, done, share),
            should_stop=should_stop,
        )
        used += found.evaluations
        y = targets.one(found.log_weights)
        kernel = remember(partial(likelihood.optimise, theta, y, 40))
        found = replace(found, score=likelihood.log_likelihood(kernel, y))
        if progress is not None:
            progress("fitting the kernel", min(used / options.max_evaluations, 1.0), found.score)
        gain = found.score - search.score
        if gain > 0.0:  # a random search with few candidates may end below where it began
            search, theta = found, kernel
        if gain < ROUND_TOLERANCE or used >= options.max_evaluations:
            break
    return Law(
        basis,
        scaling,
        search.log_weights,
        correlation,
        theta,
        options.criterion == "marginal",
        search.score,
        used,
    )


def _scaled(progress: Progress | None, start: float, share: float) -> Progress | None:
    """Returns progress that fills a share of the whole, from ``start``."""
    if progress is None:
        return None

    def tell(what: str, done: float, likelihood: float) -> None:
        progress(what, min(start + share * done, 1.0), likelihood)

    return tell


def demonstrated_weights(demonstrations: Demonstrations) -> tuple[Array, Array]:
    """Returns log scale (mean zero) and correlation of demonstrated rates, shrunk."""
    moment = shrunk_moment(demonstrations.qdot)
    variance = np.diagonal(moment)
    log_variance = np.log(variance)
    root = np.sqrt(variance)
    return log_variance - log_variance.mean(), moment / (root[:, None] * root)


def _search_weights(
    likelihood: LikelihoodEngine,
    targets: NullSpaceTargets,
    theta: Array,
    start: Array,
    optimizer: Optimizer,
    rng: np.random.Generator,
    budget: int,
    *,
    first: bool,
    remember: Remember,
    progress: Progress | None,
    should_stop: ShouldStop | None,
) -> WeightSearch:
    scorer = likelihood.scorer(theta)

    def score(log_weights: Array) -> Array:
        return remember(lambda: scorer.scores(targets.many(log_weights)))

    def score_and_slope(log_weights: Array) -> tuple[float, Array]:
        value, slope = scorer.score_and_slope(targets.one(log_weights))
        return value, targets.pull_back(log_weights, slope)

    if optimizer == "gradient":
        return search_gradient(
            score_and_slope, start, max_evaluations=budget, should_stop=should_stop
        )
    return search_bipop(
        score,
        start,
        rng,
        max_evaluations=budget,
        step=0.5 if first else 0.1,
        restarts=2 if first else 0,
        progress=progress,
        should_stop=should_stop,
    )


def _first_kernel(
    options: SearchOptions,
    scaling: InputScaling,
    basis: NullSpaceBasis,
    correlation: Array | None,
    demonstrations: Demonstrations,
    log_weights: Array,
) -> Array:
    """Looks for the kernel on a few samples from several starts, so that a bad one is not kept."""
    few = demonstrations.thinned(START_SAMPLES)
    y = NullSpaceTargets(few, basis, correlation).one(log_weights)
    engine = _engine(replace(options, engine="fast"), scaling, few)
    found = []
    for length, noise in STARTS:
        lengths = [length] if scaling.scales == 1 else [length, length + 1.0]
        theta = engine.optimise(np.array([*lengths, noise]), y, 40)
        found.append((engine.log_likelihood(theta, y), theta))
    return max(found, key=lambda pair: pair[0])[1]


def _engine(
    options: SearchOptions, scaling: InputScaling, demonstrations: Demonstrations
) -> LikelihoodEngine:
    q, xdot = demonstrations.q, demonstrations.xdot
    if options.criterion == "held-out":
        return HeldOutEngine(scaling, q, xdot, demonstrations.blocks(HELD_OUT_PARTS))
    if options.engine == "fast":
        return FastEngine(scaling, q, xdot)
    from prediction.gpytorch_engine import GpytorchEngine  # torch only when it is asked for

    return GpytorchEngine(scaling, q, xdot)
