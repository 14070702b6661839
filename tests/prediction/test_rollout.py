from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from prediction import (
    CovIk,
    Familiarity,
    Follower,
    HandNoise,
    HandPath,
    JointLimits,
    JointReduction,
    MinimumNormIk,
    MiNsGp,
    PostureBand,
    StartMismatchError,
    TrajectoryError,
    UnreachableTrajectoryError,
    UnsupportedMethodError,
)


@pytest.fixture(scope="module")
def followers():
    chain = PlanarChain()
    _, demonstrations = planar_demonstrations(seed=3)
    moment = demonstrations.qdot.T @ demonstrations.qdot / len(demonstrations)
    rng = np.random.default_rng(0)
    predictors = [
        CovIk.fit(demonstrations, rng),
        MinimumNormIk.fit(demonstrations, rng),
        MiNsGp.fit(demonstrations, rng, optimizer="gradient"),
    ]
    return {
        predictor.name: Follower(
            predictor,
            chain,
            JointReduction.identity(chain.dof_names),
            JointLimits(np.eye(5), chain.lower, chain.upper),
            PostureBand(0.1 * np.eye(5), 1.0, moment),
            Familiarity.of(demonstrations),
            "position",
        )
        for predictor in predictors
    }


@pytest.fixture
def follower(followers):
    return followers["cov-ik"]


Q0 = np.deg2rad([80.0, -30.0, -20.0, -50.0, -30.0])


def wave(points=40, dt=0.04, size=0.1):
    time_s = dt * np.arange(points)
    start = PlanarChain().arm.forward(Q0)
    way = size * np.stack([np.sin(2 * time_s), np.cos(2 * time_s) - 1.0], axis=1)
    return HandPath.checked(time_s, start + way, None)


@pytest.mark.parametrize("name", ["cov-ik", "minimum-norm", "mi-nsgp"])
@pytest.mark.parametrize("noise", ["coherent", "white", "none"])
def test_every_sample_keeps_the_hand_on_the_path(followers, name, noise):
    path = wave()
    rollout = followers[name].rollout(path, Q0, 20, np.random.default_rng(1), noise=noise)
    arm = PlanarChain().arm
    distance = np.linalg.norm(arm.forward(rollout.q) - path.position, axis=-1)
    np.testing.assert_allclose(distance, rollout.hand_error_m, atol=1e-12)
    assert distance.max() < 2e-4 and distance.mean() < 2e-5
    assert np.linalg.norm(arm.forward(rollout.central) - path.position, axis=-1).max() < 2e-4
    assert rollout.followed.all()
    np.testing.assert_allclose(rollout.q[:, 0], Q0[None].repeat(20, 0), atol=1e-12)


def test_the_loop_is_closed_where_open_loop_drifts(follower):
    """Integrating the same law without looking at the hand leaves the path by millimetres."""
    path = wave(points=80)
    q, arm = Q0.copy(), PlanarChain().arm
    for before, after in zip(path.position[:-1], path.position[1:], strict=True):
        J = arm.jacobian(q)
        W = follower.predictor.weights
        q = q + W @ J.T @ np.linalg.solve(J @ W @ J.T, after - before)
    open_loop = np.linalg.norm(arm.forward(q) - path.position[-1])
    closed = follower.rollout(path, Q0, 1, np.random.default_rng(0)).hand_error_m.max()
    assert open_loop > 1e-3 > 10 * closed


def test_without_deviation_all_samples_are_the_central_path(follower):
    rollout = follower.rollout(wave(), Q0, 3, np.random.default_rng(0), noise="none")
    np.testing.assert_array_equal(rollout.q, np.broadcast_to(rollout.central, rollout.q.shape))


def test_same_seed_same_postures_and_another_seed_others(follower):
    runs = [follower.rollout(wave(), Q0, 4, np.random.default_rng(s)).q for s in (1, 1, 2)]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert np.abs(runs[0] - runs[2]).max() > 0.01


def test_candidates_share_their_random_numbers(follower):
    """Nearly equal paths give nearly equal samples."""
    one = follower.rollout(wave(size=0.1), Q0, 30, np.random.default_rng(1)).q
    other = follower.rollout(wave(size=0.1001), Q0, 30, np.random.default_rng(1)).q
    spread = one.std(axis=0).max()
    assert np.abs(one - other).max() < 0.05 * spread


def test_coherent_deviation_is_wide_where_white_noise_averages_away(follower):
    path = wave(points=60)
    coherent, white = (
        follower.rollout(path, Q0, 200, np.random.default_rng(0), noise=noise).q.std(axis=0)
        for noise in ("coherent", "white")
    )
    assert coherent[-1].mean() > 0.03
    # steps of the coherent deviation hang together
    q = follower.rollout(path, Q0, 200, np.random.default_rng(0)).q
    stray = q - q.mean(axis=0)
    lag = (stray[:, 30:-1] * stray[:, 31:]).mean() / (stray[:, 30:-1] ** 2).mean()
    assert lag > 0.9
    assert white[1].mean() < coherent[20].mean()


def test_a_resting_hand_lets_no_posture_stray(follower):
    start = PlanarChain().arm.forward(Q0)
    still = HandPath.checked(0.04 * np.arange(30), np.tile(start, (30, 1)), None)
    rollout = follower.rollout(still, Q0, 20, np.random.default_rng(0))
    np.testing.assert_allclose(rollout.q, np.broadcast_to(Q0, rollout.q.shape), atol=1e-6)


def test_bands_widen_where_postures_are_unfamiliar(follower):
    path = wave()
    seen = follower.rollout(path, Q0, 0, np.random.default_rng(0)).central
    spread = []
    for centres in (seen, seen + 3.0):
        cover = replace(follower.familiarity, centres=centres, weight=50.0)
        rollout = replace(follower, familiarity=cover).rollout(
            path, Q0, 200, np.random.default_rng(0)
        )
        spread.append(rollout.q[:, -1].std(axis=0))
        assert np.ptp(rollout.familiarity) < 0.01
        assert rollout.familiarity[0] == pytest.approx(float(len(spread) == 1), abs=1e-3)
    assert 2.0 < (spread[1] / spread[0]).mean() < 3.6


def test_joint_limits_hold_and_the_hand_stays(follower):
    free = follower.rollout(wave(), Q0, 40, np.random.default_rng(0))
    limits = JointLimits(np.eye(5), Q0 - 0.35, Q0 + 0.35)
    assert np.abs(free.q - Q0).max() > 0.4
    bound = replace(follower, limits=limits).rollout(wave(), Q0, 40, np.random.default_rng(0))
    ok = bound.followed
    assert ok.mean() > 0.98 and ok[:, :10].all()
    assert np.abs(bound.q[ok] - Q0).max() < 0.351
    assert bound.hand_error_m[ok].max() < 2.1e-3 and bound.hand_error_m[ok].mean() < 1e-4
    touched = np.abs(np.abs(bound.q - Q0) - 0.35) < 1e-4
    assert touched.any()


def test_limits_give_way_to_a_start_that_exceeds_them(follower):
    upper = np.full(5, 4.0)
    upper[0] = Q0[0] - 0.2
    tight = replace(follower, limits=JointLimits(np.eye(5), np.full(5, -4.0), upper))
    rollout = tight.rollout(wave(size=0.05), Q0, 5, np.random.default_rng(0))
    assert rollout.followed.all()
    assert rollout.q[..., 0].max() <= Q0[0] + 1e-5


def test_following_joints_follow(follower):
    reduction = JointReduction(
        follower.reduction.names,
        np.array([0, 1, 2, 4]),
        np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0.5, 0, -0.2, 0], [0, 0, 0, 1.0]]),
    )
    _, demonstrations = planar_demonstrations(seed=3)
    learned = demonstrations.reduced(reduction)
    moment = learned.qdot.T @ learned.qdot / len(learned)
    reduced = replace(
        follower,
        predictor=CovIk.fit(learned, np.random.default_rng(0)),
        reduction=reduction,
        limits=JointLimits(reduction.expansion, np.full(5, -4.0), np.full(5, 4.0)),
        band=PostureBand(0.1 * np.eye(4), 1.0, moment),
        familiarity=Familiarity.of(learned),
    )
    rollout = reduced.rollout(wave(), Q0, 10, np.random.default_rng(0))
    moved = rollout.q - Q0
    np.testing.assert_allclose(moved[..., 3], 0.5 * moved[..., 0] - 0.2 * moved[..., 2], atol=1e-10)
    assert rollout.hand_error_m.max() < 2e-4


def test_out_of_reach_is_said_with_the_point_and_what_is_missing(follower):
    start = PlanarChain().arm.forward(Q0)
    far = start + np.linspace(0, 1.5, 60)[:, None] * np.array([1.0, 0.0])
    path = HandPath.checked(0.05 * np.arange(60), far, None)
    with pytest.raises(UnreachableTrajectoryError) as caught:
        follower.rollout(path, Q0, 5, np.random.default_rng(0))
    reach = 1.35
    first = int(np.argmax(np.linalg.norm(far, axis=1) > reach))
    assert abs(caught.value.index - first) <= 1
    assert caught.value.distance > 0


def test_a_start_that_does_not_meet_the_path_is_said(follower):
    path = wave()
    away = HandPath(path.time_s, path.position + np.array([0.1, 0.0]), None)
    with pytest.raises(StartMismatchError) as caught:
        follower.rollout(away, Q0, 5, np.random.default_rng(0))
    assert caught.value.distance_m == pytest.approx(0.1)
    near = HandPath(path.time_s, path.position + np.array([0.01, 0.0]), None)
    assert follower.rollout(near, Q0, 5, np.random.default_rng(0)).hand_error_m.max() < 2e-4


def test_the_robots_error_moves_the_hand_by_as_much(follower):
    path = wave(points=120)
    rollout = follower.rollout(path, Q0, 100, np.random.default_rng(0), hand_noise=HandNoise(0.004))
    off = PlanarChain().arm.forward(rollout.q) - path.position
    assert off[:, -40:].std() == pytest.approx(0.004, rel=0.15)
    assert rollout.hand_error_m.max() < 3e-4


BAD = {
    "short start": lambda f, p: f.rollout(p, Q0[:4], 2, np.random.default_rng(0)),
    "nan start": lambda f, p: f.rollout(p, Q0 * np.nan, 2, np.random.default_rng(0)),
    "no orientation": lambda f, p: replace(f, task="pose").rollout(
        p, Q0, 2, np.random.default_rng(0)
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_starts_and_paths_are_refused(follower, case):
    with pytest.raises(TrajectoryError):
        BAD[case](follower, wave())
    with pytest.raises(UnsupportedMethodError, match="pink"):
        follower.rollout(wave(), Q0, 2, np.random.default_rng(0), noise="pink")


def test_coarse_steps_are_cut_and_end_where_fine_ones_end(follower):
    fine = follower.rollout(wave(points=81, dt=0.02), Q0, 0, np.random.default_rng(0))
    coarse = follower.rollout(wave(points=9, dt=0.2), Q0, 0, np.random.default_rng(0))
    np.testing.assert_allclose(coarse.central[-1], fine.central[-1], atol=0.02)
    assert len(coarse.time_s) == 9
