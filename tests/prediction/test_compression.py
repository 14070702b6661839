import numpy as np
import pytest

from prediction.laws.compression import compressed_posterior, exact_posterior, pivoted_centres
from prediction.laws.kernels import InputScaling, squared_exponential


@pytest.fixture(scope="module")
def data():
    rng = np.random.default_rng(2)
    inputs = rng.normal(size=(300, 3)) * 0.7
    targets = np.stack([np.sin(inputs.sum(1)), np.cos(inputs[:, 0])], axis=1)
    return inputs, targets + 0.05 * rng.normal(size=targets.shape), rng.normal(size=(200, 3)) * 0.7


def test_exact_posterior_is_textbook_conditioning(data):
    inputs, targets, at = data
    posterior = exact_posterior(inputs, targets, 0.01)
    A = np.linalg.inv(squared_exponential(inputs, inputs) + 0.01 * np.eye(300))
    k = squared_exponential(at, inputs)
    np.testing.assert_allclose(posterior.mean(at), k @ A @ targets, atol=1e-8)
    expected = 1.0 - np.einsum("ij,jk,ik->i", k, A, k)
    np.testing.assert_allclose(posterior.variance(at), expected, atol=1e-8)


def test_few_centres_say_nearly_the_same(data):
    inputs, targets, at = data
    exact = exact_posterior(inputs, targets, 0.01)
    few = compressed_posterior(inputs, targets, 0.01, at_most=120, tolerance=1e-5)
    assert len(few.centres) <= 120
    deviation = np.sqrt(exact.variance(at) + 0.01)
    error = np.abs(few.mean(at) - exact.mean(at)) / deviation[:, None]
    assert np.sqrt((error**2).mean()) < 0.05
    assert np.abs(few.variance(at) - exact.variance(at)).max() < 0.02


def test_more_centres_are_closer(data):
    inputs, targets, at = data
    exact = exact_posterior(inputs, targets, 0.01).mean(at)
    errors = [
        np.abs(compressed_posterior(inputs, targets, 0.01, at_most=m).mean(at) - exact).mean()
        for m in (15, 40, 120)
    ]
    assert errors[0] > errors[1] > errors[2]


def test_all_inputs_as_centres_is_the_exact_posterior(data):
    inputs, targets, at = data
    spread = 10.0 * inputs[:40]
    full = compressed_posterior(spread, targets[:40], 0.1, tolerance=0.0)
    np.testing.assert_allclose(full.mean(at), exact_posterior(spread, targets[:40], 0.1).mean(at))


def test_pivots_stop_at_the_tolerance(data):
    inputs = np.repeat(data[0][:20], 5, axis=0)
    chosen = pivoted_centres(inputs, 100, 1e-6)
    assert len(chosen) <= 20
    assert len(np.unique(inputs[chosen], axis=0)) == len(chosen)


@pytest.mark.parametrize("kind", ["separate", "paper"])
def test_input_scaling_is_free_of_units(kind, rng):
    q, xdot = rng.normal(size=(50, 4)), rng.normal(size=(50, 3))
    theta = np.array([0.2, 0.7][: 2 if kind == "separate" else 1])
    scaled = InputScaling.of(kind, q, xdot, 3).inputs(q, xdot, theta)
    other = InputScaling.of(kind, 60 * q, 1000 * xdot, 3).inputs(60 * q, 1000 * xdot, theta)
    np.testing.assert_allclose(scaled, other)


def test_still_joints_do_not_dominate_the_distance(rng):
    q, xdot = rng.normal(size=(50, 2)) * np.array([1.0, 1e-3]), rng.normal(size=(50, 3))
    near, far = np.zeros((1, 2)), np.array([[0.0, 2e-3]])
    scaling = InputScaling.of("separate", q, xdot, 3)
    zero = np.zeros((1, 3))
    a, b = (scaling.inputs(x, zero, np.zeros(2)) for x in (near, far))
    assert squared_exponential(a, b)[0, 0] > 0.999
