"""The planar five-joint operator: every method beside the law that made the data.

Run ``python -m benchmarks.prediction.planar [--full] [--seeds 3] [--first 100]``.

Each seed draws an operator and 1000 samples; 70 % train, 30 % test, once drawn at random
(neighbours of test samples are then in training) and once the first 70 % in time. Log densities
are of the joint velocity at a hand noise of 2 mm/s. Methods are developed on seeds below 300;
``--full`` reports ten from there on. The naive peer is gpytorch's own loop for one candidate W,
the way the paper trains; its total is that times the candidates the search by BIPOP needed.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, fields

import numpy as np

from benchmarks.figure import Figure, shown
from benchmarks.prediction.planar_operator import (
    BIPOP,
    GRADIENT,
    IN_SAMPLE,
    LAW,
    SAMPLES,
    SPLITS,
    Scores,
    one_seed,
    split,
)
from human.simulate import simulate_planar

DEVELOPMENT, REPORT = range(100, 103), range(300, 310)
#: Fewest candidates a naive loop is given; the paper's own BIPOP needs more.
NAIVE_CANDIDATES = 1500
#: Steps of Adam each of them takes.
ADAM_STEPS = 50
#: Candidates of the naive loop that are timed, each of another operator.
NAIVE_MEASURED = 2
KEEPS_HAND = (GRADIENT, BIPOP, "W-IK", "Sb-M", "NsGP, paper's kernel", "LoCov-IK")


def means(rows: Sequence[Mapping[str, Scores]]) -> dict[str, Scores]:
    """Returns the mean of every score over seeds, by row."""
    return {
        label: Scores(
            *(np.mean([getattr(row[label], f.name) for row in rows]).item() for f in fields(Scores))
        )
        for label in rows[0]
    }


def table(kind: str, rows: Sequence[Mapping[str, Scores]]) -> str:
    """Returns the rows of one split as text: means over seeds, and the worst density."""
    lines = [
        f"\n{kind} split, {len(rows)} seeds: means, and the worst log density",
        f"{'':26}{'nats':>8}{'worst':>8}{'rad/s':>8}{'hand m/s':>10}{'90 %':>6}"
        f"{'W err':>7}{'s':>6}",
    ]
    for label, mean in means(rows).items():
        worst = min(row[label].nats for row in rows)
        lines.append(
            f"{label:26}{mean.nats:8.2f}{worst:8.2f}{mean.rmse:8.3f}{mean.hand_rmse:10.1e}"
            f"{mean.coverage:6.2f}{mean.weight_error:7.3f}{mean.seconds:6.1f}"
        )
    return "\n".join(lines)


def naive_candidate_seconds(seed: int) -> float:
    """Returns the seconds of one candidate W as gpytorch users train it: a model for each y."""
    from benchmarks.prediction.naive_loop import naive_step_seconds  # torch, for this alone

    raw = simulate_planar(np.random.default_rng(seed), samples=SAMPLES)
    train = split(raw, "random", seed)[0]
    return ADAM_STEPS * naive_step_seconds(train, train.q.shape[1] - train.jacobian.shape[1])


def beside(rows: Mapping[str, Scores], name: str, *labels: str) -> str:
    """Returns peers of the same run as text."""
    return ", ".join(f"{label} {asdict(rows[label])[name]:.3g}" for label in labels)


def figures(full: bool = False, seeds: range | None = None) -> Iterator[Figure]:
    """Runs both splits, prints their tables and yields the figures.

    Args:
        full: Whether on the ten seeds that are reported, or on three of development.
        seeds: Others.
    """
    seeds = seeds or (REPORT if full else DEVELOPMENT)
    every = {kind: [one_seed(kind, seed) for seed in seeds] for kind in SPLITS}
    for kind, rows in every.items():
        print(table(kind, rows))
    print()
    random, block = means(every["random"]), means(every["block"])
    for label in (GRADIENT, BIPOP):
        ours, away = random[label], block[label]
        yield Figure(
            f"5R random: {label}, below the true law's log density",
            random[LAW].nats - ours.nats,
            "nats",
            most=1.0,
            beside=", ".join(
                f"{peer} {random[LAW].nats - random[peer].nats:.2f}"
                for peer in ("NsGP, paper's kernel", "MI-NsGP, paper's kernel")
            ),
        )
        for name, scores, most in (("random", ours, 0.055), ("block", away, 0.19)):
            peers = random if name == "random" else block
            yield Figure(
                f"5R {name}: {label}, RMSE",
                scores.rmse,
                "rad/s",
                most=most,
                beside=beside(peers, "rmse", "NsGP, paper's kernel", "GP", "ProMP", "W-IK"),
            )
        yield Figure(
            f"5R block: {label}, RMSE, the aim",
            away.rmse,
            "rad/s",
            most=0.165,
            beside="our bar .19",
        )
        yield Figure(
            f"5R random: {label}, std of the error of log W",
            ours.weight_error,
            most=0.03,
            beside=beside(random, "weight_error", IN_SAMPLE, "MI-NsGP, paper's kernel"),
        )
        yield Figure(
            f"5R random: {label}, coverage of the 90 % interval",
            ours.coverage,
            least=0.88,
            most=0.92,
            beside=beside(random, "coverage", LAW),
        )
        yield Figure(
            f"5R block: {label}, coverage of the 90 % interval",
            away.coverage,
            least=0.87,
            beside=beside(block, "coverage", LAW, "NsGP, paper's kernel", "GP"),
        )
    yield Figure(
        "5R: hand velocity, largest error of the null-space family",
        max(
            row[label].hand_worst for rows in every.values() for row in rows for label in KEEPS_HAND
        ),
        "m/s",
        most=1e-12,
        beside=f"GP {random['GP'].hand_rmse:.3f} RMSE",
    )
    yield Figure(
        "5R: optimum of BIPOP and of the gradient, largest difference",
        max(
            abs(row[GRADIENT].objective - row[BIPOP].objective)
            for rows in every.values()
            for row in rows
        ),
        "nats",
        most=1e-4,
        beside="a sample, on the training set",
    )
    naive = float(np.mean([naive_candidate_seconds(seed) for seed in seeds[:NAIVE_MEASURED]]))
    candidates = max(random[BIPOP].evaluations, NAIVE_CANDIDATES)
    for label in (GRADIENT, BIPOP):
        yield Figure(
            f"5R training, N = 700: {label}, times faster than the naive loop",
            naive * candidates / random[label].seconds,
            "x",
            least=5000,
            beside=f"{random[label].seconds:.1f} s; gpytorch + CMA {naive:.1f} s a candidate x "
            f"{candidates:.0f} = {naive * candidates / 3600:.1f} h; paper ~10 h",
        )


def main() -> int:
    """Prints tables and figures; returns 1 if one misses its bar."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--full", action="store_true", help="the ten seeds that are reported")
    parser.add_argument("--seeds", type=int)
    parser.add_argument("--first", type=int, default=DEVELOPMENT.start)
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.seeds) if options.seeds else None
    return shown(figures(options.full, seeds))


if __name__ == "__main__":
    sys.exit(main())
