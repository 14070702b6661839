"""The planar five-joint operator as a peer sees it: splits, scores, and every method fitted."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from human.simulate import PlanarArm, PlanarDemonstrations, simulate_planar
from prediction import METHODS, Demonstrations, MiNsGp, Predictor, demonstrations_from_samples
from prediction.laws.predictor import gaussian_log_density
from prediction.laws.student_t import NINETY

Array = NDArray[np.float64]

#: Noise of the hand velocity that log densities are quoted at, m/s.
SIGMA_X = 0.002
SAMPLES = 1000
SPLITS = ("random", "block")
LAW = "law that made the data"
GRADIENT, BIPOP = "MI-NsGP", "MI-NsGP by BIPOP"
IN_SAMPLE = "MI-NsGP, paper's score"
#: Row, method, options of its fit.
ROWS: Mapping[str, tuple[str, Mapping[str, Any]]] = MappingProxyType(
    {
        GRADIENT: ("mi-nsgp", {"optimizer": "gradient"}),
        BIPOP: ("mi-nsgp", {"optimizer": "bipop"}),
        "MI-NsGP, paper's kernel": ("mi-nsgp", {"optimizer": "gradient", "kernel": "paper"}),
        IN_SAMPLE: ("mi-nsgp", {"optimizer": "bipop", "kernel": "paper", "criterion": "in-sample"}),
        "NsGP, paper's kernel": ("nsgp", {"kernel": "paper"}),
        "CC-GP": ("cc-gp", {}),
        "LoCov-IK": ("locov-ik", {}),
        "W-IK": ("w-ik", {}),
        "ProMP": ("promp", {}),
        "GP": ("gp", {}),
        "Cov-IK": ("cov-ik", {}),
        "Sb-M": ("sb-m", {}),
        "minimum-norm IK": ("minimum-norm", {}),
    }
)


@dataclass(frozen=True)
class PlanarChain:
    """The simulator's arm as a chain."""

    arm: PlanarArm
    dof_names: tuple[str, ...] = ("one", "two", "three", "four", "five")

    @property
    def lower(self) -> Array:
        """No limit worth the name."""
        return np.full(5, -4.0)

    @property
    def upper(self) -> Array:
        """No limit worth the name."""
        return np.full(5, 4.0)

    def forward_and_jacobian(self, q: Array) -> tuple[Array, Array, Array]:
        """Returns position, no rotation to speak of, and Jacobian."""
        position = self.arm.forward(q)
        return (
            position,
            np.broadcast_to(np.eye(3), (*position.shape[:-1], 3, 3)),
            self.arm.jacobian(q),
        )


@dataclass(frozen=True, slots=True)
class Scores:
    """Held-out figures of one method on one split.

    Attributes:
        nats: Mean log density of the joint velocity.
        rmse: Of the joint velocity, rad/s.
        hand_nats: Mean log density of the hand velocity, a part of the former.
        hand_rmse: Of the hand velocity, m/s.
        hand_worst: Largest error of a component of it, m/s.
        coverage: Share of joint velocities within the marginal 90 % interval.
        weight_error: Deviation of log W from the truth, up to scale.
        seconds: Processor time of the fit.
        evaluations: Candidates W it tried.
        objective: What the search for W reached, nats a training sample.
    """

    nats: float
    rmse: float
    hand_nats: float
    hand_rmse: float
    hand_worst: float
    coverage: float
    weight_error: float = float("nan")
    seconds: float = float("nan")
    evaluations: int = 0
    objective: float = float("nan")


def split(
    raw: PlanarDemonstrations, kind: str, seed: int
) -> tuple[Demonstrations, Demonstrations, Array]:
    """Returns what to train on, what to test on, and the measured hand velocity of the latter."""
    whole = demonstrations_from_samples(
        PlanarChain(raw.law.arm), raw.q, raw.qdot, np.arange(SAMPLES) * 0.05
    )
    first = int(0.7 * SAMPLES)
    order = np.arange(SAMPLES)
    if kind == "random":
        order = np.random.default_rng([seed, 1]).permutation(SAMPLES)
    train, test = np.sort(order[:first]), np.sort(order[first:])
    return whole.take(train), whole.take(test), raw.xdot[test]


def _scores(
    test: Demonstrations,
    xdot: Array,
    mean: Array,
    covariance: Array,
    nats: Array,
    hand: Array,
    ninety: float = NINETY,
) -> Scores:
    error = np.abs(mean - test.qdot)
    deviation = np.sqrt(np.einsum("tii->ti", covariance))
    missed = np.einsum("tmn,tn->tm", test.jacobian, mean) - xdot
    return Scores(
        nats=float(nats.mean()),
        rmse=float(np.sqrt((error**2).mean())),
        hand_nats=float(hand.mean()),
        hand_rmse=float(np.sqrt((missed**2).mean())),
        hand_worst=float(np.abs(missed).max()),
        coverage=float((error <= ninety * deviation).mean()),
    )


def score(predictor: Predictor, test: Demonstrations, xdot: Array) -> Scores:
    """Scores a fitted method on samples it has not seen, at measured hand velocities ``(N, 2)``."""
    noise = SIGMA_X**2 * np.eye(2)
    density = predictor.log_prob(test.q, xdot, test.qdot, test.jacobian, noise)
    law = predictor.predict(test.q, xdot, test.jacobian)
    return _scores(
        test,
        xdot,
        law.mean,
        law.covariance(noise),
        density.total,
        density.task,
        predictor.ninety,
    )


def score_truth(raw: PlanarDemonstrations, test: Demonstrations, xdot: Array) -> Scores:
    """Scores the law that made the data."""
    mean, covariance = raw.law.mean(test.q, xdot), raw.law.covariance(test.q, SIGMA_X)
    moved = np.einsum("tmn,tn->tm", test.jacobian, test.qdot) - xdot
    noise = np.broadcast_to(SIGMA_X**2 * np.eye(2), (len(moved), 2, 2))
    return _scores(
        test,
        xdot,
        mean,
        covariance,
        gaussian_log_density(test.qdot - mean, covariance),
        gaussian_log_density(moved, noise),
    )


@cache
def one_seed(kind: str, seed: int) -> Mapping[str, Scores]:
    """Draws an operator and fits every method on one of its `SPLITS`; the same call fits once."""
    raw = simulate_planar(np.random.default_rng(seed), samples=SAMPLES)
    train, test, xdot = split(raw, kind, seed)
    truth = np.log(raw.law.mobility) - np.log(raw.law.mobility).mean()
    rows = {LAW: score_truth(raw, test, xdot)}
    for label, (method, options) in ROWS.items():
        start = time.process_time()
        fitted = METHODS[method].fit(train, np.random.default_rng(seed), **options)
        rows[label] = replace(score(fitted, test, xdot), seconds=time.process_time() - start)
        if isinstance(fitted, MiNsGp):
            rows[label] = replace(
                rows[label],
                weight_error=float(np.std(fitted.log_weights - truth)),
                evaluations=fitted.law.evaluations,
                objective=fitted.law.score,
            )
    return MappingProxyType(rows)
