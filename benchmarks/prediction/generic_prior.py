"""How far people are from the least joint motion: makes and judges the prior of an unseen operator.

Run ``python -m benchmarks.prediction.generic_prior [RECORDINGS]``.

Without recordings, the prior that the package ships is judged on simulated operators, none of whom
made it. With the folder of real recordings the prior is made anew from the people in them, each
person is judged by a prior made of the others, and the table to ship is printed.
"""

import argparse
import json
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student_t

from app.takes import takes_of
from app.training import motions_of
from benchmarks.figure import Figure, shown
from human import Chain, Subject, generate_model
from human.simulate import OPERATOR_KINDS, operator, simulate_reaching
from prediction import (
    Demonstrations,
    Stretches,
    demonstrations_from_motion,
    generic_operator,
    join,
    run_held_out,
)
from prediction.following.posture_band import LENGTHS
from prediction.laws.student_t import NINETY
from prediction.training.generic_prior import GROUPS, joint_group, prior_table
from prediction.training.held_out import HeldOutRun

Array = NDArray[np.float64]
Table = dict[str, Any]

RATE_HZ, SAMPLES, STRETCHES = 30.0, 24, 12
METHODS = ("w-ik", "minimum-norm")
TASKS = ("pose", "position")
#: A joint slower than this over a whole recording was not measured in it, deg/s.
UNSEEN_DEG_S = 1.0
#: Recordings by person: files, stature, mass (assumed where the recording does not say), hands.
REAL: Mapping[str, tuple[tuple[str, ...], float, float, tuple[str, ...]]] = {
    "box, suit": (("xsens_bvh_box/MotionBox_XSens.bvh",), 1.70, 70.0, ("Right", "Left")),
    "arm swing, suit": (("xsens_mvnx/test_mocap.mvnx",), 1.70, 70.0, ("Left",)),
    "box, markers": (("pyomeca_arm_box/markers_analogs.c3d",), 1.75, 72.0, ("Right",)),
    "striking": (("cmu_c3d/cmu_02_05.c3d",), 1.75, 72.0, ("Right", "Left")),
    "squats, chair": (
        tuple(f"opencap_subject4/{f}.trc" for f in ("squats1", "STS1", "static1")),
        1.70,
        60.0,
        ("Right", "Left"),
    ),
    "gait": (
        tuple(f"rehazenter_gait/2014001_{f}.c3d" for f in ("C1_01", "ST")),
        1.75,
        65.0,
        ("Right", "Left"),
    ),
}


@dataclass(frozen=True, slots=True)
class Seen:
    """One hand of one person."""

    person: str
    chain: Chain
    motion: Demonstrations


def real_people(folder: Path) -> Iterator[Seen]:
    """Reads the recordings."""
    for person, (names, height, mass, hands) in REAL.items():
        static = ("static1", "_ST")
        files = [
            f"{'static:' if any(s in name for s in static) else ''}{folder / name}"
            for name in names
        ]
        recorded = motions_of(takes_of(files), Subject(height, mass))
        for hand in hands:
            chain = Chain(recorded.model, tip=f"{hand}HandCOM")
            takes = [
                demonstrations_from_motion(chain, motion, trajectory_id=k, rate_hz=RATE_HZ)
                for k, motion in enumerate(recorded.motions)
            ]
            yield Seen(person, chain, join(takes))


def simulated_people(seeds: Sequence[int]) -> Iterator[Seen]:
    """Draws operators of every kind, of other statures, led by either hand."""
    for seed in seeds:
        for kind in OPERATOR_KINDS:
            rng = np.random.default_rng([seed, OPERATOR_KINDS.index(kind)])
            model = generate_model(Subject(rng.uniform(1.55, 1.95), rng.uniform(50.0, 100.0)))
            hand = ("right", "left")[seed % 2]
            motion = simulate_reaching(
                model, operator(kind, rng, model), rng, movements=3, hand=hand, rate_hz=RATE_HZ
            ).motion
            chain = Chain(model, tip=f"{hand.capitalize()}HandCOM")
            yield Seen(kind, chain, demonstrations_from_motion(chain, motion, rate_hz=RATE_HZ))


def run(seen: Seen, table: Table, method: str, task: str, samples: int) -> HeldOutRun:
    """Rolls out an operator of which nothing is known along what this one did."""
    model = generic_operator(seen.chain, table=table)
    motion = seen.motion.for_task(task)
    stretches = Stretches.of(motion, at_most=STRETCHES)
    follower = model.follower(method, task)
    return run_held_out(follower, motion, stretches, samples, np.random.default_rng(0))


def by_group(names: Sequence[str], squares: Array) -> dict[tuple[str, int], float]:
    """Means over the joints of a group and axis."""
    found = defaultdict(list)
    for name, square in zip(names, squares, strict=True):
        found[joint_group(name)].append(float(square))
    return {place: float(np.mean(values)) for place, values in found.items()}


def over_people(values: Sequence[tuple[str, Mapping[tuple[str, int], float]]]) -> Table:
    """Roots of the means, every person counting once, as degrees by group and axis."""
    people: dict[tuple[str, int], dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for person, squares in values:
        for place, square in squares.items():
            people[place][person].append(square)
    return {
        group: [
            rounded(np.degrees(np.sqrt(np.mean([np.mean(v) for v in people[group, k].values()]))))
            for k in range(3)
        ]
        for group in GROUPS
    }


def rounded(value: float) -> float:
    """Two digits are more than six people can tell."""
    return float(f"{value:.2g}")


def rates(people: Sequence[Seen]) -> Table:
    """Root mean square joint velocity: the shape is each person's, the speed that of all."""
    speed, shapes = [], []
    for seen in people:
        moment = (seen.motion.qdot**2).mean(axis=0)
        speed.append(moment.sum())
        known = moment > np.deg2rad(UNSEEN_DEG_S) ** 2
        names = [n for n, there in zip(seen.chain.dof_names, known, strict=True) if there]
        shapes.append((seen.person, by_group(names, moment[known] / moment.sum())))
    common = over_people(shapes)
    scale = float(np.sqrt(np.mean(speed)))
    return {group: [rounded(scale * v) for v in axes] for group, axes in common.items()}


def made_of(people: Sequence[Seen]) -> Table:
    """Makes the table of a prior."""
    table: Table = {"rate_deg_s": rates(people)}
    flat = {group: [10.0] * 3 for group in GROUPS}
    for method in METHODS:
        table[method] = {task: {"deviation_deg": flat, "length_s": 1.0} for task in TASKS}
    for method in METHODS:
        for task in TASKS:
            runs = [run(seen, table, method, task, 0) for seen in people]
            length = most_likely_length(runs)
            squares = []
            for seen, held in zip(people, runs, strict=True):
                moved = held.run.travelled > 1e-3
                growth = -np.expm1(-2.0 * held.run.travelled[moved] / length)
                error = (held.error[moved] ** 2 / growth[:, None]).mean(axis=0)
                squares.append((seen.person, by_group(seen.chain.dof_names, error)))
            part = {"deviation_deg": over_people(squares), "length_s": rounded(length)}
            table[method][task] = part
            # What is pushed into the null space spreads otherwise than it was fitted.
            factor = widened_by([run(seen, table, method, task, SAMPLES) for seen in people])
            factor *= for_one_more(len({seen.person for seen in people}))
            for axes in part["deviation_deg"].values():
                axes[:] = [rounded(factor * v) for v in axes]
    return table


def most_likely_length(runs: Sequence[HeldOutRun]) -> float:
    """Correlation length under which the errors are likeliest, each person's spread their own."""
    costs = []
    for length in LENGTHS:
        cost = 0.0
        for held in runs:
            moved = held.run.travelled > 1e-3
            growth = -np.expm1(-2.0 * held.run.travelled[moved] / length)
            variance = (held.error[moved] ** 2 / growth[:, None]).mean(axis=0)
            cost += np.log(np.maximum(variance, 1e-8)).mean() + np.log(growth).mean()
        costs.append(cost)
    return float(LENGTHS[int(np.argmin(costs))])


def widened_by(runs: Sequence[HeldOutRun]) -> float:
    """Factor that makes the sampled 90 % bands hold 90 %, every run counting alike."""
    ratios, shares = [], []
    for held in runs:
        moved = held.run.travelled > 1e-3
        deviation = np.sqrt(((held.run.q[:, 1:] - held.run.q[:, :1]) ** 2).mean(axis=1))[moved]
        ratio = (np.abs(held.error[moved]) / np.maximum(deviation, 1e-9)).ravel()
        ratios.append(ratio)
        shares.append(np.full(ratio.size, 1.0 / ratio.size))
    ratio, share = np.concatenate(ratios), np.concatenate(shares)
    order = np.argsort(ratio)
    reached = np.cumsum(share[order]) / share.sum()
    return float(ratio[order][np.searchsorted(reached, 0.9)] / NINETY)


def for_one_more(people: int) -> float:
    """Factor from the spread among a few people to a band for the next: Student's t."""
    quantile = float(student_t.ppf(0.95, people - 1))
    return quantile / NINETY * float(np.sqrt(1.0 + 1.0 / people))


@dataclass(frozen=True, slots=True)
class Judged:
    """What a prior came to on one hand: coverage and width of its band, errors at one second."""

    person: str
    coverage: float
    width_deg: float
    error_deg: float


def judge(seen: Seen, table: Table, method: str, task: str, samples: int = 100) -> Judged:
    """Judges a table on somebody."""
    held = run(seen, table, method, task, samples)
    low, high = np.quantile(held.run.q[:, 1:], [0.05, 0.95], axis=1)
    moved = held.run.travelled > 1e-3
    inside = ((held.truth >= low) & (held.truth <= high))[moved]
    second = int(np.argmin(np.abs(held.elapsed_s[0] - 1.0)))
    return Judged(
        seen.person,
        float(inside.mean()),
        float(np.degrees((high - low)[moved].mean())),
        float(np.degrees(np.sqrt((held.error[:, second] ** 2).mean()))),
    )


def judged(people: Sequence[tuple[Seen, Table]], who: str) -> Iterator[Figure]:
    """Judges everybody by a prior they did not make."""
    for task in TASKS:
        found = {
            method: [judge(seen, table, method, task) for seen, table in people]
            for method in METHODS
        }
        for ours, least in zip(found["w-ik"], found["minimum-norm"], strict=True):
            print(
                f"{task:9}{ours.person:18}coverage {ours.coverage:.2f}, width {ours.width_deg:5.1f}"
                f" deg; error at 1 s {ours.error_deg:5.1f} deg, minimum-norm {least.error_deg:5.1f}"
            )
        for method, all_of in found.items():
            yield Figure(
                f"no demonstrations, {who}, {task}: 90 % band of {method}",
                float(np.mean([one.coverage for one in all_of])),
                "share",
                least=0.87,
                beside=f"worst hand {min(one.coverage for one in all_of):.2f}",
            )
        ratio = [
            np.log(ours.error_deg / least.error_deg)
            for ours, least in zip(found["w-ik"], found["minimum-norm"], strict=True)
        ]
        wins = sum(value < 0 for value in ratio)
        yield Figure(
            f"no demonstrations, {who}, {task}: error at 1 s with the generic W",
            float(np.exp(np.mean(ratio))),
            "x",
            most=1.0,
            beside=f"minimum-norm; better in {wins} of {len(ratio)}",
        )


def figures(full: bool = False, folder: Path | None = None) -> Iterator[Figure]:
    """Judges the shipped prior on simulated people and, with recordings, remakes it.

    Args:
        full: More simulated people, and the prior made anew.
        folder: The folder of real recordings, which is needed for that.
    """
    shipped = dict(prior_table())
    simulated = list(simulated_people(range(4 if full else 1)))
    yield from judged([(seen, shipped) for seen in simulated], "simulated people")
    if folder is None or not full:
        return
    people = list(real_people(folder))
    names = list(dict.fromkeys(seen.person for seen in people))
    without = {name: made_of([seen for seen in people if seen.person != name]) for name in names}
    yield from judged([(seen, without[seen.person]) for seen in people], "real people left out")
    made = made_of(people)
    apart = max(
        abs(np.log(one / two)) for one, two in zip(numbers(made), numbers(shipped), strict=True)
    )
    yield Figure("the shipped prior beside the one made here", float(np.exp(apart)), "x", most=1.15)
    print(json.dumps(made))


def numbers(table: Any) -> list[float]:
    """Returns every number of a table that is made here, in one order."""
    if isinstance(table, Mapping):
        kept = sorted(set(table) - {"about", "sources"})
        return [number for key in kept for number in numbers(table[key])]
    if isinstance(table, list):
        return [number for value in table for number in numbers(value)]
    return [float(table)]


def main() -> int:
    """Prints the figures; returns 1 if one fails."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", nargs="?", type=Path)
    options = parser.parse_args()
    return shown(figures(options.recordings is not None, options.recordings))


if __name__ == "__main__":
    sys.exit(main())
