import numpy as np
import pytest
from scipy.stats import chi, norm

from estimation import MeasurementError, norm_quantiles

PROBABILITIES = (0.05, 0.25, 0.5, 0.75, 0.95)


@pytest.mark.parametrize("length", [0.0, 0.5, 2.0, 2.6, 3.5, 6.0, 13.0, 300.0])
def test_quantiles_are_those_of_many_draws(length):
    rng = np.random.default_rng(4)
    half = rng.normal(size=(3, 3))
    covariance = half @ half.T
    covariance /= np.trace(covariance)
    mean = length * np.array([0.6, -0.64, 0.48])
    draws = mean + rng.normal(size=(400_000, 3)) @ np.linalg.cholesky(covariance).T
    true = np.quantile(np.linalg.norm(draws, axis=1), PROBABILITIES)
    np.testing.assert_allclose(norm_quantiles(mean, covariance, PROBABILITIES), true, atol=0.025)


def test_about_zero_they_are_those_of_the_chi_distribution():
    found = norm_quantiles(np.zeros((2, 3)), np.eye(3) * np.ones((2, 1, 1)), PROBABILITIES)
    assert found.shape == (2, 5)
    np.testing.assert_allclose(found[1], chi(3).ppf(PROBABILITIES), atol=0.03)


def test_a_covariance_may_be_singular():
    covariance = np.diag([0.0, 0.0, 1.0])
    found = norm_quantiles([0.0, 0.0, 5.0], covariance, PROBABILITIES)
    np.testing.assert_allclose(found, 5.0 + norm.ppf(PROBABILITIES), atol=0.02)
    exact = norm_quantiles([3.0, 4.0, 0.0], np.zeros((3, 3)), PROBABILITIES)
    np.testing.assert_allclose(exact, 5.0)
    np.testing.assert_allclose(norm_quantiles(np.zeros(3), np.zeros((3, 3)), [0.5]), 0.0)


def test_only_probabilities_are_taken():
    with pytest.raises(MeasurementError, match="between zero and one"):
        norm_quantiles(np.zeros(3), np.eye(3), [0.0])
