"""The paper's EXP1 and EXP2 on simulated people: what they train and test on, and every method.

A person is led by the hand along four ways, ten times each: the first five of each train, the last
five are the test of both experiments (EXP1). In EXP2 the same person was led to places drawn at
random instead. The person is the same and so is the noise's law; no repetition equals another.

Source: Vianello et al. 2021, section VI-B, with simulated people in place of one in a suit.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from human import Chain, HumanModel, Motion, Subject, generate_model
from human.simulate import (
    Operator,
    RobotScene,
    operator,
    robot_trajectories,
    simulate_following,
    simulate_reaching,
)
from prediction import (
    METHODS,
    Demonstrations,
    Familiarity,
    Follower,
    JointLimits,
    demonstrations_from_motion,
    find_reduction,
    join,
)
from prediction.comparison.evaluate import hand_velocity_noise

Array = NDArray[np.float64]
Design = Literal["EXP1", "EXP2"]

RATE_HZ = 30.0
WAYS, REPETITIONS, PLACES = 4, 10, 16
#: Row, method, options of its fit.
ROWS: Mapping[str, tuple[str, Mapping[str, Any]]] = MappingProxyType(
    {
        "MI-NsGP": (
            "mi-nsgp",
            {"optimizer": "gradient", "criterion": "held-out", "weights": "auto"},
        ),
        "MI-NsGP, paper's": ("mi-nsgp", {"optimizer": "gradient", "kernel": "paper"}),
        "NsGP, paper's": ("nsgp", {"kernel": "paper"}),
        "CC-GP": ("cc-gp", {}),
        "LoCov-IK": ("locov-ik", {}),
        "W-IK": ("w-ik", {}),
        "Cov-IK": ("cov-ik", {}),
        "ProMP": ("promp", {}),
        "GP": ("gp", {}),
        "Sb-M": ("sb-m", {}),
        "minimum norm": ("minimum-norm", {}),
    }
)


@dataclass(frozen=True, slots=True)
class Person:
    """A simulated operator, and what a robot does with their hand."""

    model: HumanModel
    chain: Chain
    operator: Operator
    scene: RobotScene

    def led(self, way: int, rng: np.random.Generator) -> Motion:
        """Returns what the person does along one way of the scene, this time."""
        path = self.scene.trajectories[way].path()
        return simulate_following(
            self.model, self.operator, path, rng, q_start=self.scene.q_start, rate_hz=RATE_HZ
        ).motion


@dataclass(frozen=True, slots=True)
class Experiment:
    """What is trained on, and what is tested on."""

    person: Person
    train: Demonstrations
    test: Demonstrations


@dataclass(frozen=True, slots=True)
class Scores:
    """One-step figures of one method on one split: those of the paper's Fig. 4 a-d."""

    nats: float
    rmse: float
    hand_nats: float
    hand_rmse: float


@cache
def person(kind: str, seed: int) -> Person:
    """Draws a person of a kind."""
    model = generate_model(Subject(1.75, 72.0))
    rng = np.random.default_rng([seed, 0])
    someone = operator(kind, rng, model)
    scene = robot_trajectories(model, someone, rng, count=WAYS)
    return Person(model, Chain(model), someone, scene)


def _demonstrations(who: Person, motions: list[Motion]) -> Demonstrations:
    return join(
        [
            demonstrations_from_motion(who.chain, motion, trajectory_id=take, rate_hz=RATE_HZ)
            for take, motion in enumerate(motions)
        ]
    )


@cache
def experiment(design: Design, kind: str, seed: int) -> Experiment:
    """Simulates one experiment on one person; both designs of a person share their test."""
    who = person(kind, seed)
    rng = np.random.default_rng([seed, 1])
    takes = [who.led(way, rng) for _ in range(REPETITIONS) for way in range(WAYS)]
    half = len(takes) // 2
    train, test = takes[:half], takes[half:]
    if design == "EXP2":
        free = simulate_reaching(
            who.model,
            who.operator,
            np.random.default_rng([seed, 2]),
            movements=PLACES,
            rate_hz=RATE_HZ,
        )
        train = [free.motion]
    return Experiment(who, _demonstrations(who, train), _demonstrations(who, test))


@cache
def followers(design: Design, kind: str, seed: int) -> Mapping[str, Follower]:
    """Fits every method; without bands, which need roll-outs of their own to be measured."""
    data = experiment(design, kind, seed)
    chain = data.person.chain
    reduction = find_reduction(data.train)
    learned = data.train.reduced(reduction)
    limits = JointLimits(reduction.expansion, chain.lower, chain.upper)
    limits = limits.widened_to(data.train.q)
    familiarity = Familiarity.of(learned)
    fitted = {}
    for label, (method, options) in ROWS.items():
        predictor = METHODS[method].fit(learned, np.random.default_rng(seed), **options)
        fitted[label] = Follower(predictor, chain, reduction, limits, None, familiarity)
    return MappingProxyType(fitted)


def one_step(data: Experiment, follower: Follower) -> Scores:
    """Scores a method one step ahead, at the hand noise densities are quoted at."""
    seen = data.test.reduced(follower.reduction)
    noise = hand_velocity_noise(seen)
    law = follower.predictor
    density = law.log_prob(seen.q, seen.xdot, seen.qdot, seen.jacobian, noise)
    mean = law.predict(seen.q, seen.xdot, seen.jacobian).mean
    missed = np.einsum("tmn,tn->tm", seen.jacobian, mean) - seen.xdot
    return Scores(
        nats=float(density.total.mean()),
        rmse=float(np.sqrt(((mean - seen.qdot) ** 2).mean())),
        hand_nats=float(density.task.mean()),
        hand_rmse=float(np.sqrt((missed[:, :3] ** 2).mean())),
    )
