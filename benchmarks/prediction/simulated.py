"""Simulated operators of several kinds: the same motion and other motion, every method.

Run ``python -m benchmarks.prediction.simulated [--full] [--seeds 21 ...]``.

EXP1, the same motion: people are led by the hand along four ways, four times each; one time of each
way is held out, at its turn (interleaved) or the last (later). EXP2, other motion: trained on led
takes, tested on free reaching. Each person is one split of each. All methods are paired split by
split with Cov-IK; "the law itself" is what the simulator does, without the course of the noise.
What the posture tells of noise that lasts may make a method a little better one step ahead. Rows
marked "+ step before" are told the joint velocity of the step before.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from benchmarks.figure import Figure, shown
from benchmarks.prediction.simulated_operators import Person, with_true_law
from human.simulate import OPERATOR_KINDS
from prediction import (
    PAPERS_WAY,
    Demonstrations,
    MethodScore,
    OperatorModel,
    TrainingOptions,
    score_method,
    train_operator,
)
from prediction.training.held_out import Stretches, run_held_out, sampled_interval

#: People reported; methods were developed on seeds below 20.
SEEDS = (21,)
REFERENCE, LAW, PAPER, BEFORE = "cov-ik", "the law itself", "the paper's way", " + step before"
HORIZONS = ("0.25", "0.5", "1", "2")
SAMPLES = 50
TRAINING = TrainingOptions(method="auto", tasks=("pose",), optimizer="gradient")


@dataclass(frozen=True, slots=True)
class Tested:
    """One split.

    Attributes:
        design: ``EXP1 interleaved``, ``EXP1 later`` or ``EXP2``.
        who: The person.
        scores: By row of the table.
        white: Coverage of the bands of ``auto`` if every step were drawn on its own.
    """

    design: str
    who: str
    scores: Mapping[str, MethodScore]
    white: float


def tested(kind: str, seed: int, *, later: bool) -> Iterator[Tested]:
    """Trains on a person's led takes and yields the splits these are the training of."""
    person, who = _person(kind, seed), f"{kind} {seed}"
    if later:
        train, test = person.later()
        yield _scored("EXP1 later", who, _trained(person, train), test)
        return
    train, test = person.interleaved()
    models = _trained(person, train)
    yield _scored("EXP1 interleaved", who, models, test)
    yield _scored("EXP2", who, models, person.free)


@cache
def _person(kind: str, seed: int) -> Person:
    return Person.of(kind, seed)


def _trained(person: Person, train: Demonstrations) -> dict[str, OperatorModel]:
    ours = train_operator(person.chain, train, seed=1, options=TRAINING)
    way = replace(PAPERS_WAY, tasks=("pose",), optimizer="gradient", baselines=False)
    papers = train_operator(person.chain, train, seed=1, options=way)
    return {"auto": ours, PAPER: papers, LAW: with_true_law(ours, person, train)}


def _scored(
    design: str, who: str, models: Mapping[str, OperatorModel], test: Demonstrations
) -> Tested:
    scores: dict[str, MethodScore] = {}
    for label, model in models.items():
        names = model.method_names if label == "auto" else (model.method,)
        for name in names:
            score = score_method(model, name, test, np.random.default_rng(0), samples=SAMPLES)
            scores[name if label == "auto" else label] = score
        if label == "auto":
            scores["auto"] = scores[model.method]
    follower = models["auto"].follower()
    run = run_held_out(
        follower, test, Stretches.of(test), SAMPLES, np.random.default_rng(0), noise="white"
    )
    low, high = sampled_interval(run.run.q[:, 1:], axis=1)
    white = float(((run.truth >= low) & (run.truth <= high))[:, 1:].mean())
    print(
        f"{design:17}{who:16}auto: {models['auto'].method}, {models['auto'].training['chosen_by']}"
    )
    return Tested(design, who, scores, white)


def table(splits: Sequence[Tested]) -> str:
    """Returns every method over the splits of one design."""
    lines = [
        f"{splits[0].design}, {len(splits)} splits: joint error in closed loop, deg, geometric "
        "mean (over Cov-IK's; splits better), coverage and width of the 90 % band; one step: nats "
        "and error over Cov-IK's",
        f"{'':28}{'.25 s':>17}{'.5 s':>17}{'1 s':>17}{'2 s':>17}{'90 %':>6}{'deg':>6}"
        f"{'nats':>7}{'worst':>7}{'x rmse':>8}{'90 %':>6}",
    ]
    for name in splits[0].scores:
        ours = [split.scores[name] for split in splits]
        cov = [split.scores[REFERENCE] for split in splits]
        cells = [_closed_loop(ours, cov, horizon) for horizon in HORIZONS]
        inside = np.mean([score.coverage90_rollout for score in ours])
        width = np.mean([score.band_width_deg for score in ours])
        lines.append(
            f"{name:28}{''.join(cells)}{inside:6.2f}{width:6.1f}{_one_step(ours, cov, told=False)}"
        )
        if name in ("auto", REFERENCE, LAW):
            lines.append(f"{name + BEFORE:28}{'':80}{_one_step(ours, cov, told=True)}")
    return "\n".join(lines)


def _closed_loop(ours: Sequence[MethodScore], cov: Sequence[MethodScore], horizon: str) -> str:
    error = np.array([score.rollout_rmse_deg_at[horizon] for score in ours])
    ratio = error / [score.rollout_rmse_deg_at[horizon] for score in cov]
    mean, relative = np.exp(np.log(error).mean()), np.exp(np.log(ratio).mean())
    return f"{mean:6.2f} x{relative:4.2f} {int((ratio < 1).sum()):3d} "


def _one_step(ours: Sequence[MethodScore], cov: Sequence[MethodScore], *, told: bool) -> str:
    nats, ratio = gains(ours, cov, told=told)
    inside = np.mean([_of(score, "coverage90_one_step", told=told) for score in ours])
    return f"{nats.mean():+7.1f}{nats.min():+7.1f}   x{_mean_ratio(ratio):4.2f}{inside:6.2f}"


def gains(
    ours: Sequence[MethodScore], theirs: Sequence[MethodScore], *, told: bool, both: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Returns, by split, nats more and one-step error over that of others.

    Args:
        ours: Scores.
        theirs: Scores of another method on the same splits.
        told: Whether ours see the step before.
        both: Whether theirs do as well.
    """
    pairs = list(zip(ours, theirs, strict=True))
    nats = [
        _of(a, "log_likelihood", told=told) - _of(b, "log_likelihood", told=both) for a, b in pairs
    ]
    ratio = [_of(a, "rmse_rad_s", told=told) / _of(b, "rmse_rad_s", told=both) for a, b in pairs]
    return np.array(nats), np.array(ratio)


def _of(score: MethodScore, figure: str, *, told: bool) -> float:
    if not told:
        return float(getattr(score, figure))
    if score.with_previous is None:
        raise ValueError(f"{score.method} has no memory")
    return score.with_previous[figure]


def _mean_ratio(ratios: np.ndarray) -> float:
    return float(np.exp(np.log(ratios).mean()))


def judged(splits: Sequence[Tested], name: str, least: float, most: float) -> Iterator[Figure]:
    """Yields the figures of ``auto`` on one design beside its bars."""
    ours, cov, law, paper = (
        [split.scores[row] for split in splits] for row in ("auto", REFERENCE, LAW, PAPER)
    )
    floor_nats, floor_ratio = gains(law, cov, told=False)
    for told, sees in ((False, ""), (True, ", told the step before")):
        nats, ratio = gains(ours, cov, told=told)
        floor = f"the law itself {floor_nats.mean():+.1f}" if not told else ""
        yield Figure(
            f"{name}: one step, nats on Cov-IK{sees}", nats.mean(), "nats", least, beside=floor
        )
        yield Figure(f"{name}: the worst split's nats{sees}", nats.min(), "nats", least=0.0)
        floor = f"the law itself {_mean_ratio(floor_ratio):.2f}" if not told else ""
        yield Figure(
            f"{name}: one-step error over Cov-IK's{sees}", _mean_ratio(ratio), "", None, most, floor
        )
    nats, ratio = gains(ours, cov, told=True, both=True)
    yield Figure(f"{name}: nats on Cov-IK, both told the step before", nats.mean(), "nats")
    at_one = [[score.rollout_rmse_deg_at["1"] for score in row] for row in (ours, cov, law, paper)]
    ratios = [_mean_ratio(np.divide(row, at_one[1])) for row in at_one]
    yield Figure(
        f"{name}: roll-out error at 1 s over Cov-IK's",
        ratios[0],
        most=1.0,
        beside=f"the law itself {ratios[2]:.2f}, the paper's way {ratios[3]:.2f}",
    )


def figures(full: bool = False, seeds: Sequence[int] = SEEDS) -> Iterator[Figure]:
    """Yields the figures beside their bars; prints the tables on the way."""
    kinds = OPERATOR_KINDS if full else OPERATOR_KINDS[:2]
    splits = [
        split
        for later in ((False, True) if full else (False,))
        for seed in seeds
        for kind in kinds
        for split in tested(kind, seed, later=later)
    ]
    for design in dict.fromkeys(split.design for split in splits):
        print("\n" + table([split for split in splits if split.design == design]))
    print()
    same = [split for split in splits if split.design != "EXP2"]
    other = [split for split in splits if split.design == "EXP2"]
    yield from judged(same, "EXP1", 3.0, 0.80)
    yield from judged(other, "EXP2", 0.0, 0.95)
    for name, some in (("known", same), ("unfamiliar", other)):
        held = np.mean([split.scores["auto"].coverage90_rollout or 0.0 for split in some])
        width = np.mean([split.scores["auto"].band_width_deg or 0.0 for split in some])
        white = np.mean([split.white for split in some])
        yield Figure(
            f"posture in the 90 % band over 2 s, {name} motion",
            float(held),
            "",
            0.87,
            0.96,
            f"mean width {width:.1f} deg; white noise {white:.2f}",
        )


def main() -> int:
    """Prints the tables and the figures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--full", action="store_true", help="every kind and design")
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    options = parser.parse_args()
    return shown(figures(options.full, options.seeds))


if __name__ == "__main__":
    sys.exit(main())
