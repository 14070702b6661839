"""The planar five-joint operator: every method beside the law that made the data.

Run ``python -m benchmarks.prediction.planar [--seeds 3] [--first 100] [--optimizer bipop]``.

Each seed draws an operator and 1000 samples; 70 % train, 30 % test, once drawn at random
(neighbours of test samples are then in training) and once the first 70 % in time. Log densities are
of the joint velocity at a hand noise of 2 mm/s. The naive peer is gpytorch's own loop for one
candidate W, the way the paper trains; its total is that times the candidates the search needed.
"""

import argparse
import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from human.simulate import simulate_planar
from human.simulate.planar import PlanarArm, PlanarDemonstrations
from prediction import (
    METHODS,
    CovIk,
    Demonstrations,
    MinimumNormIk,
    MiNsGp,
    Predictor,
    demonstrations_from_samples,
)
from prediction.held_out import NINETY
from prediction.predictor import gaussian_log_density

Array = NDArray[np.float64]
SIGMA_X = 0.002
SAMPLES = 1000


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
class Figures:
    """Held-out figures of one method on one split."""

    nats: float
    rmse: float
    hand: float
    coverage: float
    weight_error: float = float("nan")
    seconds: float = 0.0
    evaluations: int = 0


def split(
    raw: PlanarDemonstrations, kind: str, seed: int
) -> tuple[Demonstrations, Demonstrations, Array]:
    """Returns what to train on, what to test on, and the measured hand velocity of the latter."""
    whole = demonstrations_from_samples(
        PlanarChain(raw.law.arm),
        raw.q,
        raw.qdot,
        np.arange(SAMPLES) * 0.05,
    )
    first = int(0.7 * SAMPLES)
    order = np.arange(SAMPLES)
    if kind == "random":
        order = np.random.default_rng([seed, 1]).permutation(SAMPLES)
    train, test = np.sort(order[:first]), np.sort(order[first:])
    return whole.take(train), whole.take(test), raw.xdot[test]


def score(predictor: Predictor, test: Demonstrations, xdot: Array) -> Figures:
    """Scores a fitted method."""
    noise = SIGMA_X**2 * np.eye(2)
    density = predictor.log_prob(test.q, xdot, test.qdot, test.jacobian, noise).total
    law = predictor.predict(test.q, xdot, test.jacobian)
    deviation = np.sqrt(np.einsum("tii->ti", law.covariance(noise)))
    error = np.abs(law.mean - test.qdot)
    hand = np.einsum("tmn,tn->tm", test.jacobian, law.mean) - xdot
    return Figures(
        float(density.mean()),
        float(np.sqrt((error**2).mean())),
        float(np.abs(hand).max()),
        float((error <= NINETY * deviation).mean()),
    )


def oracle(raw: PlanarDemonstrations, test: Demonstrations, xdot: Array) -> Figures:
    """Scores the law that made the data."""
    mean, covariance = raw.law.mean(test.q, xdot), raw.law.covariance(test.q, SIGMA_X)
    error = np.abs(mean - test.qdot)
    deviation = np.sqrt(np.einsum("tii->ti", covariance))
    return Figures(
        float(gaussian_log_density(test.qdot - mean, covariance).mean()),
        float(np.sqrt((error**2).mean())),
        float(np.abs(np.einsum("tmn,tn->tm", test.jacobian, mean) - xdot).max()),
        float((error <= NINETY * deviation).mean()),
    )


def fit_and_score(
    raw: PlanarDemonstrations, kind: str, seed: int, optimizer: str
) -> dict[str, Figures]:
    """Fits every method on one split."""
    train, test, xdot = split(raw, kind, seed)
    truth = np.log(raw.law.mobility) - np.log(raw.law.mobility).mean()
    rows = {"true law": oracle(raw, test, xdot)}
    for label, cls, options in (
        ("MI-NsGP", MiNsGp, {"optimizer": optimizer}),
        ("MI-NsGP, paper's kernel", MiNsGp, {"optimizer": optimizer, "kernel": "paper"}),
        ("NsGP", METHODS["nsgp"], {"kernel": "paper"}),
        ("LoCov-IK", METHODS["locov-ik"], {}),
        ("CC-GP", METHODS["cc-gp"], {}),
        ("W-IK", METHODS["w-ik"], {}),
        ("Cov-IK", CovIk, {}),
        ("Sb-M", METHODS["sb-m"], {}),
        ("minimum-norm IK", MinimumNormIk, {}),
        ("GP", METHODS["gp"], {}),
        ("ProMP", METHODS["promp"], {}),
    ):
        start = time.process_time()
        fitted = cls.fit(train, np.random.default_rng(seed), **options)
        seconds = time.process_time() - start
        figures = replace(score(fitted, test, xdot), seconds=seconds)
        if isinstance(fitted, MiNsGp):
            error = float(np.std(fitted.log_weights - truth))
            figures = replace(figures, weight_error=error, evaluations=fitted.law.evaluations)
        rows[label] = figures
    return rows


def naive_candidate_seconds(raw: PlanarDemonstrations) -> float:
    """Times one candidate W as gpytorch users train it: k models, 50 Adam steps each."""
    import gpytorch
    import torch

    train, _, _ = split(raw, "random", 0)
    inputs = torch.tensor(np.concatenate([train.q, train.xdot], axis=1)).float()
    inputs = (inputs - inputs.mean(0)) / inputs.std(0)

    class Model(gpytorch.models.ExactGP):  # type: ignore[misc]
        def __init__(self, targets: object, likelihood: object) -> None:
            super().__init__(inputs, targets, likelihood)
            self.mean_module = gpytorch.means.ConstantMean()
            self.covar_module = gpytorch.kernels.ScaleKernel(gpytorch.kernels.RBFKernel())

        def forward(self, x: object) -> object:
            return gpytorch.distributions.MultivariateNormal(
                self.mean_module(x), self.covar_module(x)
            )

    start = time.process_time()
    for output in range(3):
        targets = torch.tensor(train.qdot[:, output]).float()
        likelihood = gpytorch.likelihoods.GaussianLikelihood()
        model = Model(targets, likelihood)
        model.train()
        likelihood.train()
        search = torch.optim.Adam(model.parameters(), lr=0.1)
        mll = gpytorch.mlls.ExactMarginalLogLikelihood(likelihood, model)
        for _ in range(50):
            search.zero_grad()
            (-mll(model(inputs), targets)).backward()
            search.step()
    return time.process_time() - start


def main() -> None:
    """Prints both tables and the checks."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--optimizer", choices=("bipop", "gradient"), default="bipop")
    options = parser.parse_args()
    raws = {
        seed: simulate_planar(np.random.default_rng(seed), samples=SAMPLES)
        for seed in range(options.first, options.first + options.seeds)
    }
    means: dict[str, dict[str, Figures]] = {}
    for kind in ("random", "block"):
        per_seed = [fit_and_score(raw, kind, seed, options.optimizer) for seed, raw in raws.items()]
        print(f"\n{kind} split, {len(raws)} seeds, mean (worst likelihood)")
        print(
            f"{'':26}{'nats':>8}{'worst':>8}{'rad/s':>9}{'hand m/s':>10}{'cover':>7}"
            f"{'W err':>7}{'s':>6}"
        )
        means[kind] = {}
        for label in per_seed[0]:
            rows = [seed_rows[label] for seed_rows in per_seed]
            mean = Figures(
                *(
                    float(np.mean([getattr(r, name) for r in rows]))
                    for name in ("nats", "rmse", "hand", "coverage", "weight_error", "seconds")
                ),
                int(np.mean([r.evaluations for r in rows])),
            )
            means[kind][label] = mean
            worst = min(r.nats for r in rows)
            print(
                f"{label:26}{mean.nats:8.2f}{worst:8.2f}{mean.rmse:9.4f}{mean.hand:10.1e}"
                f"{mean.coverage:7.2f}{mean.weight_error:7.3f}{mean.seconds:6.1f}"
            )
    fitted, law = means["random"]["MI-NsGP"], means["random"]["true law"]
    block = means["block"]["MI-NsGP"]
    naive = naive_candidate_seconds(next(iter(raws.values())))
    evaluations = max(fitted.evaluations, 1500)
    ratio = naive * evaluations / fitted.seconds
    checks = (
        (
            f"random: {law.nats - fitted.nats:.2f} nats below the law <= 1.0",
            law.nats - fitted.nats <= 1.0,
        ),
        (
            f"random: W std of log error {fitted.weight_error:.3f} <= 0.03",
            fitted.weight_error <= 0.03,
        ),
        (
            f"velocity error {fitted.rmse:.3f} <= .055 random, {block.rmse:.3f} <= .19 block",
            fitted.rmse <= 0.055 and block.rmse <= 0.19,
        ),
        (f"block: coverage {block.coverage:.2f} >= .87", block.coverage >= 0.87),
        (f"random: coverage {fitted.coverage:.2f} in .88-.92", 0.88 <= fitted.coverage <= 0.92),
        (f"random: hand velocity error {fitted.hand:.0e} <= 1e-12", fitted.hand <= 1e-12),
        (
            f"training {fitted.seconds:.1f} s; naive gpytorch {naive:.1f} s a candidate x "
            f"{evaluations} = {naive * evaluations / 3600:.1f} h: x{ratio:.0f} >= x5000",
            ratio >= 5000,
        ),
    )
    print()
    for text, ok in checks:
        print(f"{'pass' if ok else 'FAIL'}  {text}")


if __name__ == "__main__":
    main()
