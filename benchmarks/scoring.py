"""Scores and angles per second on one core, and that both scorers agree on 10^5 postures.

Run ``python -m benchmarks.scoring``.

The peer is the readable scorer of this project, one posture at a time in plain Python, called in
turn with the vectorised one; processor time, one thread, median of several rounds. The ratio is
what carries over to another machine. The worked cases and the tables' monotony are in the tests.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from dataclasses import fields, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ergonomics import (
    RebaInputs,
    RulaInputs,
    ScoringRules,
    explain_reba,
    explain_rula,
    posture_angles,
    reba_pmf,
    rula_pmf,
    score_distribution,
    score_reba,
    score_rula,
)
from human import Subject, forward_kinematics, generate_model

BATCH = 1_000_000
PMF_BATCH = 50_000
FRAMES = 100_000
ONE_BY_ONE = 2_000
AGREEMENT = 100_000
ROUNDS = 5
EDGES = np.array([-20.0, -15, -5, 0, 5, 10, 15, 20, 30, 45, 60, 90, 100])
RULES = [
    ScoringRules(profile, ties)
    for profile, ties in product(("paper", "worksheet"), ("lower", "higher"))
]


def main() -> int:
    """Prints one line per figure; returns 1 if one fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    options = parser.parse_args()
    rng = np.random.default_rng(0)
    rula, reba = random_rula(rng, BATCH), random_reba(rng, BATCH)
    print(f"{'what':44} {'per second':>12} {'least':>10} {'ratio':>8}")
    results = [
        speed("RULA, all intermediates", lambda: score_rula(rula), BATCH, 5e6, options.rounds,
              lambda: [explain_rula(rula, (i,)) for i in range(ONE_BY_ONE)]),
        speed("REBA, all intermediates", lambda: score_reba(reba), BATCH, 5e6, options.rounds,
              lambda: [explain_reba(reba, (i,)) for i in range(ONE_BY_ONE)]),
    ]  # fmt: skip
    few_rula, few_reba = head(rula, PMF_BATCH), head(reba, PMF_BATCH)
    results += [
        speed("RULA distribution, sigma 5 deg", lambda: rula_pmf(few_rula, 5.0), PMF_BATCH, 0.15e6,
              options.rounds),
        speed("REBA distribution, sigma 5 deg", lambda: reba_pmf(few_reba, 5.0), PMF_BATCH, 0.15e6,
              options.rounds),
    ]  # fmt: skip
    model = generate_model(Subject(1.75, 70.0, "male"))
    q = np.zeros((FRAMES, model.nq))
    q[:, 6] = 1.0
    q[:, 7:] = rng.uniform(-0.5, 0.5, (FRAMES, model.nq - 7))
    poses = forward_kinematics(model, q)
    results += [
        speed("angles of one side", lambda: posture_angles(model, poses, sides=("right",)), FRAMES,
              0.5e6, options.rounds),
        speed("angles of both sides", lambda: posture_angles(model, poses), FRAMES, 0.3e6,
              options.rounds),
    ]  # fmt: skip
    print()
    results += [agreement("RULA", head(rula, AGREEMENT)), agreement("REBA", head(reba, AGREEMENT))]
    results += [monte_carlo("RULA", head(rula, 40), rng), monte_carlo("REBA", head(reba, 40), rng)]
    failed = results.count(False)
    print(f"\n{len(results) - failed} of {len(results)} passed")
    return 1 if failed else 0


def speed(
    name: str,
    call: Callable[[], object],
    amount: int,
    least: float,
    rounds: int,
    peer: Callable[[], object] | None = None,
) -> bool:
    """Prints how many a second, and the ratio to the peer measured in the same rounds."""
    ours, theirs = [], []
    call()
    for _ in range(rounds):
        start = time.process_time()
        call()
        ours.append((time.process_time() - start) / amount)
        if peer is not None:
            start = time.process_time()
            peer()
            theirs.append((time.process_time() - start) / ONE_BY_ONE)
    rate = 1.0 / statistics.median(ours)
    ratio = f"{statistics.median(theirs) * rate:8.0f}" if theirs else " " * 8
    good = rate >= least
    print(f"{name:44} {rate:12,.0f} {least:10,.0f} {ratio}  {'pass' if good else 'FAIL'}")
    return good


def agreement(name: str, inputs: RulaInputs | RebaInputs) -> bool:
    """Compares every score of both scorers under every profile and tie rule."""
    good = True
    for rules in RULES:
        wrong = 0
        if isinstance(inputs, RulaInputs):
            scores: Any = score_rula(inputs, rules)
        else:
            scores = score_reba(inputs, rules)
        names = [f.name for f in fields(scores)]
        table = np.stack([getattr(scores, field) for field in names], axis=1)
        for i, row in enumerate(table):
            if isinstance(inputs, RulaInputs):
                one: Any = explain_rula(inputs, (i,), rules)
            else:
                one = explain_reba(inputs, (i,), rules)
            wrong += [getattr(one, field) for field in names] != row.tolist()
        good &= wrong == 0
        print(
            f"{name} {rules.profile}, ties {rules.ties}: scorers differ on {wrong} of "
            f"{len(table):,}  {'pass' if not wrong else 'FAIL'}"
        )
    return good


def monte_carlo(name: str, inputs: RulaInputs | RebaInputs, rng: np.random.Generator) -> bool:
    """Compares sampled with closed-form distributions."""
    noise = {
        field: array + 5.0 * rng.standard_normal((40_000, 40))
        for field, array in inputs.arrays().items()
        if field.endswith("_deg")
    }
    if isinstance(inputs, RulaInputs):
        sampled = score_distribution(score_rula(replace(inputs, **noise)).final, "rula")
        exact = rula_pmf(inputs, 5.0)
    else:
        sampled = score_distribution(score_reba(replace(inputs, **noise)).final, "reba")
        exact = reba_pmf(inputs, 5.0)
    gap = float(np.abs(sampled.pmf - exact.pmf).max())
    good = gap < 0.01
    print(
        f"{name}: greatest gap of 40,000 samples to the closed form {gap:.4f} (most 0.01)  "
        f"{'pass' if good else 'FAIL'}"
    )
    return good


def head(inputs: Any, count: int) -> Any:
    """Returns the first postures of a batch."""
    return replace(inputs, **{name: array[:count] for name, array in inputs.arrays().items()})


def angles(rng: np.random.Generator, n: int, low: float, high: float) -> NDArray[np.float64]:
    """Returns ``(n,)`` angles, a third of them on an edge of some scale."""
    return np.where(rng.random(n) < 0.33, rng.choice(EDGES, n), rng.uniform(low, high, n))


def boxes(rng: np.random.Generator, n: int, names: str) -> dict[str, Any]:
    """Returns yes/no boxes, a fifth of them ticked."""
    return {name: rng.random(n) < 0.2 for name in names.split()}


def random_rula(rng: np.random.Generator, n: int) -> RulaInputs:
    """Returns random RULA inputs over the range of motion."""
    return RulaInputs(
        upper_arm_deg=angles(rng, n, -60, 170),
        lower_arm_deg=angles(rng, n, 0, 145),
        wrist_deg=angles(rng, n, -70, 70),
        neck_deg=angles(rng, n, -40, 50),
        trunk_deg=angles(rng, n, -25, 90),
        muscle_a=rng.integers(0, 2, n),
        muscle_b=rng.integers(0, 2, n),
        force_a=rng.integers(0, 4, n),
        force_b=rng.integers(0, 4, n),
        **boxes(
            rng,
            n,
            "shoulder_raised abducted supported across_midline_or_out_to_side wrist_deviated "
            "wrist_twist_end neck_twisted neck_side_bent trunk_twisted trunk_side_bent "
            "seated_supported legs_supported",
        ),
    )


def random_reba(rng: np.random.Generator, n: int) -> RebaInputs:
    """Returns random REBA inputs over the range of motion."""
    return RebaInputs(
        neck_deg=angles(rng, n, -40, 50),
        trunk_deg=angles(rng, n, -25, 90),
        knee_deg=angles(rng, n, 0, 130),
        upper_arm_deg=angles(rng, n, -60, 170),
        lower_arm_deg=angles(rng, n, 0, 145),
        wrist_deg=angles(rng, n, -70, 70),
        load=rng.integers(0, 4, n),
        coupling=rng.integers(0, 4, n),
        **boxes(
            rng,
            n,
            "neck_twisted neck_side_bent trunk_twisted trunk_side_bent bilateral sitting "
            "shoulder_raised abducted_or_rotated supported_or_gravity_assisted "
            "wrist_deviated_or_twisted static_over_1min repeated_over_4_per_min "
            "rapid_large_change_or_unstable",
        ),
    )


if __name__ == "__main__":
    raise SystemExit(main())
