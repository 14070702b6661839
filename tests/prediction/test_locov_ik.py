"""The posture-local covariance: what it is near data, far from data, and as a density."""

from dataclasses import replace

import numpy as np
import pytest
from planar import planar_demonstrations
from scipy.stats import multivariate_t

from prediction import CovIk, LoCovIk
from prediction.laws.null_space import weighted_solution
from prediction.laws.student_t import scatter, student_t_log_density


@pytest.fixture(scope="module")
def demonstrations():
    return planar_demonstrations(seed=3)[1]


@pytest.fixture(scope="module")
def fitted(demonstrations):
    return LoCovIk.fit(demonstrations, np.random.default_rng(0))


def test_far_from_everything_it_is_cov_ik(fitted, demonstrations):
    some = demonstrations.take(slice(0, 5))
    plain = CovIk.fit(demonstrations, np.random.default_rng(0))
    far = fitted.predict(some.q + 100.0, some.xdot, some.jacobian).mean
    expected = plain.predict(some.q, some.xdot, some.jacobian).mean
    np.testing.assert_allclose(far, expected, atol=1e-10)
    near = fitted.predict(some.q, some.xdot, some.jacobian).mean
    assert np.abs(near - expected).max() > 1e-3


def test_near_data_it_moves_as_people_moved_there(demonstrations, rng):
    """Two places, in each of which another pair of joints does the work."""
    half = len(demonstrations) // 2
    q, qdot = demonstrations.q.copy(), rng.normal(size=demonstrations.qdot.shape)
    q[:half], q[half:] = 0.3, -0.3
    q += 0.01 * rng.normal(size=q.shape)
    qdot[:half, 3:] *= 0.05
    qdot[half:, :2] *= 0.05
    two = replace(demonstrations, q=q, qdot=qdot)
    model = LoCovIk.fit(two, rng)
    J, xdot = demonstrations.jacobian[:1], np.array([[0.1, 0.05]])
    for centre, busy, idle in ((0.3, slice(0, 3), slice(3, 5)), (-0.3, slice(2, 5), slice(0, 2))):
        posture = np.full((1, 5), centre)
        local = np.einsum("t,ti,tj->ij", two.q[:, 0] * centre > 0, qdot, qdot)
        np.testing.assert_allclose(
            model.weights_at(posture)[0] / np.trace(model.weights_at(posture)[0]),
            local / np.trace(local),
            atol=0.15,
        )
        mean = model.predict(posture, xdot, J).mean[0]
        assert np.linalg.norm(mean[busy]) > 3.0 * np.linalg.norm(mean[idle])


def test_density_is_that_of_the_whole_t_split_at_the_hand(fitted, demonstrations):
    """With S = Q everywhere the three terms must add up to the multivariate t of dq."""
    some = demonstrations.take(slice(0, 30))
    Q = fitted.scatter
    model = replace(fitted, fallback=Q, prior_count=1e15)
    parts = model.log_prob(some.q, some.xdot, some.qdot, some.jacobian, np.eye(2))
    for i, J in enumerate(some.jacobian):
        hand = multivariate_t(np.zeros(2), J @ Q @ J.T, df=model.degrees).logpdf(some.xdot[i])
        whole = multivariate_t(np.zeros(5), Q, df=model.degrees).logpdf(some.qdot[i])
        found = hand + parts.null_space[i] + parts.volume[i]
        assert found == pytest.approx(whole, abs=1e-8)


def test_t_density_and_scatter_are_those_of_samples(rng):
    shape = np.array([[2.0, 0.5, 0.0], [0.5, 1.0, -0.3], [0.0, -0.3, 0.5]])
    samples = multivariate_t(np.zeros(3), shape, df=4, seed=5).rvs(40_000)
    np.testing.assert_allclose(scatter(samples, 4.0), shape, atol=0.05)
    expected = multivariate_t(np.zeros(3), shape, df=4).logpdf(samples[:20])
    np.testing.assert_allclose(student_t_log_density(samples[:20], 2.0 * shape, 4.0), expected)


def test_held_out_score_does_not_see_the_block_it_scores(demonstrations, fitted):
    """One outlying velocity in a block must not teach the local covariance of that block."""
    from prediction.laws.locov_ik import _HeldOut

    search = _HeldOut(demonstrations)
    block = demonstrations.blocks(4)[1]
    assert not search.apart[np.ix_(block, block)].any()
    assert search.apart[np.ix_(block, ~block)].all()
    y = demonstrations.qdot - weighted_solution(
        fitted.weights_at(demonstrations.q), demonstrations.jacobian, demonstrations.xdot
    )
    np.testing.assert_allclose(np.einsum("tmn,tn->tm", demonstrations.jacobian, y), 0.0, atol=1e-12)
