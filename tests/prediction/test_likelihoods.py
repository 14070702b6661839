"""Both likelihoods against brute force, gpytorch and finite differences."""

import gpytorch
import numpy as np
import pytest
import torch
from scipy.stats import multivariate_normal, norm

from prediction.laws.kernels import InputScaling, squared_exponential
from prediction.laws.null_space import NullSpaceBasis
from prediction.search.gpytorch_engine import GpytorchEngine
from prediction.search.held_out_likelihood import HeldOutEngine
from prediction.search.in_sample import InSampleEngine
from prediction.search.marginal_likelihood import FastEngine, optimise_kernel, theta_bounds
from prediction.search.weight_search import NullSpaceTargets


@pytest.fixture(scope="module", params=["separate", "paper"])
def problem(request):
    from planar import planar_demonstrations

    demonstrations = planar_demonstrations(seed=3)[1].take(slice(0, 60))
    scaling = InputScaling.of(request.param, demonstrations.q, demonstrations.xdot, 2)
    basis = NullSpaceBasis.around(demonstrations.jacobian)
    Y = NullSpaceTargets(demonstrations, basis).one(np.zeros(5))
    theta = np.append([0.3, 1.2][: scaling.scales], -2.0)
    return scaling, demonstrations, Y, theta


def brute_force(scaling, demonstrations, Y, theta, mean, S):
    inputs = scaling.inputs(demonstrations.q, demonstrations.xdot, theta[:-1])
    K = squared_exponential(inputs, inputs) + np.exp(theta[-1]) * np.eye(len(Y))
    law = multivariate_normal(np.kron(mean, np.ones(len(Y))), np.kron(S, K))
    return law.logpdf(Y.T.ravel()) / len(Y)


def test_marginal_likelihood_is_that_of_the_kronecker_gaussian_at_its_best(problem, rng):
    scaling, demonstrations, Y, theta = problem
    engine = FastEngine(scaling, demonstrations.q, demonstrations.xdot)
    K = engine.gram(theta) + np.exp(theta[-1]) * np.eye(len(Y))
    A = np.linalg.inv(K)
    mean = Y.T @ A.sum(axis=1) / A.sum() if scaling.kind == "paper" else np.zeros(3)
    S = (Y - mean).T @ A @ (Y - mean) / len(Y)
    best = brute_force(scaling, demonstrations, Y, theta, mean, S)
    assert engine.log_likelihood(theta, Y) == pytest.approx(best, abs=1e-10)
    for _ in range(5):
        moved = 0.01 * rng.normal(size=3) if scaling.kind == "paper" else 0.0
        other = brute_force(scaling, demonstrations, Y, theta, mean + moved, S * 1.1)
        assert other < best


def test_fast_and_gpytorch_agree(problem):
    scaling, demonstrations, Y, theta = problem
    fast = FastEngine(scaling, demonstrations.q, demonstrations.xdot)
    slow = GpytorchEngine(scaling, demonstrations.q, demonstrations.xdot)
    for shift in (-1.0, 0.0, 1.5):
        assert fast.log_likelihood(theta + shift, Y) == pytest.approx(
            slow.log_likelihood(theta + shift, Y), abs=1e-8
        )


def test_one_output_equals_a_plain_gpytorch_model(problem):
    """The whole of gpytorch's own machinery, so that the reference engine is checked as well."""
    scaling, demonstrations, Y, theta = problem
    y = Y[:, :1]
    inputs = torch.tensor(scaling.inputs(demonstrations.q, demonstrations.xdot, theta[:-1]))
    engine = FastEngine(scaling, demonstrations.q, demonstrations.xdot)
    A = np.linalg.inv(engine.gram(theta) + np.exp(theta[-1]) * np.eye(len(y)))
    mean = float(A.sum(axis=1) @ y[:, 0] / A.sum()) if scaling.kind == "paper" else 0.0
    S = float((y[:, 0] - mean) @ A @ (y[:, 0] - mean) / len(y))

    class Model(gpytorch.models.ExactGP):
        def __init__(self, likelihood):
            super().__init__(inputs, torch.tensor(y[:, 0]), likelihood)
            self.mean_module = gpytorch.means.ConstantMean()
            self.covar_module = gpytorch.kernels.ScaleKernel(gpytorch.kernels.RBFKernel())

        def forward(self, x):
            return gpytorch.distributions.MultivariateNormal(
                self.mean_module(x), self.covar_module(x)
            )

    likelihood = gpytorch.likelihoods.GaussianLikelihood(
        noise_constraint=gpytorch.constraints.GreaterThan(1e-12)
    ).double()
    model = Model(likelihood).double()
    model.mean_module.constant = torch.tensor(mean)
    model.covar_module.outputscale = S
    model.covar_module.base_kernel.lengthscale = 1.0
    likelihood.noise = S * np.exp(theta[-1])
    model.train()
    likelihood.train()
    mll = gpytorch.mlls.ExactMarginalLogLikelihood(likelihood, model)
    with torch.no_grad(), gpytorch.settings.fast_computations(False, False, False):
        expected = float(mll(model(inputs), torch.tensor(y[:, 0])))
    assert engine.log_likelihood(theta, y) == pytest.approx(expected, abs=1e-8)


def test_scorer_profiles_the_noise_and_is_the_likelihood_there(problem):
    scaling, demonstrations, Y, theta = problem
    engine = FastEngine(scaling, demonstrations.q, demonstrations.xdot)
    scores = engine.scorer(theta).scores(np.stack([Y, 2.0 * Y]))
    steps = np.linspace(-3.0, 3.0, 13)
    for score, target in zip(scores, (Y, 2.0 * Y), strict=True):
        tried = [
            engine.log_likelihood(np.append(theta[:-1], theta[-1] + step), target) for step in steps
        ]
        assert score == pytest.approx(max(tried), abs=1e-9)


def engines(problem):
    scaling, demonstrations, _, _ = problem
    parts = demonstrations.blocks(5)
    return {
        "fast": FastEngine(scaling, demonstrations.q, demonstrations.xdot),
        "gpytorch": GpytorchEngine(scaling, demonstrations.q, demonstrations.xdot),
        "held-out": HeldOutEngine(scaling, demonstrations.q, demonstrations.xdot, parts),
    }


@pytest.mark.parametrize("name", ["fast", "gpytorch", "held-out"])
def test_slopes_are_the_derivatives(problem, rng, name):
    _, _, Y, theta = problem
    engine = engines(problem)[name]
    value, by_theta, by_Y = engine.slopes(theta, Y)
    assert value == pytest.approx(engine.log_likelihood(theta, Y), abs=1e-9)
    for j, slope in enumerate(by_theta):
        step = 1e-5 * np.eye(len(theta))[j]
        up, down = (engine.log_likelihood(theta + s, Y) for s in (step, -step))
        assert slope == pytest.approx((up - down) / 2e-5, rel=1e-5, abs=1e-7)
    step = 1e-6 * rng.normal(size=Y.shape)
    up, down = (engine.log_likelihood(theta, Y + s) for s in (step, -step))
    assert (by_Y * step).sum() == pytest.approx((up - down) / 2, rel=1e-5)


@pytest.mark.parametrize("name", ["fast", "gpytorch", "held-out"])
def test_optimising_the_kernel_ends_where_the_slope_does(problem, name):
    _, _, Y, theta = problem
    engine = engines(problem)[name]
    found = optimise_kernel(engine, theta, Y, 60)
    value, slope, _ = engine.slopes(found, Y)
    assert value > engine.log_likelihood(theta, Y)
    low, high = np.transpose(theta_bounds(engine, len(theta)))
    free = (found > low + 1e-9) & (found < high - 1e-9)
    assert np.abs(slope[free]).max(initial=0.0) < 1e-3
    # at a bound the slope points out of it
    assert (slope[found <= low + 1e-9] <= 0).all() and (slope[found >= high - 1e-9] >= 0).all()


def test_in_sample_score_is_the_density_the_fitted_process_gives_its_own_samples(problem, rng):
    scaling, demonstrations, Y, theta = problem
    targets = np.stack([Y, Y + 0.05 * rng.normal(size=Y.shape)])
    engine = InSampleEngine(scaling, demonstrations.q, demonstrations.xdot)
    K, noise = engine.gram(theta), np.exp(theta[-1])
    A = np.linalg.inv(K + noise * np.eye(len(Y)))
    for target, score in zip(targets, engine.scorer(theta).scores(targets), strict=True):
        mean = target.T @ A.sum(axis=1) / A.sum() if scaling.kind == "paper" else np.zeros(3)
        rest = target - mean
        variance = np.diagonal(K - K @ A @ K) + noise
        scale = np.einsum("tj,ts,sj->j", rest, A, rest) / len(Y)
        missed = rest - K @ A @ rest
        law = norm(0.0, np.sqrt(variance[:, None] * scale))
        assert score == pytest.approx(law.logpdf(missed).sum(axis=1).mean(), abs=1e-9)


def test_held_out_density_is_that_of_predicting_each_part_from_the_rest(problem):
    scaling, demonstrations, Y, theta = problem
    engine = engines(problem)["held-out"]
    inputs = scaling.inputs(demonstrations.q, demonstrations.xdot, theta[:-1])
    noise = np.exp(theta[-1])
    errors, variances = np.empty_like(Y), np.empty(len(Y))
    for part in demonstrations.blocks(5):
        K = squared_exponential(inputs[~part], inputs[~part]) + noise * np.eye((~part).sum())
        A = np.linalg.inv(K)
        k = squared_exponential(inputs[part], inputs[~part])
        errors[part] = Y[part] - k @ A @ Y[~part]
        variances[part] = 1.0 + noise - np.einsum("ij,jk,ik->i", k, A, k)
    S = (errors / variances[:, None]).T @ errors / len(Y)
    density = [
        multivariate_normal(np.zeros(3), v * S).logpdf(e)
        for e, v in zip(errors, variances, strict=True)
    ]
    assert engine.log_likelihood(theta, Y) == pytest.approx(np.mean(density), abs=1e-9)
