"""Starts nobody measured: the hand is on the path, the band is wide enough and no wider."""

from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from prediction import (
    CovIk,
    Familiarity,
    Follower,
    HandPath,
    JointLimits,
    JointReduction,
    PostureBand,
    TrajectoryError,
)
from prediction.following.start_posture import LikelyStart

ARM = PlanarChain()


@pytest.fixture(scope="module")
def split():
    """Three quarters of what somebody did, who then is met unmeasured in the last one."""
    _, demonstrations = planar_demonstrations(seed=3)
    shown = np.arange(len(demonstrations)) < 0.75 * len(demonstrations)
    train, test = demonstrations.take(shown), demonstrations.take(~shown)
    moment = train.qdot.T @ train.qdot / len(train)
    follower = Follower(
        CovIk.fit(train, np.random.default_rng(0)),
        ARM,
        JointReduction.identity(ARM.dof_names),
        JointLimits(np.eye(5), ARM.lower, ARM.upper),
        PostureBand(0.1 * np.eye(5), 1.0, moment),
        Familiarity.of(train),
        "position",
        train.q[::3],
    )
    return follower, test


def onwards(q, points=8):
    """A short way of the hand from where a posture has it."""
    time_s = 0.04 * np.arange(points)
    way = np.stack([0.05 * time_s, 0.1 * time_s], axis=1)
    return HandPath.checked(time_s, ARM.arm.forward(q) + way, None)


def test_every_sample_starts_with_the_hand_on_the_first_point_within_limits(split):
    follower, test = split
    path = onwards(test.q[10])
    rollout = follower.rollout(path, None, 40, np.random.default_rng(0))
    assert rollout.followed.all()
    off = np.linalg.norm(ARM.arm.forward(rollout.q) - path.position, axis=-1)
    assert off.max() < 2e-4
    assert (rollout.q >= ARM.lower - 1e-6).all() and (rollout.q <= ARM.upper + 1e-6).all()
    assert rollout.q[:, 0].std(axis=0).max() > 0.02
    again = follower.rollout(onwards(test.q[10], 16), None, 40, np.random.default_rng(0))
    np.testing.assert_allclose(again.q[:, :8], rollout.q, atol=1e-9)


def test_bands_hold_starts_that_were_never_shown(split):
    follower, test = split
    inside, nearer = [], []
    for q in test.q[:: len(test) // 40]:
        drawn = follower.rollout(onwards(q, 2), None, 60, np.random.default_rng(1))
        low, high = np.quantile(drawn.q[:, 0], [0.05, 0.95], axis=0, method="weibull")
        inside.append((low <= q) & (q <= high))
        middle = follower.demonstrated.mean(axis=0)
        nearer.append(np.linalg.norm(drawn.central[0] - q) < np.linalg.norm(middle - q))
    assert 0.8 <= np.mean(inside) <= 0.99
    assert np.mean(nearer) > 0.6


def test_an_unknown_start_is_wider_than_a_measured_one(split):
    follower, test = split
    path = onwards(test.q[10])
    follower = replace(follower, band=follower.band.rescaled(0.2))
    unknown, known = (
        follower.rollout(path, q0, 60, np.random.default_rng(0)).q.std(axis=0).mean(axis=1)
        for q0 in (None, test.q[10])
    )
    assert (unknown > 1.2 * known).all() and unknown[0] > 0.02 > known[0]


def test_the_spread_is_scaled_to_what_was_shown(split):
    """Bands ten times too wide, and too narrow, are brought to much the same start."""
    follower, _ = split
    factors = [
        LikelyStart.of(replace(follower, band=replace(follower.band, factor=scale * np.eye(5))))
        for scale in (0.05, 0.5)
    ]
    assert factors[1].factor < 0.6 * factors[0].factor


def test_without_demonstrations_a_start_must_be_given(split):
    follower, test = split
    for shown in (None, np.empty((0, 5))):
        with pytest.raises(TrajectoryError, match="give q0"):
            replace(follower, demonstrated=shown).rollout(
                onwards(test.q[10]), None, 2, np.random.default_rng(0)
            )
