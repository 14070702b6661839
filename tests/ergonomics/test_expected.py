from dataclasses import replace

import numpy as np
import pytest

from ergonomics import (
    PostureError,
    RulaInputs,
    ScoreDistribution,
    ScoringRules,
    UnmeasuredError,
    reba_pmf,
    rula_pmf,
    score_distribution,
    score_reba,
    score_rula,
)

from .random_postures import random_reba, random_rula

_METHODS = {
    "rula": (random_rula, score_rula, rula_pmf),
    "reba": (random_reba, score_reba, reba_pmf),
}
_BOTH = pytest.mark.parametrize("method", list(_METHODS))


@_BOTH
@pytest.mark.parametrize("profile", ["paper", "worksheet"])
@pytest.mark.parametrize("ties", ["lower", "higher"])
@pytest.mark.parametrize("tolerance", [0.0, 5.0])
def test_without_noise_it_is_the_plain_score(method, profile, ties, tolerance):
    make, score, pmf = _METHODS[method]
    rules = ScoringRules(profile, ties, tolerance)
    inputs = make(np.random.default_rng(1), 3_000)
    distribution = pmf(inputs, 0.0, rules)
    finals = score(inputs, rules).final
    chosen = np.take_along_axis(distribution.pmf, finals[:, None].astype(int) - 1, axis=1)
    np.testing.assert_array_equal(chosen, 1.0)
    np.testing.assert_allclose(distribution.expected, finals)


@_BOTH
def test_small_noise_tends_to_the_plain_score(method):
    make, score, pmf = _METHODS[method]
    inputs = make(np.random.default_rng(2), 2_000)
    # Off the edges by construction: on an edge the limit is half of each side.
    shifted = {k: a + 0.137 for k, a in inputs.arrays().items() if k.endswith("_deg")}
    inputs = replace(inputs, **shifted)
    finals = score(inputs).final
    gaps = [np.abs(pmf(inputs, s).expected - finals).mean() for s in (3.0, 0.3, 0.03)]
    assert gaps[0] > gaps[1] > gaps[2]
    assert gaps[2] < 0.01


@_BOTH
@pytest.mark.parametrize("sigma", [2.0, 8.0])
def test_monte_carlo_agrees_with_the_closed_form(method, sigma):
    make, score, pmf = _METHODS[method]
    rng = np.random.default_rng(3)
    inputs = make(rng, 40)
    samples = 40_000
    noisy = {
        name: array + sigma * rng.standard_normal((samples, 40))
        for name, array in inputs.arrays().items()
        if name.endswith("_deg")
    }
    sampled = score_distribution(score(replace(inputs, **noisy)).final, method)
    exact = pmf(inputs, sigma)
    assert np.abs(sampled.pmf - exact.pmf).max() < 0.01
    np.testing.assert_allclose(exact.pmf.sum(axis=-1), 1.0, atol=1e-12)


@_BOTH
def test_deviation_by_field_moves_only_that_field(method):
    make, _, pmf = _METHODS[method]
    inputs = make(np.random.default_rng(4), 300)
    alone = pmf(inputs, {"trunk_deg": 10.0})
    same = pmf(inputs, {"trunk_deg": np.full(300, 10.0), "neck_deg": 0.0})
    np.testing.assert_array_equal(alone.pmf, same.pmf)
    assert np.abs(alone.pmf - pmf(inputs, 10.0).pmf).max() > 0.1


def test_expected_score_is_smooth_where_the_score_jumps():
    sweep = RulaInputs(15.0, 80.0, 0.0, 15.0, np.linspace(-30, 90, 2401))
    jumps = np.abs(np.diff(rula_pmf(sweep, 3.0).expected))
    assert jumps.max() < 0.02
    assert np.abs(np.diff(score_rula(sweep).final.astype(int))).max() >= 1


@pytest.mark.parametrize("sigma", [-1.0, float("nan"), {"elbow": 1.0}])
def test_bad_deviation_is_refused(sigma):
    with pytest.raises(PostureError, match="sigma_deg"):
        rula_pmf(random_rula(np.random.default_rng(6), 2), sigma)


def test_unmeasured_part_is_refused():
    hidden = replace(random_rula(np.random.default_rng(7), 2), unmeasured=frozenset({"wrist"}))
    with pytest.raises(UnmeasuredError):
        rula_pmf(hidden, 1.0)


def test_distribution_of_samples():
    finals = np.array([[1, 3], [1, 4], [2, 4], [7, 4]])
    distribution = score_distribution(finals)
    np.testing.assert_allclose(distribution.pmf[0], [0.5, 0.25, 0, 0, 0, 0, 0.25])
    np.testing.assert_allclose(distribution.expected, finals.mean(axis=0))
    np.testing.assert_allclose(distribution.at_least(4), [0.25, 0.75])
    assert distribution.quantile(0.5).tolist() == [1, 4]
    assert distribution.quantile(0.95).tolist() == [7, 4]
    assert score_distribution(np.full((3, 2), 15), "reba").pmf[..., -1].tolist() == [1.0, 1.0]


def test_quantile_survives_rounding_of_the_sum():
    spread = ScoreDistribution((1, 2, 3), np.array([0.1 + 0.2, 0.7 - 1e-17, 0.0]))
    assert spread.quantile(0.999_999_999_999_99) == 2


@pytest.mark.parametrize("finals", [np.empty((0, 3)), np.array(3), np.array([0, 1]), np.array([8])])
def test_what_is_no_score_is_refused(finals):
    with pytest.raises(PostureError, match="finals"):
        score_distribution(finals)


@pytest.mark.parametrize("probability", [0.0, 1.0, -0.1])
def test_quantile_refuses_its_ends(probability):
    with pytest.raises(PostureError, match="probability"):
        score_distribution(np.array([1, 2])).quantile(probability)
