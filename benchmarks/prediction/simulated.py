"""Simulated operators of several kinds: known motion and other motion, every method side by side.

Run ``python -m benchmarks.prediction.simulated [--kinds average ...] [--seed 3]``.

Each operator follows a law with a diagonal W and a posture preference. ``known``: trained on led
hand ways, tested on other led ways between the same poses; ``other``: trained on led ways, tested
on free reaching. Errors are of closed-loop roll-outs from measured starts, two seconds each.
"""

import argparse

import numpy as np

from human import Chain, Subject, generate_model
from human.simulate import (
    OPERATOR_KINDS,
    operator,
    robot_trajectories,
    simulate_following,
    simulate_reaching,
)
from prediction import (
    Demonstrations,
    TrainingOptions,
    demonstrations_from_motion,
    join,
    score_method,
    train_operator,
)

LED, TESTED = 12, 3


def demonstrations(kind: str, seed: int) -> tuple[Chain, list[Demonstrations], Demonstrations]:
    """Returns the chain, led takes, and free reaching of one operator."""
    model = generate_model(Subject(1.75, 72.0))
    chain = Chain(model)
    rng = np.random.default_rng(seed)
    person = operator(kind, rng, model)
    scene = robot_trajectories(model, person, rng, count=LED)
    led = [
        simulate_following(
            model, person, way.path(), rng, q_start=scene.q_start, rate_hz=30.0
        ).motion
        for way in scene.trajectories
    ]
    free = simulate_reaching(model, person, rng, movements=6, rate_hz=30.0).motion
    takes = [
        demonstrations_from_motion(chain, motion, trajectory_id=k, rate_hz=30.0)
        for k, motion in enumerate([*led, free])
    ]
    return chain, takes[:-1], takes[-1]


def main() -> None:
    """Prints the table and whether the default beats Cov-IK."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kinds", nargs="+", choices=OPERATOR_KINDS, default=OPERATOR_KINDS)
    parser.add_argument("--seed", type=int, default=3)
    options = parser.parse_args()
    training = TrainingOptions(method="mi-nsgp", tasks=("pose",), optimizer="gradient")
    ratios: dict[str, list[float]] = {"known": [], "other": []}
    gains: dict[str, list[float]] = {"known": [], "other": []}
    print(
        f"{'':34}{'nats':>7}{'rad/s':>8}{'joint RMSE, deg':>17}{'at .25 .5 1 2 s':>24}{'90 %':>6}"
    )
    for kind in options.kinds:
        chain, led, free = demonstrations(kind, options.seed)
        for design, train, test in (
            ("known", led[:-TESTED], join(led[-TESTED:])),
            ("other", led, free),
        ):
            model = train_operator(chain, join(train), seed=1, options=training)
            scores = {
                name: score_method(model, name, test, np.random.default_rng(0), samples=50)
                for name in model.method_names
            }
            for name, score in scores.items():
                at = " ".join(f"{v:5.2f}" for v in score.rollout_rmse_deg_at.values())
                print(
                    f"{kind:12}{design:8}{name:14}{score.log_likelihood:7.1f}"
                    f"{score.rmse_rad_s:8.3f}{score.rollout_rmse_deg:17.2f}{at:>24}"
                    f"{score.coverage90_rollout:6.2f}"
                )
            ours, cov = scores["mi-nsgp"], scores["cov-ik"]
            assert ours.rollout_rmse_deg is not None and cov.rollout_rmse_deg is not None
            ratios[design].append(ours.rollout_rmse_deg / cov.rollout_rmse_deg)
            gains[design].append(ours.log_likelihood - cov.log_likelihood)
    print()
    for design in ratios:
        ratio = float(np.exp(np.mean(np.log(ratios[design]))))
        gain = float(np.mean(gains[design]))
        print(
            f"{'pass' if ratio <= 1.0 else 'FAIL'}  {design}: roll-out error x{ratio:.2f} of "
            f"Cov-IK's, {gain:+.1f} nats"
        )


if __name__ == "__main__":
    main()
