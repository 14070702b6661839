"""Search for the law of MI-NsGP: the weights W and the kernel."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from prediction.demonstrations import Demonstrations
from prediction.errors import DemonstrationError, UnsupportedMethodError
from prediction.laws.cov_ik import shrunk_moment
from prediction.laws.kernels import KERNELS, InputScaling, KernelKind
from prediction.laws.null_space import NullSpaceBasis
from prediction.laws.predictor import Progress, ShouldStop, check_stop
from prediction.search.held_out_likelihood import HeldOutEngine
from prediction.search.in_sample import InSampleEngine
from prediction.search.marginal_likelihood import (
    OUT_OF_REACH,
    FastEngine,
    LikelihoodEngine,
    optimise_kernel,
    theta_bounds,
)
from prediction.search.recall import Remember, ask
from prediction.search.weight_search import (
    LOG_WEIGHT_BOUND,
    OPTIMIZERS,
    NullSpaceTargets,
    Optimizer,
    WeightSearch,
    search_bipop,
)

Array = NDArray[np.float64]

EngineName = Literal["fast", "gpytorch"]
ENGINES: tuple[EngineName, ...] = ("fast", "gpytorch")
#: ``marginal`` likelihood; the density of parts ``held-out`` in turn, or of each demonstration as a
#: whole (``leave-one-trajectory-out``), for autocorrelated motion; ``in-sample``: the paper's
#: score, which does not identify W, for reproduction only.
Criterion = Literal["marginal", "held-out", "leave-one-trajectory-out", "in-sample"]
CRITERIA: tuple[Criterion, ...] = (
    "marginal",
    "held-out",
    "leave-one-trajectory-out",
    "in-sample",
)
#: ``diagonal`` W as in the paper; ``correlated``: joint correlations from the demonstrations;
#: ``auto``: whichever of the two the criterion prefers; ``identity``: all joints alike, no search.
WeightKind = Literal["diagonal", "correlated", "auto", "identity"]
WEIGHTS: tuple[WeightKind, ...] = ("diagonal", "correlated", "auto", "identity")
#: Contiguous parts of the held-out criterion.
HELD_OUT_PARTS = 8
#: Fewest demonstrations of which one can be left out.
LEAST_TAKES = 3
#: Most alternations of BIPOP and kernel.
ROUNDS = 6
#: Gain in log likelihood a sample below which a search ends, nats.
ROUND_TOLERANCE = 1e-5
#: Samples the first kernel is looked for on, from each of these (log length, log noise ratio).
START_SAMPLES = 300
#: Samples the climb goes on with before it takes all: an evaluation costs their number cubed.
MORE_SAMPLES = (900,)
STARTS = ((0.0, -2.3), (1.5, -2.3), (1.0, -6.0))

#: Relative gain of a step at which a climb ends: on some of the samples, and on all.
ROUGH, FINE = 1e-6, 1e-9

#: What is said of a law found by the paper's own score.
IN_SAMPLE_WARNING = (
    "the weights were searched by the likelihood of the training set itself, as in the paper: "
    "it does not identify them; use another criterion for anything but reproduction"
)


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
        if self.criterion != "marginal" and self.engine != "fast":
            raise UnsupportedMethodError(
                f"criterion of engine {self.engine}", self.criterion, ("marginal",)
            )
        if self.criterion == "in-sample" and self.optimizer != "bipop":
            # Kernel and W climb different scores: there is no one slope to follow.
            raise UnsupportedMethodError(
                f"optimizer of criterion {self.criterion}", self.optimizer, ("bipop",)
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
        score: Criterion reached, nats a sample.
        evaluations: Candidates W scored.
        notes: What a user should know of how it was found.
    """

    basis: NullSpaceBasis
    scaling: InputScaling
    log_weights: Array
    correlation: Array | None
    theta: Array
    constant_mean: bool
    score: float
    evaluations: int
    notes: tuple[str, ...] = ()


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
    """Maximises the criterion over log W and the kernel.

    The gradient climbs both at once, first on few samples from several kernels. BIPOP searches W
    under one kernel, which is fitted anew to the best W as it goes, until neither gains.

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
        DemonstrationError: Too few samples, or too few demonstrations to leave one out.
        TrainingCancelledError: ``should_stop`` said so.
    """
    demonstrations.check_enough()
    if options.weights == "auto":
        laws = []
        kinds: tuple[WeightKind, ...] = ("correlated", "diagonal")
        for number, kind in enumerate(kinds):
            # both start from the same state, so that neither depends on the other's search
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
        best = max(laws, key=lambda law: law.score)
        return replace(best, evaluations=sum(law.evaluations for law in laws))
    check_stop(should_stop)
    correlation, weights = None, np.zeros(demonstrations.q.shape[1])
    if options.weights == "correlated":
        weights, correlation = demonstrated_weights(demonstrations)
    if start is not None and (start.correlation is None) != (correlation is None):
        start = None
    if start is not None:
        weights = start.log_weights
    search = _Search(demonstrations, options, correlation, remember, progress, should_stop)
    few = search.on(demonstrations.thinned(START_SAMPLES))
    theta = remember(lambda: few.first_kernel(weights))
    if start is not None:
        theta = max((theta, start.theta), key=lambda kernel: search.score(weights, kernel))
    if options.weights == "identity":
        y = search.targets.one(weights)
        theta = remember(lambda: optimise_kernel(search.engine, theta, y, 60))
        return search.law(WeightSearch(weights, search.score(weights, theta), 0), theta)
    if options.optimizer == "gradient":
        used = 0
        if start is None:
            weights, theta, used = few.both(weights, theta)
            for more in MORE_SAMPLES:
                if more < len(demonstrations):
                    some = search.on(demonstrations.thinned(more))
                    found, theta = some.by_gradient(weights, theta, ROUGH)
                    weights, used = found.log_weights, used + found.evaluations
        found, theta = search.by_gradient(weights, theta)
        return search.law(replace(found, evaluations=used + found.evaluations), theta)
    return search.law(*search.by_bipop(weights, theta, rng, restarts=0 if start else 2))


class _Search:
    """One criterion on one set of demonstrations, as a function of log W and the kernel."""

    def __init__(
        self,
        demonstrations: Demonstrations,
        options: SearchOptions,
        correlation: Array | None,
        remember: Remember,
        progress: Progress | None,
        should_stop: ShouldStop | None,
        like: "_Search | None" = None,
    ) -> None:
        """Precomputes what depends on neither; axes and scaling may be those of another."""
        self.options, self.correlation = options, correlation
        self.remember, self.progress, self.should_stop = remember, progress, should_stop
        if like is None:
            q, xdot = demonstrations.q, demonstrations.xdot
            self.basis = NullSpaceBasis.around(demonstrations.jacobian)
            self.scaling = InputScaling.of(options.kernel, q, xdot, demonstrations.linear_rows)
        else:
            self.basis, self.scaling = like.basis, like.scaling
        self.targets = NullSpaceTargets(demonstrations, self.basis, correlation)
        self.engine, self.notes = criterion_engine(options, self.scaling, demonstrations)

    def on(self, demonstrations: Demonstrations) -> "_Search":
        """Returns the same on some of the samples, by the fast engine."""
        options = replace(self.options, engine="fast")
        return _Search(
            demonstrations, options, self.correlation, self.remember, None, self.should_stop, self
        )

    def law(self, found: WeightSearch, theta: Array) -> Law:
        """Returns what was found, with the rest of what makes a law.

        Raises:
            DemonstrationError: No W and kernel had a finite score.
        """
        if not found.score > 0.5 * OUT_OF_REACH:
            raise DemonstrationError(
                "no law has a finite likelihood: the null-space motion of the demonstrations does "
                "not span its directions; leave joints out that do not move on their own "
                "(find_reduction), or record more varied motion"
            )
        return Law(
            self.basis,
            self.scaling,
            found.log_weights,
            self.correlation,
            theta,
            self.options.criterion in ("marginal", "in-sample") and self.scaling.constant_mean,
            found.score,
            found.evaluations,
            self.notes,
        )

    def score(self, weights: Array, theta: Array) -> float:
        """Returns the log likelihood a sample."""
        return self.engine.log_likelihood(theta, self.targets.one(weights))

    def first_kernel(self, weights: Array) -> Array:
        """Looks for a kernel from several starts, so that a bad one is not kept."""
        y = self.targets.one(weights)
        found = []
        for length, noise in STARTS:
            theta = optimise_kernel(self.engine, self._theta(length, noise), y, 40)
            found.append((self.engine.log_likelihood(theta, y), theta))
        return max(found, key=lambda pair: pair[0])[1]

    def _theta(self, length: float, noise: float) -> Array:
        return np.array([length, length + 1.0, noise])[[*range(self.scaling.scales), -1]]

    def both(self, weights: Array, theta: Array) -> tuple[Array, Array, int]:
        """Returns W and kernel, climbed together from several kernels, and the evaluations."""
        size = len(weights)
        starts = [theta, *(self._theta(length, noise) for length, noise in STARTS)]

        def climb(kernel: Array) -> Array:
            found, at = self.by_gradient(weights, kernel, ROUGH)
            return np.concatenate([found.log_weights, at, [found.score, found.evaluations]])

        ends = [climb(kernel) for kernel in starts]
        best = max(ends, key=lambda end: end[-2])
        return best[:size], best[size:-2], int(sum(end[-1] for end in ends))

    def by_gradient(
        self, weights: Array, theta: Array, tolerance: float = FINE
    ) -> tuple[WeightSearch, Array]:
        """Climbs log W and theta together by L-BFGS with the exact slope.

        Derived here: mean and S are at their optimum for each W and kernel and add nothing to the
        slope; that by log W is the one by y pulled back, see `NullSpaceTargets.pull_back`.
        """
        size = len(weights)
        budget = self.options.max_evaluations
        bounds = [(-LOG_WEIGHT_BOUND, LOG_WEIGHT_BOUND)] * size
        bounds += theta_bounds(self.engine, len(theta))
        best, reached, asked = np.concatenate([weights, theta]), -np.inf, 0

        def evaluate(at: Array) -> Array:
            try:
                value, by_theta, by_y = self.engine.slopes(at[size:], self.targets.one(at[:size]))
            except np.linalg.LinAlgError:
                return np.append(OUT_OF_REACH, np.zeros_like(at))
            return np.concatenate([[value], self.targets.pull_back(at[:size], by_y), by_theta])

        def negative(at: Array) -> tuple[float, Array]:
            nonlocal best, reached, asked
            check_stop(self.should_stop)
            answer = self.remember(lambda: evaluate(at))
            asked += 1
            if answer[0] > reached:
                best, reached = at.copy(), float(answer[0])
            if self.progress is not None:
                self.progress("climbing to the joint weights", _share(asked), reached)
            return -float(answer[0]), -answer[1:]

        start = np.clip(best, *np.transpose(bounds))
        options = {"maxfun": budget, "maxiter": budget, "ftol": tolerance, "gtol": 1e-6}
        minimize(negative, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        found = best[:size] - best[:size].mean()
        return WeightSearch(found, reached, asked), best[size:]

    def by_bipop(
        self, weights: Array, theta: Array, rng: np.random.Generator, *, restarts: int
    ) -> tuple[WeightSearch, Array]:
        """Searches W by BIPOP-CMA-ES, the kernel following the best W."""
        budget = self.options.max_evaluations

        def fitted(log_weights: Array, iterations: int) -> Array:
            y, before = self.targets.one(log_weights), theta
            return self.remember(lambda: optimise_kernel(self.engine, before, y, iterations))

        def under(kernel: Array) -> Callable[[Array], Array]:
            scorer = self.engine.scorer(kernel)
            return lambda candidates: self.remember(
                lambda: scorer.scores(self.targets.many(candidates))
            )

        def refresh(log_weights: Array) -> Callable[[Array], Array]:
            nonlocal theta
            theta = fitted(log_weights, 10)
            return under(theta)

        theta = fitted(weights, 40)
        best, kernel, reached, used = weights, theta, -np.inf, 0
        for turn in range(ROUNDS):
            check_stop(self.should_stop)
            done = used / budget
            found = search_bipop(
                under(theta),
                best,
                rng,
                max_evaluations=budget - used,
                step=0.5 if turn == 0 and restarts else 0.1,
                restarts=restarts if turn == 0 else 0,
                refresh=refresh,
                progress=_scaled(self.progress, done, 1.0 - done),
                should_stop=self.should_stop,
            )
            used += found.evaluations
            theta = fitted(found.log_weights, 40)
            score = float(under(theta)(found.log_weights[None])[0])
            if self.progress is not None:
                self.progress("fitting the kernel", min(used / budget, 1.0), score)
            gain, settled = score - reached, abs(score - found.score) < ROUND_TOLERANCE
            if gain > 0.0:  # a random search with few candidates may end below where it began
                best, kernel, reached = found.log_weights, theta, score
            if settled or gain < ROUND_TOLERANCE or budget - used < 20:
                break
        return WeightSearch(best, reached, used), kernel


def _share(asked: int) -> float:
    """Returns a share done that grows with every evaluation: a climb does not know its end."""
    return asked / (asked + 20.0)


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


def criterion_engine(
    options: SearchOptions, scaling: InputScaling, demonstrations: Demonstrations
) -> tuple[LikelihoodEngine, tuple[str, ...]]:
    """Returns what scores, and what there is to say of it."""
    q, xdot = demonstrations.q, demonstrations.xdot
    takes = np.unique(demonstrations.trajectory_id)
    if options.criterion == "leave-one-trajectory-out":
        if len(takes) < LEAST_TAKES:
            raise DemonstrationError(
                f"criterion leave-one-trajectory-out leaves each of {len(takes)} demonstrations "
                f"out in turn: give at least {LEAST_TAKES}, or use held-out, which cuts them"
            )
        parts = [demonstrations.trajectory_id == take for take in takes]
        note = f"scored by {len(parts)} demonstrations, each predicted from the others"
        return HeldOutEngine(scaling, q, xdot, parts), (note,)
    if options.criterion == "held-out":
        parts = demonstrations.blocks(HELD_OUT_PARTS)
        whole = "whole demonstrations" if len(takes) >= HELD_OUT_PARTS else "stretches in time"
        note = f"scored by {len(parts)} parts ({whole}), each predicted from the others"
        return HeldOutEngine(scaling, q, xdot, parts), (note,)
    if options.criterion == "in-sample":
        return InSampleEngine(scaling, q, xdot), (IN_SAMPLE_WARNING,)
    if options.engine == "fast":
        return FastEngine(scaling, q, xdot), ()
    from prediction.search.gpytorch_engine import GpytorchEngine  # torch only when it is asked for

    return GpytorchEngine(scaling, q, xdot), ()
