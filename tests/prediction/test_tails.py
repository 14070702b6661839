"""Held-out motion may have heavier tails than a Gaussian law."""

import json
from dataclasses import replace

import numpy as np
import pytest
from planar import planar_demonstrations
from scipy.stats import multivariate_t

from prediction import CovIk, MiNsGp
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
