"""Held-out motion may have heavier tails than a Gaussian law."""

import json
from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations
from scipy.stats import multivariate_t

from prediction import (
    CovIk,
    LoCovIk,
    MiNsGp,
    TrainingOptions,
    demonstrations_from_samples,
    score_method,
    train_operator,
)
from prediction.laws.student_t import most_likely_tails


@pytest.mark.parametrize("degrees", [3.0, 6.0])
def test_tails_of_a_known_law_are_recovered(degrees):
    samples = multivariate_t(np.zeros(3), np.eye(3), df=degrees, seed=2).rvs(20_000)
    found, factor = most_likely_tails(2.0 * samples)
    assert found == degrees
    assert factor == pytest.approx(4.0 * degrees / (degrees - 2.0), rel=0.05)


def test_a_gaussian_has_none_and_the_plain_factor(rng):
    samples = 3.0 * rng.standard_normal((5_000, 4))
    assert most_likely_tails(samples, ()) == (np.inf, pytest.approx((samples**2).mean()))
    found, factor = most_likely_tails(samples)
    assert found >= 20.0 and factor == pytest.approx(9.0, rel=0.02)


@pytest.fixture(scope="module")
def law():
    demonstrations = planar_demonstrations(seed=3, samples=80)[1]
    model = MiNsGp.fit(
        demonstrations, np.random.default_rng(0), optimizer="gradient", max_evaluations=40
    )
    return model, demonstrations


def test_density_with_tails_is_the_t_of_the_same_covariance(law):
    model, some = law
    q, xdot, J = some.q, some.xdot, some.jacobian
    strayed = some.qdot + 0.3 * np.random.default_rng(1).normal(size=some.qdot.shape)
    tailed = model.rescaled(1.7).with_tails(4.0)
    parts = tailed.log_prob(q, xdot, strayed, J, np.eye(2))
    frame = tailed.basis.frame(J)
    covariance = tailed.null_covariance(q, np.einsum("tmn,tn->tm", J, strayed), frame, J)
    residual = frame.coordinates(tailed.null_residual(q, strayed, J))
    for i in range(0, 80, 8):
        expected = multivariate_t(np.zeros(3), covariance[i] * 0.5, df=4.0).logpdf(residual[i])
        assert parts.null_space[i] == pytest.approx(expected, abs=1e-8)
    a, b = (m.predict(q, xdot, J) for m in (tailed, model.rescaled(1.7)))
    np.testing.assert_array_equal(a.mean, b.mean)
    np.testing.assert_array_equal(a.null_factor, b.null_factor)
    # what a Gaussian calls impossible, tails call rare
    far = replace(some, qdot=some.qdot + 3.0)
    ours, plain = (
        m.log_prob(q, far.xdot, far.qdot, J, np.eye(2)).null_space.mean()
        for m in (tailed, model.rescaled(1.7))
    )
    assert ours > plain + 50.0


def test_tails_are_kept_with_the_model(law):
    for degrees in (4.0, np.inf):
        arrays, values = law[0].with_tails(degrees).to_arrays()
        again = MiNsGp.from_arrays(arrays, json.loads(json.dumps(values, allow_nan=False)))
        assert again.degrees == degrees


def test_methods_that_fit_no_tails_stay_as_they_are(law):
    plain = CovIk.fit(law[1], np.random.default_rng(0))
    assert plain.with_tails(3.0) is plain and not plain.fits_tails


@pytest.mark.parametrize("name", ["mi-nsgp", "locov-ik", "cov-ik"])
def test_the_one_step_interval_is_that_of_the_law(law, name, rng):
    """Of joint velocities drawn from a method's own law, tails and all, 90 % are inside."""
    fitted, some = law
    heavy = fitted.with_tails(3.0)
    if name != "mi-nsgp":
        heavy = {"locov-ik": LoCovIk, "cov-ik": CovIk}[name].fit(some, rng)
    degrees = {"mi-nsgp": 3.0, "cov-ik": np.inf}.get(name)
    if name == "locov-ik":
        heavy = replace(heavy, degrees=2.0)
        degrees = 4.0  # two rows of the hand are known
    options = TrainingOptions(method="cov-ik", tasks=("position",), blocks=2)
    model = train_operator(PlanarChain(), some, seed=0, options=options)
    only = replace(model.fitted(task="position"), predictor=heavy, memory=None)
    model = replace(model, methods={(name, "position"): only}, method=name)

    again = np.tile(np.arange(len(some)), 60)
    q, xdot, J = some.q[again], some.xdot[again], some.jacobian[again]
    wide = np.ones(len(again))
    if np.isfinite(degrees):
        wide = np.sqrt((degrees - 2.0) / rng.chisquare(degrees, len(again)))
    told = heavy.predict(q, xdot, J)
    kick = (told.null_factor @ rng.standard_normal((len(again), 3, 1)))[..., 0]
    drawn = demonstrations_from_samples(
        PlanarChain(),
        q,
        told.mean + wide[:, None] * kick,
        np.zeros(len(again)),
        np.arange(len(again)),
    )
    score = score_method(model, name, drawn, rng, task="position", chain=PlanarChain())
    assert score.coverage90_one_step == pytest.approx(0.9, abs=0.012)
