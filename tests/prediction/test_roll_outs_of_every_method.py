"""What every method's roll-outs owe: the hand, the limits, single precision, any sampling rate."""

from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from prediction import (
    METHODS,
    Familiarity,
    Follower,
    HandNoise,
    HandPath,
    JointLimits,
    JointReduction,
    PostureBand,
    Rollout,
    UnsupportedMethodError,
)
from prediction.following.precision import in_single_precision

Q0 = np.deg2rad([80.0, -30.0, -20.0, -50.0, -30.0])


@pytest.fixture(scope="module")
def followers():
    chain = PlanarChain()
    _, demonstrations = planar_demonstrations(seed=3)
    kept = demonstrations.thinned(250)
    moment = kept.qdot.T @ kept.qdot / len(kept)
    band = PostureBand(0.1 * np.eye(5), 1.0, moment, 0.25)
    reduction = JointReduction.identity(chain.dof_names)
    limits = JointLimits(np.eye(5), chain.lower, chain.upper)
    familiarity = Familiarity.of(demonstrations)
    made = {}
    for name, method in METHODS.items():
        searched = {"optimizer": "gradient"} if name in ("mi-nsgp", "nsgp", "w-ik") else {}
        predictor = method.fit(kept, np.random.default_rng(0), **searched)
        made[name] = Follower(predictor, chain, reduction, limits, band, familiarity, "position")
    return made


def wave(rate=25.0, seconds=1.6, size=0.1):
    time_s = np.arange(round(seconds * rate) + 1) / rate
    start = PlanarChain().arm.forward(Q0)
    way = size * np.stack([np.sin(2 * time_s), np.cos(2 * time_s) - 1.0], axis=1)
    return HandPath.checked(time_s, start + way, None)


@pytest.mark.parametrize("name", [name for name, cls in METHODS.items() if cls.keeps_hand])
def test_central_paths_set_out_with_the_mean_of_the_law(followers, name):
    chain, dt, xdot = PlanarChain(), 1e-4, np.array([0.2, -0.3])
    position, _, jacobian = chain.forward_and_jacobian(Q0)
    path = HandPath.checked(np.array([0.0, dt]), position + np.outer([0.0, dt], xdot), None)
    run = followers[name].rollout(path, Q0, 0, np.random.default_rng(0))
    rate = (run.central[1] - run.central[0]) / dt
    mean = followers[name].predictor.predict(Q0, xdot, jacobian).mean
    np.testing.assert_allclose(rate, mean, atol=1e-3 * np.abs(mean).max())


@pytest.mark.parametrize("name", METHODS)
def test_tight_limits_hold_and_so_does_the_hand(followers, name):
    follower = followers[name]
    free = follower.rollout(wave(), Q0, 20, np.random.default_rng(0))
    reach = 0.7 * np.abs(free.q - Q0).max()
    tight = replace(follower, limits=JointLimits(np.eye(5), Q0 - reach, Q0 + reach))
    bound = tight.rollout(wave(), Q0, 20, np.random.default_rng(0))
    kept = bound.followed
    assert kept.mean() > 0.97
    assert np.abs(bound.q[kept] - Q0).max() < reach + 1e-3
    assert (np.abs(np.abs(bound.q - Q0) - reach) < 1e-4).any()
    off = np.linalg.norm(PlanarChain().arm.forward(bound.q) - wave().position, axis=-1)[kept]
    assert off.max() < 2.1e-3 and off.mean() < 5e-5


@pytest.mark.parametrize("name", METHODS)
def test_half_the_digits_give_the_same_postures(followers, name):
    path, noise = wave(), HandNoise(0.002)
    exact, single = (
        followers[name].rollout(
            path, Q0, 20, np.random.default_rng(0), hand_noise=noise, precision=precision
        )
        for precision in ("double", "single")
    )
    assert single.q.dtype == np.float64
    assert np.abs(exact.q - single.q).max() < 0.04 * exact.q.std(axis=0).mean()
    assert single.hand_error_m.max() < 1e-4


@pytest.mark.parametrize("name", METHODS)
def test_single_precision_is_kept_all_the_way(followers, name):
    """One number of double size would silently turn everything after it to double."""
    predictor = in_single_precision(followers[name]).predictor
    q = np.tile(Q0, (4, 1)).astype(np.float32)
    jacobian = PlanarChain().arm.jacobian(q).astype(np.float32)
    xdot = np.full((4, 2), 0.1, dtype=np.float32)
    assert predictor.weights_at(q).dtype == np.float32
    assert predictor.null_velocity(q, xdot, jacobian).dtype == np.float32


def test_an_unknown_precision_is_refused(followers):
    with pytest.raises(UnsupportedMethodError, match="half"):
        followers["cov-ik"].rollout(wave(), Q0, 1, np.random.default_rng(0), precision="half")


@pytest.mark.parametrize("name", ["cov-ik", "mi-nsgp", "locov-ik"])
def test_a_path_sampled_at_another_rate_meets_the_same_people(followers, name):
    paths = [wave(rate) for rate in (20.0, 50.0, 100.0)]
    outcomes = followers[name].rollouts(
        paths, Q0, 30, np.random.default_rng(4), hand_noise=HandNoise(0.003)
    )
    tenths = []
    for outcome, each in zip(outcomes, (2, 5, 10), strict=True):
        assert isinstance(outcome, Rollout)
        tenths.append(outcome.q[:, ::each])
    spread = tenths[2].std(axis=0)[1:].mean()
    for coarse, allowed in ((tenths[0], 0.25), (tenths[1], 0.12)):
        difference = np.sqrt(((coarse - tenths[2]) ** 2).mean())
        assert difference < allowed * spread
