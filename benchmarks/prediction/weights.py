"""Whether the intervals of W hold the true W, where it is known.

Run ``python -m benchmarks.prediction.weights [--full]``.

Planar operators have white noise, simulated people noise that lasts .3 s, so that neighbouring
samples repeat each other. Beside the coverage of the interval stands that of the plain profile
likelihood, which takes every sample for new. The number of parts was chosen on seeds below 30.
"""

import argparse
import sys
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from benchmarks.figure import Figure, shown
from benchmarks.prediction.planar_operator import PlanarChain
from human import Chain, Subject, generate_model
from human.simulate import (
    OPERATOR_KINDS,
    operator,
    robot_trajectories,
    simulate_following,
    simulate_planar,
)
from prediction import Demonstrations, demonstrations_from_motion, demonstrations_from_samples, join
from prediction.search.law_search import Criterion, SearchOptions, criterion_engine, search_law
from prediction.search.marginal_likelihood import FastEngine
from prediction.search.weight_interval import PARTS, Profile, weight_interval
from prediction.search.weight_search import NullSpaceTargets

Array = NDArray[np.float64]

SEEDS, FULL_SEEDS = range(30, 32), range(30, 40)
PLANAR_SAMPLES, WAYS, RATE_HZ = 300, 12, 8.0
CRITERIA: tuple[Criterion, ...] = ("marginal", "held-out")
#: Least coverage of a 90 % interval that is not called too narrow.
LEAST = 0.85


def planar(seed: int) -> tuple[Demonstrations, Array]:
    """Returns a planar operator's demonstrations and the true log weights."""
    raw = simulate_planar(np.random.default_rng(seed), samples=PLANAR_SAMPLES)
    seen = demonstrations_from_samples(
        PlanarChain(raw.law.arm), raw.q, raw.qdot, raw.time_s, raw.trajectory_id
    )
    return seen, np.log(raw.law.mobility)


def person(seed: int) -> tuple[Demonstrations, Array]:
    """Returns a simulated person's demonstrations and the true log weights."""
    model = generate_model(Subject(1.75, 72.0))
    chain, rng = Chain(model), np.random.default_rng(seed)
    who = operator(OPERATOR_KINDS[seed % len(OPERATOR_KINDS)], rng, model)
    scene = robot_trajectories(model, who, rng, count=WAYS)
    takes = []
    for number, way in enumerate(scene.trajectories):
        run = simulate_following(
            model, who, way.path(), rng, q_start=scene.q_start, rate_hz=RATE_HZ
        )
        takes.append(
            demonstrations_from_motion(chain, run.motion, trajectory_id=number, rate_hz=RATE_HZ)
        )
    own = [model.dof_names.index(name) for name in chain.dof_names]
    return join(takes), np.log(who.mobility[own])


def inside(seen: Demonstrations, truth: Array, criterion: Criterion) -> tuple[Array, Array, float]:
    """Returns which true weights the interval holds, which the plain one does, and its width."""
    options = SearchOptions(optimizer="gradient", criterion=criterion)
    law = search_law(seen, np.random.default_rng(0), options)
    engine, _ = criterion_engine(options, law.scaling, seen)
    assert isinstance(engine, FastEngine)
    targets = NullSpaceTargets(seen, law.basis)
    profile = Profile(engine.residual_map(law.theta), targets)
    found = weight_interval(profile, law.log_weights, seen.blocks(PARTS))
    plain = weight_interval(profile, law.log_weights, [])
    centred = truth - truth.mean()
    held = [(each.low <= centred) & (centred <= each.high) for each in (found, plain)]
    return held[0], held[1], float(np.median(found.high - found.low))


def coverage(seeds: range) -> Iterator[Figure]:
    """Yields the coverage over seeds, for each kind of operator and criterion."""
    for name, make in (("5R", planar), ("simulated people", person)):
        seen = [make(seed) for seed in seeds]
        for criterion in CRITERIA:
            rows = [inside(*each, criterion) for each in seen]
            held, plain = (np.concatenate([row[i] for row in rows]).mean() for i in (0, 1))
            width = float(np.exp(0.5 * np.median([row[2] for row in rows])))
            yield Figure(
                f"{name}, {criterion}: true weights in the 90 % interval, {len(seeds)} seeds",
                float(held),
                least=LEAST,
                beside=f"plain profile {plain:.2f}; half width x{width:.2f}",
            )


def figures(full: bool = False) -> Iterator[Figure]:
    """Yields every figure."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield from coverage(FULL_SEEDS if full else SEEDS)


def main() -> None:
    """Prints them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--full", action="store_true")
    sys.exit(shown(figures(parser.parse_args().full)))


if __name__ == "__main__":
    main()
