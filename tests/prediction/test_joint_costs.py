import json
from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from prediction import JointReduction, TrainingOptions, joint_costs, train_operator
from prediction.laws.null_space import weighted_solution


@pytest.fixture(scope="module")
def models():
    demonstrations = planar_demonstrations(seed=3, samples=120)[1]
    return {
        method: train_operator(
            PlanarChain(),
            demonstrations,
            seed=1,
            options=TrainingOptions(method=method, tasks=("position",), weights="diagonal"),
        )
        for method in ("mi-nsgp", "locov-ik")
    }


def damped_ik(cost, jacobian, xdot):
    """What an IK library solves: a heavy task for the hand, and damping ``|diag(cost) dq|^2``."""
    heavy = 1e3
    H = heavy**2 * jacobian.T @ jacobian + np.diag(cost**2)
    return np.linalg.solve(H, heavy**2 * jacobian.T @ xdot)


def test_ik_with_the_costs_follows_the_hand_as_the_learned_weights_do(models, rng):
    costs = joint_costs(models["mi-nsgp"], task="position")
    assert costs.exact and costs.method == "mi-nsgp"
    values = np.array([costs.cost[name] for name in PlanarChain().dof_names])
    assert np.prod(values) == pytest.approx(1.0)
    W = models["mi-nsgp"].fitted("mi-nsgp", "position").predictor.weights
    for _ in range(5):
        jacobian, xdot = rng.normal(size=(2, 5)), rng.normal(size=2)
        expected = weighted_solution(W, jacobian, xdot)
        np.testing.assert_allclose(damped_ik(values, jacobian, xdot), expected, atol=1e-4)
    assert json.loads(json.dumps(costs.to_dict()))["cost"] == costs.cost


def test_what_costs_cannot_say_is_said(models):
    model = models["locov-ik"]
    far = joint_costs(model, task="position")
    assert not far.exact
    assert any("far from all" in note for note in far.notes)
    assert any("correlations" in note for note in far.notes)
    q = planar_demonstrations(seed=3, samples=120)[1].q[7]
    near = joint_costs(model, task="position", q=q)
    assert not any("far from all" in note for note in near.notes)
    W = model.fitted("locov-ik", "position").predictor.weights_at(q)
    ratio = np.array(list(near.cost.values())) ** 2 * np.diagonal(W)
    np.testing.assert_allclose(ratio, ratio[0])
    assert near.cost != far.cost


def test_joints_that_were_not_learned_are_named(models):
    model = models["mi-nsgp"]
    expansion = np.zeros((7, 5))
    expansion[:5] = np.eye(5)
    expansion[6, 1] = 0.5
    reduction = JointReduction((*model.joint_names, "locked", "mixed"), np.arange(5), expansion)
    costs = joint_costs(replace(model, reduction=reduction), task="position")
    assert costs.held == ("locked",) and costs.coupled == {"mixed": {"two": 0.5}}
    assert set(costs.cost) == set(model.joint_names)
