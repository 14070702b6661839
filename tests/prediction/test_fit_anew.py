"""What a held-out part is predicted by must not have been searched on it."""

from dataclasses import replace

import numpy as np
import pytest
from planar import planar_demonstrations

from prediction import CcGp, CovIk, MiNsGp, TrainingOptions, WIk
from prediction.training.train import fit_anew

OPTIONS = TrainingOptions(optimizer="gradient", criterion="held-out", weights="diagonal")


@pytest.fixture(scope="module")
def two_people():
    """Half of the demonstrations of one person, half of another, as if of one."""
    one, other = (planar_demonstrations(seed=seed, samples=80)[1] for seed in (3, 8))
    join = {
        name: np.concatenate([getattr(one, name), getattr(other, name)])
        for name in ("q", "qdot", "jacobian")
    }
    takes = np.repeat([0, 1], 80)
    time_s = np.tile(np.arange(80) * 0.05, 2)
    return replace(one, **join, trajectory_id=takes, time_s=time_s)


def test_weights_and_kernel_are_those_of_the_part(two_people):
    whole = two_people
    part = whole.take(slice(0, 80))
    rng = np.random.default_rng(0)
    options = {"optimizer": "gradient", "criterion": "held-out", "weights": "diagonal"}
    of_whole = MiNsGp.fit(whole, rng, **options)
    of_part = MiNsGp.fit(part, rng, **options)
    anew = fit_anew(of_whole, part, rng, OPTIONS)
    assert np.abs(of_whole.log_weights - of_part.log_weights).max() > 0.2
    np.testing.assert_allclose(anew.log_weights, of_part.log_weights, atol=0.02)
    np.testing.assert_allclose(anew.law.theta, of_part.law.theta, atol=0.1)


def test_other_searches_are_made_anew_too(two_people, rng):
    """The kernel of CC-GP and the W of W-IK would tell of the part left out as well."""
    part = two_people.take(slice(0, 80))
    kernel = fit_anew(CcGp.fit(two_people, rng), part, rng, OPTIONS).process.theta
    np.testing.assert_array_equal(kernel, CcGp.fit(part, rng).process.theta)
    W = fit_anew(WIk.fit(two_people, rng), part, rng, OPTIONS).weights
    np.testing.assert_allclose(W, WIk.fit(part, rng).weights, rtol=1e-6)
    assert np.abs(np.log(W / WIk.fit(two_people, rng).weights)).max() > 0.1


def test_methods_without_a_search_and_parts_too_small_for_one_are_refitted(two_people):
    whole = two_people
    rng = np.random.default_rng(0)
    part = whole.take(slice(0, 60))
    plain = CovIk.fit(whole, rng)
    np.testing.assert_array_equal(
        fit_anew(plain, part, rng, OPTIONS).second_moment, plain.refitted(part).second_moment
    )
    of_whole = MiNsGp.fit(whole.take(slice(0, 60)), rng, optimizer="gradient")
    few = fit_anew(of_whole, whole.take(slice(0, 12)), rng, OPTIONS)
    np.testing.assert_array_equal(few.log_weights, of_whole.log_weights)
