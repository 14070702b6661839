"""Postures settle within limits, hand on target, by the least movement in the proportions W."""

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, minimize

from prediction import JointLimits
from prediction.following.joint_limits import settle

COUNT, JOINTS, ROWS, RANGE = 200, 6, 3, 0.02


@pytest.fixture(scope="module")
def settled():
    """Linear hands, whose targets are reached with most joints close to a limit."""
    rng = np.random.default_rng(0)
    jacobian = rng.normal(size=(COUNT, ROWS, JOINTS))
    weights = np.exp(rng.normal(size=JOINTS))
    answer = rng.uniform(-1, 1, size=(COUNT, JOINTS))
    answer = RANGE * np.sign(answer) * np.abs(answer) ** 0.25
    target = np.einsum("bmn,bn->bm", jacobian, answer)

    def residual(q, rows):
        return target[rows] - np.einsum("bmn,bn->bm", jacobian[rows], q), jacobian[rows]

    bound = np.full(JOINTS, RANGE)
    limits = JointLimits(np.eye(JOINTS), -bound, bound)
    none = np.zeros((COUNT, JOINTS))
    q, done = settle(none, none, limits, weights, residual, np.full(ROWS, 1e-9))
    return q, done, jacobian, weights, answer, target


def test_every_hand_that_can_be_reached_is_reached_within_limits(settled):
    q, done, jacobian, _, _, target = settled
    assert done.all() and np.abs(q).max() < RANGE + 1e-6
    np.testing.assert_allclose(np.einsum("bmn,bn->bm", jacobian, q), target, atol=1e-9)
    assert (np.abs(q) > RANGE - 1e-6).any(axis=1).mean() > 0.5


def test_movement_is_the_least_in_the_proportions_of_the_weights(settled):
    """Against a solver of the whole problem; a joint let go leaves its trace in a few."""
    q, _, jacobian, weights, answer, target = settled
    ratio = []
    for b in range(0, COUNT, 5):
        best = minimize(
            lambda x: (x**2 / weights).sum() / RANGE**2,
            answer[b],
            jac=lambda x: 2.0 * x / weights / RANGE**2,
            bounds=[(-RANGE, RANGE)] * JOINTS,
            constraints=LinearConstraint(jacobian[b], target[b], target[b]),
            method="SLSQP",
            options={"ftol": 1e-12},
        )
        ratio.append((q[b] ** 2 / weights).sum() / (best.fun * RANGE**2))
    assert np.mean(np.array(ratio) < 1.001) > 0.85 and np.max(ratio) < 1.7
