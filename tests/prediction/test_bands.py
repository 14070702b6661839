"""Familiarity and the coherent band."""

from dataclasses import replace

import numpy as np
import pytest

from prediction import Demonstrations, Familiarity
from prediction.following.familiarity import HALF_S, widening
from prediction.following.posture_band import PostureBand, fit_band


def wandering(rng, centre=0.0):
    count = 400
    q = centre + 0.3 * np.sin(np.linspace(0, 40, count))[:, None] * np.ones(4)
    q = q + 0.05 * rng.normal(size=q.shape)
    return Demonstrations(
        tuple("abcd"),
        q,
        rng.normal(size=q.shape),
        rng.normal(size=(count, 2, 4)),
        np.zeros(count, dtype=int),
        np.arange(count) * 0.05,
        2,
    )


def test_familiarity_is_high_where_trained_and_zero_far_away(rng):
    demonstrations = wandering(rng)
    familiarity = Familiarity.of(demonstrations)
    inside = familiarity.relative(demonstrations.q)
    assert inside.mean() > 0.9 and (inside <= 1).all()
    away = np.linspace(0, 3, 20)[:, None] * np.ones(4)
    along = familiarity.relative(away)
    assert along[-1] < 1e-3 and (np.diff(along) <= 1e-12).all()


@pytest.mark.parametrize("every", [2, 4])
def test_familiarity_does_not_depend_on_the_rate_of_the_recording(rng, every):
    time_s = np.arange(2400) / 120.0
    q = 0.4 * np.sin(time_s[:, None] * rng.uniform(0.5, 2.0, 4) + rng.uniform(0, 6, 4))
    fast = replace(
        wandering(rng),
        q=q,
        qdot=np.zeros_like(q),
        jacobian=np.zeros((2400, 2, 4)),
        trajectory_id=np.zeros(2400, dtype=int),
        time_s=time_s,
    )
    slow = fast.take(slice(None, None, every))
    grid = 0.4 * rng.normal(size=(200, 4))
    a, b = (Familiarity.of(one).relative(grid) for one in (fast, slow))
    assert a.std() > 0.15  # some postures are known and some are not
    np.testing.assert_allclose(a, b, atol=0.02)


def test_joints_that_move_with_others_make_nothing_less_familiar(rng):
    one = wandering(rng)
    both = replace(
        one,
        joint_names=tuple("abcdefgh"),
        q=np.tile(one.q, 2),
        qdot=np.tile(one.qdot, 2),
        jacobian=np.tile(one.jacobian, 2),
    )
    near = one.q + 0.1 * rng.normal(size=one.q.shape)
    alone = Familiarity.of(one).relative(near)
    assert alone.std() > 0.1
    np.testing.assert_allclose(Familiarity.of(both).relative(np.tile(near, 2)), alone, rtol=1e-9)


def test_familiarity_without_a_motion_knows_it_less(rng):
    both = wandering(rng)
    other = wandering(rng, centre=2.0)
    familiarity = Familiarity.of(both)
    assert familiarity.without(other).relative(both.q).mean() < 0.1


def test_time_near_a_posture_falls_off_as_a_gaussian():
    known = Familiarity(np.zeros((1, 3)), 5.0, 0.04, 1.0)
    far = known.raw(np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]]))  # a standard deviation off
    near = 5.0 * np.exp([0.0, -0.5])
    np.testing.assert_allclose(far, near / (near + HALF_S))


def test_widening_is_one_where_familiar_and_grows_to_its_bound():
    np.testing.assert_allclose(widening(np.array([1.0, 0.0])), [1.0, 3.5])
    assert (np.diff(widening(np.linspace(0, 1, 9))) < 0).all()


def simulated_errors(rng, clock, length=1.5, samples=4000):
    """Errors of a known process; every hand rests now and then, so way and time are not one."""
    root = np.array([[0.2, 0.0, 0.0], [0.1, 0.1, 0.0], [0.0, 0.05, 0.3]])
    elapsed = rng.uniform(0.05, 2.0, samples)
    distance = elapsed * np.maximum(rng.uniform(-0.5, 2.0, samples), 0.0)
    u = np.maximum((1 - clock) * distance + clock * elapsed, 1e-3)
    growth = np.sqrt(-np.expm1(-2 * u / length))
    return root, distance, elapsed, growth[:, None] * (rng.normal(size=(samples, 3)) @ root.T)


@pytest.mark.parametrize("clock", [0.0, 0.5, 1.0])
def test_band_is_recovered_from_errors_of_a_known_process(rng, clock):
    root, distance, elapsed, error = simulated_errors(rng, clock)
    band = fit_band(error, distance, elapsed, np.ones(len(error)), np.eye(3))
    assert band.clock == clock
    np.testing.assert_allclose(
        np.sqrt((band.factor**2).sum(1)), np.sqrt((root**2).sum(1)), rtol=0.15
    )
    assert 0.9 < band.length < 2.5
    inside = np.abs(error) <= 1.645 * band.deviation((1 - clock) * distance + clock * elapsed)
    rests = distance == 0.0
    assert rests.mean() > 0.1
    assert inside[~rests].mean() == pytest.approx(0.9, abs=0.015)
    if clock:
        assert inside[rests].mean() == pytest.approx(0.9, abs=0.03)


def test_errors_where_the_band_was_widened_do_not_widen_it_further(rng):
    _, distance, elapsed, error = simulated_errors(rng, 0.0)
    plain = fit_band(error, distance, elapsed, np.ones(len(error)), np.eye(3))
    threefold = np.full(len(error), 3.0)
    widened = fit_band(3.0 * error, distance, elapsed, threefold, np.eye(3))
    np.testing.assert_allclose(widened.factor, plain.factor, rtol=1e-6)


def test_travelled_distance_is_time_at_demonstrated_speed(rng):
    """A hand moved as the demonstrations move it travels about one second a second."""
    root = rng.normal(size=(4, 4))
    moment = root @ root.T
    J = rng.normal(size=(2, 4))
    rates = rng.normal(size=(20000, 4)) @ root.T
    band = PostureBand(np.eye(4), 1.0, moment)
    squared = band.travelled(0.1 * rates @ J.T, np.broadcast_to(J, (20000, 2, 4)), 0.1) ** 2
    assert np.sqrt(squared.mean()) == pytest.approx(0.1, rel=0.02)
    assert band.travelled(np.zeros(2), J, 0.1) == 0.0
    assert replace(band, clock=0.25).travelled(np.zeros(2), J, 0.1) == pytest.approx(0.025)


def test_deviation_starts_at_nothing_and_saturates():
    band = PostureBand(np.diag([0.1, 0.2]), 0.5, np.eye(2))
    sd = band.deviation(np.array([0.0, 0.2, 50.0]))
    np.testing.assert_allclose(sd[0], 0.0)
    np.testing.assert_allclose(sd[2], [0.1, 0.2])
    assert (sd[1] < sd[2]).all()
    np.testing.assert_allclose(band.rescaled(2.0).deviation(np.array(50.0)), [0.2, 0.4])


def test_familiarity_of_one_short_take_still_has_a_level(rng):
    few = wandering(rng).take(slice(0, 12))
    familiarity = Familiarity.of(replace(few, trajectory_id=np.zeros(12, dtype=int)))
    assert 0 < familiarity.level <= 1
