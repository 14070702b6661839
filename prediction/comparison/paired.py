"""Methods side by side on many splits of one person's recordings, paired split by split."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from human.threads import single_threaded
from prediction.chain import Task, TaskChain
from prediction.comparison.evaluate import HORIZONS_S, MethodScore, score_method
from prediction.comparison.splits import Split
from prediction.errors import DemonstrationError, PredictionError
from prediction.laws.methods import AUTO, BASELINES
from prediction.laws.predictor import Progress, ShouldStop, check_stop
from prediction.training.train import train_operator
from prediction.training.training_options import TrainingOptions

Array = NDArray[np.float64]

#: What every method is compared with.
REFERENCE = "cov-ik"
#: The paper's own training, but for its score: isotropic kernel, diagonal W, BIPOP-CMA-ES.
PAPERS_WAY = TrainingOptions(
    method="mi-nsgp", criterion="marginal", weights="diagonal", kernel="paper", optimizer="bipop"
)
#: Least error a ratio is taken of, deg or rad/s: below, both are exact.
_LEAST = 1e-9


@dataclass(frozen=True, slots=True)
class SplitScores:
    """Scores of the methods on one split, or why there are none.

    Attributes:
        split: The split's design and name.
        scores: By method; empty where it could not be trained or tested.
        problem: Why it could not be.
    """

    split: tuple[str, str]
    scores: Mapping[str, MethodScore]
    problem: str | None = None


@dataclass(frozen=True, slots=True)
class PairedRow:
    """One method over the splits of a design.

    Intervals are 95 % intervals of the mean over splits (of the logarithm, for ratios), by
    Student's t. Splits of one recording share most of their training, so they are narrower than
    those of as many people would be.

    Attributes:
        method: Its name.
        splits: How many.
        nats: Mean held-out log density.
        nats_more: Median difference to the reference, nats.
        nats_wins: Splits with a greater density than the reference.
        nats_interval: Interval of the mean difference; None below three splits.
        rmse_ratio: Geometric mean of one-step error over the reference's.
        rmse_wins: Splits with a smaller one-step error.
        rmse_interval: Interval of that ratio.
        rollout_rmse_deg: Joint error at each horizon, geometric mean, deg, by seconds.
        rollout_ratio: The same over the reference's.
        rollout_interval: Interval of that ratio, by seconds.
        rollout_wins: Splits with a smaller error at the horizon than the reference's, and of how
            many, by seconds.
        coverage90: Mean coverage of the roll-out's 90 % band.
        width_deg: Mean width of that band.
        hand_m: Mean hand error of the sampled roll-outs.
    """

    method: str
    splits: int
    nats: float
    nats_more: float
    nats_wins: int
    nats_interval: tuple[float, float] | None
    rmse_ratio: float
    rmse_wins: int
    rmse_interval: tuple[float, float] | None
    rollout_rmse_deg: Mapping[str, float]
    rollout_ratio: Mapping[str, float]
    rollout_interval: Mapping[str, tuple[float, float] | None]
    rollout_wins: Mapping[str, tuple[int, int]]
    coverage90: float | None
    width_deg: float | None
    hand_m: float | None


@single_threaded
def compare_on_splits(
    chain: TaskChain,
    splits: Sequence[Split],
    methods: Sequence[str],
    *,
    seed: int,
    options: TrainingOptions | None = None,
    also: Mapping[str, TrainingOptions] | None = None,
    task: Task = "pose",
    samples: int = 50,
    progress: Progress | None = None,
    should_stop: ShouldStop | None = None,
) -> list[SplitScores]:
    """Trains every method on every split and scores it on what was held out.

    Args:
        chain: The chain.
        splits: From `splits_of`, `splits_by_primitive` or `splits_by_reach`.
        methods: Names, ``auto`` among them if its choice is to be scored; the reference and the
            other baseline are always there.
        seed: Seed of everything.
        options: How to train; method and tasks are set here.
        also: Further ways to train, by the label they get in the table, each with its method;
            `PAPERS_WAY` is one.
        task: Pose or position.
        samples: Sampled postures a stretch.
        progress: See `train_operator`.
        should_stop: See `train_operator`.

    Returns:
        One for each split. A split that cannot be trained on is named, and the rest still scored.

    Raises:
        TrainingCancelledError: ``should_stop`` said so.
    """
    base = TrainingOptions() if options is None else options
    also = {} if also is None else also
    # What auto chooses from need not be trained again: auto goes first.
    ways = {name: replace(base, method=name) for name in sorted(methods, key=AUTO.__ne__)}
    ways.update(also)
    results = []
    for number, split in enumerate(splits):
        scores: dict[str, MethodScore] = {}
        problem = None
        for k, (label, way) in enumerate(ways.items()):
            check_stop(should_stop)
            if label in scores:
                continue
            share = (number * len(ways) + k) / (len(splits) * len(ways))
            part = 1.0 / (len(splits) * len(ways))
            try:
                model = train_operator(
                    chain,
                    split.train,
                    seed=seed,
                    options=replace(way, tasks=(task,), baselines=not scores),
                    progress=_part_of(progress, f"{split.name}, {label}", share, part),
                    should_stop=should_stop,
                )
            except DemonstrationError as error:
                problem, scores = str(error), {}
                break
            # Another way to train a method does not go by the method's name; what is beside it may.
            beside = [name for name in model.method_names if label not in also or name in BASELINES]
            for name, trained in {**{one: one for one in beside}, label: model.method}.items():
                if name not in scores:
                    score = score_method(
                        model,
                        trained,
                        split.test,
                        np.random.default_rng([seed, 99]),
                        task=task,
                        chain=chain,
                        samples=samples,
                    )
                    scores[name] = replace(score, method=name)
        results.append(SplitScores((split.design, split.name), scores, problem))
    return results


def paired_table(results: Sequence[SplitScores], design: str) -> list[PairedRow]:
    """Returns the methods of one design, least closed-loop error at one second first.

    Raises:
        PredictionError: No split of the design was scored.
    """
    scored = [r.scores for r in results if r.split[0] == design and r.scores]
    if not scored:
        reasons = sorted({r.problem for r in results if r.split[0] == design and r.problem})
        raise PredictionError(f"design {design!r}: no split was scored: {'; '.join(reasons)}")
    common = [name for name in scored[0] if all(name in scores for scores in scored)]
    rows = [_row(name, scored) for name in common]

    def order(row: PairedRow) -> tuple[float, float]:
        return row.rollout_rmse_deg.get("1", np.inf), -row.nats

    return sorted(rows, key=order)


def _row(name: str, scored: Sequence[Mapping[str, MethodScore]]) -> PairedRow:
    pairs = [(scores[name], scores[REFERENCE]) for scores in scored]
    more = np.array([ours.log_likelihood - cov.log_likelihood for ours, cov in pairs])
    error, ratio, interval, wins = {}, {}, {}, {}
    for horizon in (f"{seconds:g}" for seconds in HORIZONS_S):
        at = np.array(
            [
                (ours.rollout_rmse_deg_at[horizon], cov.rollout_rmse_deg_at[horizon])
                for ours, cov in pairs
                if horizon in ours.rollout_rmse_deg_at
            ]
        )
        if len(at):
            logs = _log_ratio(at)
            error[horizon] = float(np.exp(np.log(np.maximum(at[:, 0], _LEAST)).mean()))
            ratio[horizon], interval[horizon] = _mean_ratio(logs)
            wins[horizon] = (int((at[:, 0] < at[:, 1]).sum()), len(at))
    rmse = np.array([(ours.rmse_rad_s, cov.rmse_rad_s) for ours, cov in pairs])
    rmse_ratio, rmse_interval = _mean_ratio(_log_ratio(rmse))
    return PairedRow(
        method=name,
        splits=len(pairs),
        nats=float(np.mean([ours.log_likelihood for ours, _ in pairs])),
        nats_more=float(np.median(more)),
        nats_wins=int((more > 0).sum()),
        nats_interval=_interval(more),
        rmse_ratio=rmse_ratio,
        rmse_wins=int((rmse[:, 0] < rmse[:, 1]).sum()),
        rmse_interval=rmse_interval,
        rollout_rmse_deg=error,
        rollout_ratio=ratio,
        rollout_interval=interval,
        rollout_wins=wins,
        coverage90=_mean_of([ours.coverage90_rollout for ours, _ in pairs]),
        width_deg=_mean_of([ours.band_width_deg for ours, _ in pairs]),
        hand_m=_mean_of([ours.rollout_hand_mean_m for ours, _ in pairs]),
    )


def _mean_of(values: Sequence[float | None]) -> float | None:
    there = [value for value in values if value is not None]
    return float(np.mean(there)) if there else None


def _log_ratio(pairs: Array) -> Array:
    """Returns the logarithm of the first over the second of each pair, ``(splits,)``."""
    first, second = np.maximum(pairs, _LEAST).T
    return np.asarray(np.log(first / second))


def _mean_ratio(logs: Array) -> tuple[float, tuple[float, float] | None]:
    """Returns the geometric mean of ratios and its interval."""
    between = _interval(logs)
    low_high = None if between is None else (float(np.exp(between[0])), float(np.exp(between[1])))
    return float(np.exp(logs.mean())), low_high


def _interval(values: Array) -> tuple[float, float] | None:
    """Returns the 95 % interval of the mean by Student's t, None for a value or two."""
    count = len(values)
    if count < 3:
        return None
    half = stdtrit(count - 1, 0.975) * values.std(ddof=1) / np.sqrt(count)
    return float(values.mean() - half), float(values.mean() + half)


def _part_of(progress: Progress | None, label: str, start: float, share: float) -> Progress | None:
    if progress is None:
        return None

    def tell(what: str, done: float, likelihood: float) -> None:
        progress(f"{label}: {what}", start + share * min(done, 1.0), likelihood)

    return tell
