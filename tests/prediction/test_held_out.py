from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from prediction import CovIk, Familiarity, Follower, JointLimits, JointReduction, PostureBand
from prediction.training.held_out import (
    Stretches,
    calibrate,
    recorded_paths,
    run_held_out,
    sampled_interval,
)


@pytest.fixture(scope="module")
def walk():
    """A smooth motion of the planar arm in one take, 20 s at 50 Hz."""
    raw = planar_demonstrations(seed=3, samples=200)[1]
    chain = PlanarChain()
    time_s = np.arange(1000) * 0.02
    rng = np.random.default_rng(1)
    rate, phase, swing = rng.uniform(0.5, 2, 8), rng.uniform(0, 6, 8), rng.normal(0, 0.1, (8, 5))
    middle = np.deg2rad([90.0, -25.0, -25.0, -60.0, -20.0])
    q = middle + np.sin(time_s[:, None] * rate + phase) @ swing
    qdot = (rate * np.cos(time_s[:, None] * rate + phase)) @ swing
    _, _, jacobian = chain.forward_and_jacobian(q)
    zeros = np.zeros(1000, dtype=int)
    return chain, replace(
        raw, q=q, qdot=qdot, jacobian=jacobian, trajectory_id=zeros, time_s=time_s
    )


def follower_of(chain, demonstrations, limits):
    moment = demonstrations.qdot.T @ demonstrations.qdot / 1000
    return Follower(
        CovIk.fit(demonstrations, np.random.default_rng(0)),
        chain,
        JointReduction.identity(chain.dof_names),
        limits,
        PostureBand(0.1 * np.eye(5), 1.0, moment),
        Familiarity.of(demonstrations),
        "position",
    )


def test_stretches_have_the_horizon_and_stay_within_takes(walk):
    _, demonstrations = walk
    index = Stretches.of(demonstrations, 2.0, overlap=0.5).index
    times = demonstrations.time_s[index]
    np.testing.assert_allclose(times[:, -1] - times[:, 0], 2.0, atol=0.05)
    assert (np.diff(times, axis=1) >= 1 / 30 - 0.02).all() and (np.diff(times[:, 0]) > 0).all()
    two = replace(demonstrations, trajectory_id=(np.arange(1000) >= 500).astype(int))
    for piece in Stretches.of(two, 2.0, at_most=100).index:
        assert len(set(two.trajectory_id[piece])) == 1


def test_stretches_do_not_span_a_block_left_out(walk):
    _, demonstrations = walk
    rest = demonstrations.take((np.arange(1000) < 400) | (np.arange(1000) >= 600))
    for piece in Stretches.of(rest, 2.0, at_most=100).index:
        assert np.diff(rest.time_s[piece]).max() < 0.1


def test_takes_too_short_give_no_stretches(walk):
    short = walk[1].take(slice(0, 5))
    assert len(Stretches.of(short).index) == 0
    alone = replace(short, trajectory_id=np.arange(5))
    assert len(Stretches.of(alone).index) == 0


def test_recorded_paths_are_where_the_hand_was(walk):
    chain, demonstrations = walk
    stretches = Stretches.of(demonstrations, 1.0, at_most=3)
    paths = recorded_paths(chain, demonstrations, stretches, "position")
    for path, index in zip(paths, stretches.index, strict=True):
        np.testing.assert_allclose(path.position, chain.arm.forward(demonstrations.q[index]))
        assert path.rotation is None


def test_held_out_error_is_against_what_was_recorded(walk):
    chain, demonstrations = walk
    follower = follower_of(chain, demonstrations, JointLimits(np.eye(5), chain.lower, chain.upper))
    stretches = Stretches.of(demonstrations, 1.0, at_most=4)
    held = run_held_out(follower, demonstrations, stretches, 3, np.random.default_rng(0))
    np.testing.assert_allclose(held.error[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(held.error, held.run.q[:, 0] - demonstrations.q[stretches.index])
    assert np.abs(held.error[:, -1]).max() > 1e-3
    assert held.run.hand_error_m.max() < 2e-4
    # travelled distance is about elapsed time, on demonstrated motion
    assert 0.4 < held.run.travelled[:, -1].mean() / held.elapsed_s[:, -1].mean() < 2.0


@pytest.mark.parametrize("samples", [19, 30, 50, 100])
def test_interval_of_few_samples_holds_a_further_one(samples, rng):
    draws = rng.standard_normal((samples, 20_000))
    low, high = sampled_interval(draws)
    further = rng.standard_normal(20_000)
    assert ((low <= further) & (further <= high)).mean() == pytest.approx(0.9, abs=0.01)


def test_held_out_truth_moves_no_limit(walk):
    """Who scores a prediction must not tell it how far the person went."""
    chain, demonstrations = walk
    limits = JointLimits(np.eye(5), demonstrations.q.min(axis=0), demonstrations.q.max(axis=0))
    limits = replace(limits, upper=limits.upper - np.array([0, 0, 0, 0, 0.2]))
    follower = follower_of(chain, demonstrations, limits)
    pieces = Stretches.of(demonstrations, 1.0, at_most=12).index
    truth = demonstrations.q[pieces][..., 4]
    leaves = pieces[(truth[:, 0] <= limits.upper[4]) & (truth.max(axis=1) > limits.upper[4])]
    assert len(leaves)
    rng = np.random.default_rng(0)
    held = run_held_out(follower, demonstrations, Stretches(leaves), 0, rng)
    assert held.run.q[:, 0, :, 4].max() <= limits.upper[4] + 2e-3


def test_calibrated_bands_hold_what_they_say(walk):
    chain, demonstrations = walk
    train, test = demonstrations.take(slice(0, 750)), demonstrations.take(slice(750, 1000))
    predictor = CovIk.fit(train, np.random.default_rng(0))
    reduction = JointReduction.identity(chain.dof_names)
    limits = JointLimits(np.eye(5), chain.lower, chain.upper)
    calibration = calibrate(
        predictor, train, chain, reduction, limits, "position", np.random.default_rng(0)
    )
    assert calibration.coverage_rollout is not None
    follower = Follower(
        predictor, chain, reduction, limits, calibration.band, Familiarity.of(train), "position"
    )
    stretches = Stretches.of(test, overlap=0.75)
    held = run_held_out(follower, test, stretches, 60, np.random.default_rng(1))
    low, high = sampled_interval(held.run.q[:, 1:], axis=1)
    inside = (held.truth >= low) & (held.truth <= high)
    assert 0.8 < inside[:, 1:].mean() < 0.99


def test_demonstrations_too_short_to_roll_out_still_give_a_band(walk):
    chain, demonstrations = walk
    pieces = demonstrations.take(np.arange(1000) % 100 < 4)
    pieces = replace(pieces, trajectory_id=np.repeat(np.arange(10), 4))
    predictor = CovIk.fit(pieces, np.random.default_rng(0))
    limits = JointLimits(np.eye(5), chain.lower, chain.upper)
    reduction = JointReduction.identity(chain.dof_names)
    calibration = calibrate(
        predictor, pieces, chain, reduction, limits, "position", np.random.default_rng(0)
    )
    assert calibration.coverage_rollout is None
    assert np.isfinite(calibration.band.factor).all() and calibration.band.length > 0


def test_bands_of_motion_unlike_the_rest_are_not_widened_twice(walk):
    """Parts in postures of their own: what widens a new one is not in the fitted band as well."""
    chain, demonstrations = walk
    part = np.arange(1000) // 250
    apart = demonstrations.q + 0.4 * part[:, None] * np.array([0.0, 1.0, -1.0, 1.0, 0.0])
    jacobian = chain.forward_and_jacobian(apart)[2]
    shifted = replace(demonstrations, q=apart, jacobian=jacobian, trajectory_id=part)
    predictor = CovIk.fit(shifted, np.random.default_rng(0))
    reduction = JointReduction.identity(chain.dof_names)
    limits = JointLimits(np.eye(5), np.full(5, -10.0), np.full(5, 10.0))
    calibration = calibrate(
        predictor, shifted, chain, reduction, limits, "position", np.random.default_rng(0)
    )
    inside = []
    for block in shifted.blocks(4):
        rest, held = shifted.take(~block), shifted.take(block)
        known = Familiarity.of(shifted).without(rest)
        follower = Follower(
            predictor.refitted(rest), chain, reduction, limits, calibration.band, known, "position"
        )
        run = run_held_out(follower, held, Stretches.of(held), 40, np.random.default_rng(1))
        low, high = sampled_interval(run.run.q[:, 1:], axis=1)
        inside.append(((run.truth >= low) & (run.truth <= high))[:, 1:].ravel())
    assert np.concatenate(inside).mean() == pytest.approx(0.9, abs=0.05)


def test_each_part_is_predicted_from_the_others_alone(walk):
    chain, demonstrations = walk
    predictor, learned_from = CovIk.fit(demonstrations, np.random.default_rng(0)), []

    def refit(part):
        learned_from.append({row.tobytes() for row in part.q})
        return predictor.refitted(part)

    limits = JointLimits(np.eye(5), chain.lower, chain.upper)
    reduction = JointReduction.identity(chain.dof_names)
    rng = np.random.default_rng(0)
    calibrate(predictor, demonstrations, chain, reduction, limits, "position", rng, refit=refit)
    every = [row.tobytes() for row in demonstrations.q]
    left_out = [sum(row not in seen for seen in learned_from) for row in every]
    assert len(learned_from) == 4 and left_out == [1] * len(every)
