"""Figures of a method in closed loop are those of its roll-outs, time by time."""

from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from prediction import (
    HORIZONS_S,
    Stretches,
    TrainingOptions,
    run_held_out,
    score_method,
    train_operator,
)
from prediction.training.held_out import sampled_interval


def test_errors_at_a_horizon_and_coverage_are_those_of_the_roll_outs():
    chain, demonstrations = PlanarChain(), planar_demonstrations(seed=3, samples=400)[1]
    one_take = replace(
        demonstrations,
        trajectory_id=np.zeros(400, dtype=int),
        time_s=0.05 * np.arange(400),
    )
    train, test = one_take.take(slice(0, 280)), one_take.take(slice(280, 400))
    options = TrainingOptions(method="cov-ik", tasks=("position",), blocks=2, baselines=False)
    model = train_operator(chain, train, seed=0, options=options)
    pieces = Stretches.of(test)
    score = score_method(
        model,
        "cov-ik",
        test,
        np.random.default_rng(1),
        task="position",
        chain=chain,
        stretches=pieces,
        samples=20,
    )
    follower = model.follower("cov-ik", "position", chain)
    held = run_held_out(follower, test, pieces, 20, np.random.default_rng(1))
    truth = test.q[pieces.index]
    for horizon in HORIZONS_S:
        at = round(horizon / 0.05)
        error = np.degrees(held.run.q[:, 0, at] - truth[:, at])
        expected = np.sqrt((error**2).mean())
        assert score.rollout_rmse_deg_at[f"{horizon:g}"] == pytest.approx(expected), horizon
    assert len(set(score.rollout_rmse_deg_at.values())) == len(HORIZONS_S)
    # The start, where nobody has strayed yet, neither earns nor costs coverage.
    low, high = sampled_interval(held.run.q[:, 1:], axis=1)
    inside = ((truth >= low) & (truth <= high))[:, 1:]
    assert score.coverage90_rollout == pytest.approx(inside.mean())
