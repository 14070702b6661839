"""Methods side by side on many splits of one person's recordings, paired split by split."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from human.threads import single_threaded
from prediction.chain import Task, TaskChain
from prediction.demonstrations import Demonstrations, join
from prediction.errors import DemonstrationError, PredictionError
from prediction.evaluate import HORIZONS_S, MethodScore, score_method
from prediction.predictor import Progress, ShouldStop, check_stop
from prediction.train import train_operator
from prediction.training_options import TrainingOptions

#: What every method is compared with.
REFERENCE = "cov-ik"
#: Contiguous parts of the design ``part``.
PARTS = 4


@dataclass(frozen=True, slots=True)
class Split:
    """What is trained on and what is tested on.

    Attributes:
        design: ``part``: a contiguous part of all recordings is held out, so the same motion was
            mostly seen. ``recording``: a whole recording is held out, so it may be another motion.
        name: Which part or recording is held out.
        train: Demonstrations.
        test: Held-out demonstrations.
    """

    design: str
    name: str
    train: Demonstrations
    test: Demonstrations


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

    Attributes:
        method: Its name.
        splits: How many.
        nats: Mean held-out log density.
        nats_more: Median difference to the reference, nats.
        nats_wins: Splits with a greater density than the reference.
        rmse_ratio: Geometric mean of one-step error over the reference's.
        rollout_rmse_deg: Joint error at each horizon, geometric mean, deg, by seconds.
        rollout_ratio: The same over the reference's.
        rollout_wins: Splits with a smaller error at the horizon than the reference's, and of how
            many, by seconds.
        coverage90: Mean coverage of the roll-out's 90 % band.
        width_deg: Mean width of that band.
    """

    method: str
    splits: int
    nats: float
    nats_more: float
    nats_wins: int
    rmse_ratio: float
    rollout_rmse_deg: Mapping[str, float]
    rollout_ratio: Mapping[str, float]
    rollout_wins: Mapping[str, tuple[int, int]]
    coverage90: float | None
    width_deg: float | None


def splits_of(takes: Sequence[tuple[str, Demonstrations]], parts: int = PARTS) -> list[Split]:
    """Cuts recordings of one person into what is trained on and what is held out.

    Args:
        takes: Name and demonstrations of each recording.
        parts: Contiguous parts of the design ``part``.

    Returns:
        Each part of all recordings held out in turn, then each recording if there are several.

    Raises:
        DemonstrationError: No recordings.
    """
    whole = join([take for _, take in takes])
    out = []
    for number, block in enumerate(whole.blocks(parts)):
        if not block.all():
            name = f"part {number + 1} of {parts}"
            out.append(Split("part", name, whole.take(~block), whole.take(block)))
    if len(takes) > 1:
        for number, (name, take) in enumerate(takes):
            others = [other for k, (_, other) in enumerate(takes) if k != number]
            out.append(Split("recording", name, join(others), take))
    return out


@single_threaded
def compare_on_splits(
    chain: TaskChain,
    splits: Sequence[Split],
    methods: Sequence[str],
    *,
    seed: int,
    options: TrainingOptions | None = None,
    task: Task = "pose",
    samples: int = 50,
    progress: Progress | None = None,
    should_stop: ShouldStop | None = None,
) -> list[SplitScores]:
    """Trains every method on every split and scores it on what was held out.

    Args:
        chain: The chain.
        splits: From `splits_of`.
        methods: Names, ``auto`` among them if its choice is to be scored; the reference and the
            other baseline are always there.
        seed: Seed of everything.
        options: How to train; method and tasks are set here.
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
    jobs = [(split, name) for split in splits for name in methods]
    found: dict[int, dict[str, MethodScore]] = {id(split): {} for split in splits}
    problems: dict[int, str] = {}
    for number, (split, name) in enumerate(jobs):
        check_stop(should_stop)
        if id(split) in problems:
            continue
        try:
            model = train_operator(
                chain,
                split.train,
                seed=seed,
                options=replace(base, method=name, tasks=(task,)),
                progress=_part_of(progress, f"{split.name}, {name}", number, len(jobs)),
                should_stop=should_stop,
            )
            scores = found[id(split)]
            chosen = {name: model.method} if name == "auto" else {name: name}
            for label, trained in {**{m: m for m in model.method_names}, **chosen}.items():
                if label not in scores:
                    score = score_method(
                        model,
                        trained,
                        split.test,
                        np.random.default_rng([seed, 99]),
                        task=task,
                        chain=chain,
                        samples=samples,
                    )
                    scores[label] = replace(score, method=label)
        except DemonstrationError as error:
            problems[id(split)] = str(error)
    return [
        SplitScores(
            (split.design, split.name),
            {} if id(split) in problems else found[id(split)],
            problems.get(id(split)),
        )
        for split in splits
    ]


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
    error, ratio, wins = {}, {}, {}
    for horizon in (f"{seconds:g}" for seconds in HORIZONS_S):
        at = np.array(
            [
                (ours.rollout_rmse_deg_at[horizon], cov.rollout_rmse_deg_at[horizon])
                for ours, cov in pairs
                if horizon in ours.rollout_rmse_deg_at
            ]
        )
        if len(at):
            at = np.maximum(at, 1e-9)
            error[horizon] = float(np.exp(np.log(at[:, 0]).mean()))
            ratio[horizon] = float(np.exp(np.log(at[:, 0] / at[:, 1]).mean()))
            wins[horizon] = (int((at[:, 0] < at[:, 1]).sum()), len(at))
    covered = [ours.coverage90_rollout for ours, _ in pairs if ours.coverage90_rollout is not None]
    width = [ours.band_width_deg for ours, _ in pairs if ours.band_width_deg is not None]
    rmse = [np.log(ours.rmse_rad_s / cov.rmse_rad_s) for ours, cov in pairs]
    return PairedRow(
        method=name,
        splits=len(pairs),
        nats=float(np.mean([ours.log_likelihood for ours, _ in pairs])),
        nats_more=float(np.median(more)),
        nats_wins=int((more > 0).sum()),
        rmse_ratio=float(np.exp(np.mean(rmse))),
        rollout_rmse_deg=error,
        rollout_ratio=ratio,
        rollout_wins=wins,
        coverage90=float(np.mean(covered)) if covered else None,
        width_deg=float(np.mean(width)) if width else None,
    )


def _part_of(progress: Progress | None, label: str, number: int, count: int) -> Progress | None:
    if progress is None:
        return None

    def tell(what: str, done: float, likelihood: float) -> None:
        progress(f"{label}: {what}", (number + min(done, 1.0)) / count, likelihood)

    return tell
