"""How long training takes, and whether the ways to train agree.

Run ``python -m benchmarks.prediction.training [--full]``.

Times are processor seconds of one thread on a person of 24 joints (2000 samples of led and free
motion; ``--full`` adds the search by BIPOP there) and on the planar operator (700 samples). The
peer is a step of gpytorch's own loop in the same run: independent processes, Adam, 50 steps for
each candidate W, the way the paper trains; its total is that times the candidates BIPOP needed.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.figure import Figure, shown
from benchmarks.prediction.naive_loop import MEASURED, naive_step_seconds
from benchmarks.prediction.planar_operator import SAMPLES as PLANAR
from benchmarks.prediction.planar_operator import split
from benchmarks.prediction.simulated_operators import Person
from human.simulate import simulate_planar
from prediction import METHODS, Demonstrations, MiNsGp, join
from prediction.laws.kernels import KERNELS, InputScaling
from prediction.laws.null_space import NullSpaceBasis
from prediction.search.gpytorch_engine import GpytorchEngine
from prediction.search.law_search import Criterion
from prediction.search.marginal_likelihood import FastEngine
from prediction.search.weight_search import NullSpaceTargets, Optimizer

T = TypeVar("T")

PERSON, SAMPLES, LOCOV_SAMPLES = ("average", 3), 2000, 900
#: Steps of Adam a candidate in the naive loop.
STEPS = 50
#: Seeds of planar operators no default was chosen on.
SEEDS, FULL_SEEDS = range(320, 322), range(320, 325)
BUDGET = 10000


def timed(work: Callable[[], T]) -> tuple[T, float]:
    """Returns what a piece of work gives, and its processor seconds."""
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def engines_apart(demonstrations: Demonstrations) -> float:
    """Returns the largest difference of the two engines over kernels and W, nats a sample."""
    q, xdot = demonstrations.q, demonstrations.xdot
    rng = np.random.default_rng(0)
    targets = NullSpaceTargets(demonstrations, NullSpaceBasis.around(demonstrations.jacobian))
    apart = []
    for kind in KERNELS:
        scaling = InputScaling.of(kind, q, xdot, demonstrations.linear_rows)
        fast, slow = FastEngine(scaling, q, xdot), GpytorchEngine(scaling, q, xdot)
        for noise in (-6.0, -3.0, 0.0):
            theta = np.append(rng.normal(0.5, 0.5, scaling.scales), noise)
            Y = targets.one(np.asarray(0.5 * rng.normal(size=q.shape[1]), dtype=np.float64))
            apart.append(abs(fast.log_likelihood(theta, Y) - slow.log_likelihood(theta, Y)))
    return max(apart)


def planar(seeds: range) -> Iterator[Figure]:
    """Both searches on both splits, and the paper's own score."""
    apart: list[float] = []
    seconds: dict[Optimizer, list[float]] = {"gradient": [], "bipop": []}
    errors: dict[str, list[float]] = {"marginal": [], "in-sample": []}
    for seed in seeds:
        raw = simulate_planar(np.random.default_rng(seed), samples=PLANAR)
        truth = np.log(raw.law.mobility)
        for kind in ("random", "block"):
            train = split(raw, kind, seed)[0]
            score = {}
            for optimizer in seconds:
                fitted, took = timed(
                    lambda train=train, optimizer=optimizer: MiNsGp.fit(  # type: ignore[misc]
                        train, np.random.default_rng(1), optimizer=optimizer
                    )
                )
                seconds[optimizer].append(took)
                score[optimizer] = fitted.law.score
            apart.append(abs(score["gradient"] - score["bipop"]))
            if kind == "random":
                errors["marginal"].append(float(np.std(fitted.log_weights - truth)))
                paper = MiNsGp.fit(
                    train,
                    np.random.default_rng(1),
                    criterion="in-sample",
                    kernel="paper",
                    max_evaluations=1200,
                )
                errors["in-sample"].append(float(np.std(paper.log_weights - truth)))
    yield Figure(
        f"5R: BIPOP from gradient, worst of {len(apart)} objectives", max(apart), "nats", most=1e-4
    )
    bars: tuple[tuple[Optimizer, float], ...] = (("gradient", 2.0), ("bipop", 5.0))
    for optimizer, most in bars:
        name = f"5R, N = 700: training by {optimizer}"
        yield Figure(name, float(np.mean(seconds[optimizer])), "s", most=most)
    yield Figure(
        "5R: std of log W error, marginal likelihood",
        float(np.mean(errors["marginal"])),
        beside=f"the paper's in-sample score {np.mean(errors['in-sample']):.2f}",
    )
    raw = simulate_planar(np.random.default_rng(seeds[0]), samples=PLANAR)
    yield Figure(
        "gpytorch from the fast engine, N = 700",
        engines_apart(split(raw, "random", seeds[0])[0]),
        "nats",
        most=1e-8,
    )


def person(full: bool) -> Iterator[Figure]:
    """Training at 24 joints and 2000 samples."""
    someone = Person.of(*PERSON)
    whole = join([*someone.led, someone.free])
    whole = whole.take(slice(0, SAMPLES))
    outputs = whole.q.shape[1] - whole.jacobian.shape[1]
    part = whole.take(slice(0, LOCOV_SAMPLES))
    _, took = timed(lambda: METHODS["locov-ik"].fit(part, np.random.default_rng(1)))
    yield Figure(f"24 joints, N = {len(part)}: LoCov-IK", took, "s", most=2.0)
    step = naive_step_seconds(whole, outputs)
    yield Figure("24 joints, N = 2000: a step of the naive loop, all outputs", step, "s")
    reached: dict[str, float] = {}
    rows: list[tuple[Criterion, Optimizer, float]] = [
        ("marginal", "gradient", 20.0),
        ("leave-one-trajectory-out", "gradient", 60.0),
        ("marginal", "bipop", 180.0),
    ]
    for criterion, optimizer, most in rows if full else rows[:2]:
        fitted, took = timed(
            lambda criterion=criterion, optimizer=optimizer: MiNsGp.fit(  # type: ignore[misc]
                whole,
                np.random.default_rng(1),
                criterion=criterion,
                optimizer=optimizer,
                max_samples=SAMPLES,
                max_evaluations=BUDGET,
            )
        )
        days = step * STEPS * max(fitted.law.evaluations, 5000) / 86400
        yield Figure(
            f"24 joints, N = {SAMPLES}: {criterion} by {optimizer}",
            took,
            "s",
            most=most,
            beside=f"naive loop {days:.0f} days, from {MEASURED} steps",
        )
        reached[criterion + optimizer] = fitted.law.score
    if full:
        apart = abs(reached["marginalgradient"] - reached["marginalbipop"])
        yield Figure("24 joints: BIPOP from gradient", apart, "nats", most=1e-4)


def figures(full: bool = False) -> Iterator[Figure]:
    """Yields every figure, one thread each."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield from planar(FULL_SEEDS if full else SEEDS)
        yield from person(full)


def main() -> None:
    """Prints them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--full", action="store_true")
    sys.exit(shown(figures(parser.parse_args().full)))


if __name__ == "__main__":
    main()
