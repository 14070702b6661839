import subprocess
import sys

import numpy as np
import pytest

from prediction import TrainingCancelledError
from prediction.laws.kernels import InputScaling
from prediction.laws.null_space import NullSpaceBasis, weighted_solution
from prediction.search.marginal_likelihood import FastEngine
from prediction.search.weight_search import (
    NullSpaceTargets,
    mean_zero_axes,
    search_bipop,
    search_gradient,
)


@pytest.fixture(scope="module")
def problem():
    from planar import planar_demonstrations

    raw, demonstrations = planar_demonstrations(seed=3)
    demonstrations = demonstrations.take(slice(0, 150))
    basis = NullSpaceBasis.around(demonstrations.jacobian)
    targets = NullSpaceTargets(demonstrations, basis)
    scaling = InputScaling.of("separate", demonstrations.q, demonstrations.xdot, 2)
    engine = FastEngine(scaling, demonstrations.q, demonstrations.xdot)
    theta = np.array([0.0, 3.0, -5.0])

    def score(log_weights):
        return np.array([engine.log_likelihood(theta, Y) for Y in targets.many(log_weights)])

    def score_and_slope(log_weights):
        value, _, slope = engine.slopes(theta, targets.one(log_weights))
        return value, targets.pull_back(log_weights, slope)

    return raw, demonstrations, basis, targets, score, score_and_slope


def test_targets_are_the_null_space_part_for_every_candidate(problem, rng):
    _, demonstrations, basis, targets, _, _ = problem
    log_weights = rng.normal(size=(3, 5))
    many = targets.many(log_weights)
    J, u = demonstrations.jacobian, demonstrations.xdot
    V = basis.frame(J).matrix()
    for row, logs in zip(many, log_weights, strict=True):
        rest = demonstrations.qdot - weighted_solution(np.exp(logs), J, u)
        np.testing.assert_allclose(row, np.einsum("tnk,tn->tk", V, rest), atol=1e-11)


def test_gradient_by_log_weights_is_the_derivative(problem, rng):
    *_, score, score_and_slope = problem
    at = 0.5 * rng.normal(size=5)
    _, slope = score_and_slope(at)
    for j in range(5):
        step = 1e-5 * np.eye(5)[j]
        up, down = score(np.stack([at + step, at - step]))
        assert slope[j] == pytest.approx((up - down) / 2e-5, rel=1e-4, abs=1e-6)
    assert slope.sum() == pytest.approx(0.0, abs=1e-7)  # W and c W are the same model


def test_gradient_with_correlations_is_the_derivative_too(problem, rng):
    _, demonstrations, basis, *_ = problem
    root = rng.normal(size=(5, 5))
    moment = root @ root.T + 0.5 * np.eye(5)
    scale = np.sqrt(np.diagonal(moment))
    targets = NullSpaceTargets(demonstrations, basis, moment / scale[:, None] / scale)
    scaling = InputScaling.of("separate", demonstrations.q, demonstrations.xdot, 2)
    engine = FastEngine(scaling, demonstrations.q, demonstrations.xdot)
    theta = np.array([0.0, 3.0, -5.0])
    at = 0.5 * rng.normal(size=5)
    slope = targets.pull_back(at, engine.slopes(theta, targets.one(at))[2])
    for j in range(5):
        step = 1e-5 * np.eye(5)[j]
        up, down = (
            engine.log_likelihood(theta, targets.one(moved)) for moved in (at + step, at - step)
        )
        assert slope[j] == pytest.approx((up - down) / 2e-5, rel=1e-4, abs=1e-6)


def test_mean_zero_axes_leave_out_the_scale(rng):
    axes = mean_zero_axes(6)
    np.testing.assert_allclose(axes.T @ axes, np.eye(5), atol=1e-12)
    np.testing.assert_allclose(axes.sum(axis=0), 0.0, atol=1e-12)


def test_bipop_and_gradient_reach_the_same_optimum_near_the_truth(problem):
    raw, _, _, _, score, score_and_slope = problem
    by_gradient = search_gradient(score_and_slope, np.zeros(5), max_evaluations=200)
    by_bipop = search_bipop(score, np.zeros(5), np.random.default_rng(1), max_evaluations=1200)
    assert by_bipop.score == pytest.approx(by_gradient.score, abs=1e-4)
    assert by_bipop.log_weights.mean() == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(by_bipop.log_weights, by_gradient.log_weights, atol=0.02)
    truth = np.log(raw.law.mobility)
    assert np.std(by_bipop.log_weights - truth) < 0.1
    assert by_bipop.evaluations <= 1200


def test_bipop_is_the_same_for_the_same_generator_and_leaves_the_global_one(problem):
    *_, score, _ = problem
    state = np.random.get_state()[1].copy()
    runs = [
        search_bipop(score, np.zeros(5), np.random.default_rng(5), max_evaluations=100)
        for _ in range(2)
    ]
    np.testing.assert_array_equal(runs[0].log_weights, runs[1].log_weights)
    np.testing.assert_array_equal(np.random.get_state()[1], state)


def test_search_tells_its_progress_and_stops_when_asked(problem):
    *_, score, score_and_slope = problem
    told = []
    search_bipop(
        score,
        np.zeros(5),
        np.random.default_rng(5),
        max_evaluations=60,
        progress=lambda what, done, likelihood: told.append((done, likelihood)),
    )
    assert [t[0] for t in told] == sorted(t[0] for t in told)
    assert [t[1] for t in told] == sorted(t[1] for t in told)
    with pytest.raises(TrainingCancelledError):
        search_bipop(
            score,
            np.zeros(5),
            np.random.default_rng(5),
            max_evaluations=60,
            should_stop=lambda: True,
        )
    with pytest.raises(TrainingCancelledError):
        search_gradient(score_and_slope, np.zeros(5), max_evaluations=60, should_stop=lambda: True)


def test_a_search_says_nothing_of_plots_nobody_asked_for() -> None:
    code = (
        "import sys, warnings; sys.modules['matplotlib'] = None; warnings.simplefilter('error');"
        "from prediction.search.weight_search import optimiser; optimiser()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
