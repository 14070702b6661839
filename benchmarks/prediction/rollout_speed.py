"""1000 sampled postures x 100 steps, 24 joints: time, hand error, and what compression costs.

Run ``python -m benchmarks.prediction.rollout_speed``.

The peer is the same process kept on every training point, its mean and variance evaluated once a
step for the same postures, alone: no kinematics, no hand. Processor time, one thread, best of
three.
"""

import time
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from human import Chain, Subject, generate_model
from prediction import (
    Follower,
    HandPath,
    MiNsGp,
    Rollout,
    TrainingOptions,
    demonstrations_from_samples,
    train_operator,
)
from prediction.compression import exact_posterior
from prediction.weight_search import NullSpaceTargets

Array = NDArray[np.float64]
SAMPLES, STEPS = 1000, 100


def swinging_arm(chain: Chain, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Returns postures, velocities and times of smooth made-up motion, 30 s at 30 Hz."""
    time_s = np.arange(900) / 30.0
    rate, phase = rng.uniform(0.5, 2.5, 40), rng.uniform(0.0, 6.0, 40)
    swing = rng.normal(0.0, 0.04, (40, chain.n))
    middle = np.clip(0.2, chain.lower + 0.3, chain.upper - 0.3)
    q = middle + np.sin(time_s[:, None] * rate + phase) @ swing
    return q, (rate * np.cos(time_s[:, None] * rate + phase)) @ swing, time_s


def roll_out(follower: Follower, path: HandPath, q0: Array) -> Rollout:
    """Rolls out once, always with the same numbers."""
    return follower.rollout(path, q0, SAMPLES, np.random.default_rng(0))


def best_of(rounds: int, work: Callable[[], object]) -> float:
    """Returns the least processor time of several runs, s."""
    times = []
    for _ in range(rounds):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def main() -> None:
    """Prints the figures and checks."""
    chain = Chain(generate_model(Subject(1.75, 72.0)))
    demonstrations = demonstrations_from_samples(
        chain, *swinging_arm(chain, np.random.default_rng(0))
    )
    options = TrainingOptions(method="mi-nsgp", tasks=("pose",), optimizer="gradient")
    operator = train_operator(chain, demonstrations, seed=0, options=options)
    q0 = demonstrations.q[300]
    position, rotation, _ = chain.forward_and_jacobian(q0)
    share = np.linspace(0.0, 1.0, STEPS + 1)
    smooth = 10 * share**3 - 15 * share**4 + 6 * share**5
    path = HandPath.checked(
        0.03 * np.arange(STEPS + 1),
        position + smooth[:, None] * np.array([0.1, 0.08, 0.15]),
        np.broadcast_to(rotation, (STEPS + 1, 3, 3)),
    )
    rows = {}
    for method in operator.method_names:
        follower = operator.follower(method)

        work = partial(roll_out, follower, path, q0)
        rows[method] = best_of(3, work)
        error = work().hand_error_m
        print(
            f"{method:14}{rows[method]:6.2f} s   hand error mean {1e3 * error.mean():.4f} mm, "
            f"largest {1e3 * error.max():.3f} mm"
        )
    fitted = operator.fitted("mi-nsgp").predictor
    assert isinstance(fitted, MiNsGp)
    learned = demonstrations.reduced(operator.reduction)
    y = NullSpaceTargets(learned, fitted.basis, fitted.law.correlation).one(fitted.log_weights)
    inputs = fitted.law.scaling.inputs(learned.q, learned.xdot, fitted.law.theta[:-1])
    exact = exact_posterior(
        inputs, y - fitted.process.prior_mean, float(np.exp(fitted.law.theta[-1]))
    )
    rng = np.random.default_rng(1)
    at = np.repeat(inputs, 2, axis=0)[:SAMPLES] + 0.1 * rng.normal(size=(SAMPLES, inputs.shape[1]))

    def exact_steps() -> None:
        for _ in range(STEPS // 10):
            exact.mean(at)
            exact.variance(at)

    peer = 10 * best_of(3, exact_steps)
    noise = float(np.exp(fitted.law.theta[-1]))
    deviation = np.sqrt(
        np.outer(exact.variance(at) + noise, np.diagonal(fitted.process.output_covariance))
    )
    lost = (fitted.process.posterior.mean(at) - exact.mean(at)) / deviation
    spread = np.sqrt((lost**2).mean())
    kept = len(fitted.process.posterior.centres)
    ratio = peer / rows["mi-nsgp"]
    print(f"exact process, {len(inputs)} points: {peer:.2f} s for its mean and variance alone")
    print(f"{'pass' if ratio >= 1.0 else 'FAIL'}  whole roll-out on {kept} centres: x{ratio:.1f}")
    print(f"{'pass' if spread <= 0.1 else 'FAIL'}  mean off by {spread:.4f} deviations rms <= 0.1")


if __name__ == "__main__":
    main()
