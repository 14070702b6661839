"""Many paths at once: each gets what it would get alone, and shares its random numbers."""

import numpy as np
import pytest

from human import Chain, Subject, generate_model
from prediction.chain import JointReduction
from prediction.demonstrations import demonstrations_from_samples
from prediction.errors import StartMismatchError, UnreachableTrajectoryError
from prediction.following.familiarity import Familiarity
from prediction.following.hand_path import HandPath
from prediction.following.joint_limits import JointLimits
from prediction.following.posture_band import PostureBand
from prediction.following.rollout import Follower, HandNoise, Rollout
from prediction.laws.cov_ik import CovIk


@pytest.fixture(scope="module")
def follower() -> Follower:
    chain = Chain(generate_model(Subject(1.75, 72.0)))
    time = np.linspace(0.0, 6.0, 181)
    rng = np.random.default_rng(0)
    amplitude, phase = rng.uniform(0.05, 0.2, chain.n), rng.uniform(0, 6, chain.n)
    rate = rng.uniform(0.5, 2.0, chain.n)
    swing = rate * time[:, None] + phase
    q = start(chain) + amplitude * np.sin(swing)
    demonstrations = demonstrations_from_samples(chain, q, amplitude * rate * np.cos(swing), time)
    moment = demonstrations.qdot.T @ demonstrations.qdot / len(q)
    return Follower(
        CovIk.fit(demonstrations, rng),
        chain,
        JointReduction.identity(chain.dof_names),
        JointLimits(np.eye(chain.n), chain.lower, chain.upper),
        PostureBand(0.05 * np.eye(chain.n), 1.0, moment),
        Familiarity.of(demonstrations),
    )


def start(chain: Chain) -> np.ndarray:
    q = 0.5 * (chain.lower + chain.upper) * 0.1
    q[chain.dof_names.index("jRightShoulder_rotx")] = 0.8
    q[chain.dof_names.index("jRightElbow_rotz")] = 0.9
    return q


def path(follower: Follower, towards: tuple[float, float, float], points: int) -> HandPath:
    position, rotation, _ = follower.chain.forward_and_jacobian(start(follower.chain))
    share = np.linspace(0.0, 1.0, points)
    return HandPath.checked(
        0.04 * np.arange(points),
        position + share[:, None] * np.array(towards),
        np.broadcast_to(rotation, (points, 3, 3)),
    )


def test_a_path_gets_the_same_alone_and_among_others(follower: Follower) -> None:
    paths = [
        path(follower, (0.1, 0.0, 0.1), 12),
        path(follower, (0.0, 0.1, -0.1), 20),
        path(follower, (0.3, 0.1, -0.1), 7),
    ]
    noise = HandNoise(0.002, 0.01)
    q0 = start(follower.chain)
    together = follower.rollouts(paths, q0, 5, np.random.default_rng(3), hand_noise=noise)
    for one, among in zip(paths, together, strict=True):
        alone = follower.rollout(one, q0, 5, np.random.default_rng(3), hand_noise=noise)
        assert isinstance(among, Rollout)
        assert among.q.shape == (5, len(one.time_s), 24)
        np.testing.assert_allclose(among.q, alone.q, atol=1e-9)
        np.testing.assert_allclose(among.central, alone.central, atol=1e-9)
    turned = follower.rollouts(paths[::-1], q0, 5, np.random.default_rng(3), hand_noise=noise)[::-1]
    for first, second in zip(together, turned, strict=True):
        assert isinstance(first, Rollout) and isinstance(second, Rollout)
        np.testing.assert_allclose(first.q, second.q, atol=1e-9)


def test_a_bad_path_leaves_the_others_alone(follower: Follower) -> None:
    good = path(follower, (0.1, 0.0, 0.1), 12)
    moved = HandPath(good.time_s, good.position + 0.1, good.rotation)
    far = path(follower, (3.0, 0.0, 0.0), 60)
    outcomes = follower.rollouts(
        [moved, good, far], start(follower.chain), 3, np.random.default_rng(0)
    )
    assert isinstance(outcomes[0], StartMismatchError)
    assert isinstance(outcomes[1], Rollout)
    assert isinstance(outcomes[2], UnreachableTrajectoryError)
    assert outcomes[2].distance > 1e-3
