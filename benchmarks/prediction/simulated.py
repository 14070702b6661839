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
    MethodScore,
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
    """Prints the table and whether what ``auto`` takes beats Cov-IK."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kinds", nargs="+", choices=OPERATOR_KINDS, default=OPERATOR_KINDS)
    parser.add_argument("--seed", type=int, default=3)
    options = parser.parse_args()
    training = TrainingOptions(method="auto", tasks=("pose",), optimizer="gradient")
    pairs: dict[str, list[tuple[MethodScore, MethodScore]]] = {"known": [], "other": []}
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
            pairs[design].append((scores[model.method], scores["cov-ik"]))
            print(f"{kind:12}{design:8}took {model.method}: {model.training['chosen_by']}")
    print()
    for design, least_nats, most_rmse in (("known", 3.0, 0.80), ("other", 0.0, 0.95)):
        gains = [ours.log_likelihood - cov.log_likelihood for ours, cov in pairs[design]]
        rmse = mean_ratio([(ours.rmse_rad_s, cov.rmse_rad_s) for ours, cov in pairs[design]])
        second = [
            (ours.rollout_rmse_deg_at["1"], cov.rollout_rmse_deg_at["1"])
            for ours, cov in pairs[design]
            if "1" in ours.rollout_rmse_deg_at
        ]
        after = mean_ratio(second)
        mean, least = float(np.mean(gains)), min(gains)
        checks = (
            (mean >= least_nats, f"{mean:+.1f} nats on Cov-IK (at least {least_nats:+.0f})"),
            (least > 0.0, f"{least:+.1f} nats in the worst of {len(gains)} (above 0)"),
            (rmse <= most_rmse, f"one-step error x{rmse:.2f} of Cov-IK's (at most {most_rmse})"),
            (after <= 1.0, f"roll-out error at 1 s x{after:.2f} of Cov-IK's (at most 1)"),
        )
        for ok, text in checks:
            print(f"{'pass' if ok else 'FAIL'}  {design}: {text}")


def mean_ratio(pairs: list[tuple[float, float]]) -> float:
    """Returns the geometric mean of the first over the second."""
    return float(np.exp(np.mean([np.log(first / second) for first, second in pairs])))


if __name__ == "__main__":
    main()
