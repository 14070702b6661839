from dataclasses import replace

import numpy as np
import pytest
from planar import planar_demonstrations
from scipy.optimize import minimize
from scipy.special import stdtrit

from prediction import MiNsGp
from prediction.laws.null_space import NullSpaceBasis
from prediction.laws.student_t import NINETY
from prediction.search.law_search import SearchOptions, criterion_engine, search_law
from prediction.search.marginal_likelihood import optimise_kernel
from prediction.search.weight_interval import (
    Profile,
    WeightInterval,
    _curvature,
    _Directions,
    _end,
    weight_interval,
)
from prediction.search.weight_search import LOG_WEIGHT_BOUND, NullSpaceTargets, mean_zero_axes


@pytest.fixture(scope="module", params=["marginal", "held-out"])
def fitted(request):
    raw, demonstrations = planar_demonstrations(seed=3, samples=150)
    options = SearchOptions(optimizer="gradient", criterion=request.param)
    law = search_law(demonstrations, np.random.default_rng(0), options)
    engine, _ = criterion_engine(options, law.scaling, demonstrations)
    targets = NullSpaceTargets(demonstrations, law.basis)
    profile = Profile(engine.residual_map(law.theta), targets)
    return raw, demonstrations, law, engine, targets, profile


def test_the_profile_is_the_criterion_and_its_slope_the_derivative(fitted, rng):
    _, demonstrations, law, engine, targets, profile = fitted
    a, b = law.log_weights, law.log_weights + 0.2 * rng.normal(size=5)
    expected = engine.log_likelihood(law.theta, targets.one(a))
    expected -= engine.log_likelihood(law.theta, targets.one(b))
    difference = profile.value(a) - profile.value(b)
    assert difference == pytest.approx(len(demonstrations) * expected, rel=1e-6)
    for j in range(5):
        step = 1e-5 * np.eye(5)[j]
        slope = (profile.value(b + step) - profile.value(b - step)) / 2e-5
        assert profile.slope(b)[j] == pytest.approx(slope, rel=1e-4, abs=1e-4)


def test_leaving_a_part_out_moves_the_optimum_as_searching_without_it_does(fitted):
    """The one Newton step against many, on the residuals that are left."""
    _, demonstrations, law, engine, targets, profile = fitted
    axes, parts = mean_zero_axes(5), demonstrations.blocks(10)
    step = profile.moved(law.log_weights, parts, axes)[1]
    without = Profile(engine.residual_map(law.theta)[~parts[1]], targets)
    at = law.log_weights
    for _ in range(20):
        curvature = np.stack(
            [(without.slope(at - 1e-4 * a) - without.slope(at + 1e-4 * a)) / 2e-4 for a in axes.T]
        )
        at = at + axes @ np.linalg.solve(curvature @ axes, axes.T @ without.slope(at))
    moved = at - law.log_weights
    assert np.linalg.norm(step - moved) < 0.15 * np.linalg.norm(moved)


def test_ends_are_where_the_profile_with_the_others_at_their_best_has_dropped(fitted):
    *_, law, _, _, profile = fitted
    peak, drop = law.log_weights, 1.353
    at = _Directions.of(np.ones(5, dtype=bool), _curvature(profile.slope, peak))
    for joint, sign in ((0, 1.0), (3, -1.0)):
        end = _end(profile, peak, at.inverse, joint, sign, drop)
        assert sign * (end - peak[joint]) > 0.0
        away = end - peak[joint]
        others = np.delete(np.eye(5), joint, axis=1)
        base = peak + away * np.eye(5)[joint] - others.sum(axis=1) * away / 4.0  # mean zero
        inner = others @ mean_zero_axes(4)
        best = minimize(
            lambda x, base=base, inner=inner: -profile.value(base + inner @ x),
            np.zeros(3),
            method="Nelder-Mead",
            options={"maxfev": 400, "xatol": 1e-6, "fatol": 1e-6},
        )
        assert profile.value(peak) + best.fun == pytest.approx(drop, rel=0.02)


def test_samples_that_repeat_one_another_tell_no_more():
    """Four copies of each: one by one they would make intervals half as wide."""
    _, demonstrations = planar_demonstrations(seed=3, samples=100)
    each = np.repeat(np.arange(100), 4)
    fields = ("q", "qdot", "jacobian", "trajectory_id")
    repeated = {name: getattr(demonstrations, name)[each] for name in fields}
    later = demonstrations.time_s[each] + np.tile(np.arange(4) * 1e-4, 100)
    copies = replace(demonstrations, **repeated, time_s=later)
    basis = NullSpaceBasis.around(demonstrations.jacobian)
    profile, axes = Profile(np.eye(400), NullSpaceTargets(copies, basis)), mean_zero_axes(5)
    best = minimize(
        lambda x: -profile.value(axes @ x),
        np.zeros(4),
        jac=lambda x: -axes.T @ profile.slope(axes @ x),
    )
    thirds = [np.arange(400) // 134 == part for part in range(3)]
    plain, by_parts = (weight_interval(profile, axes @ best.x, parts) for parts in ([], thirds))
    wider = (by_parts.high - by_parts.low) / (plain.high - plain.low)
    assert np.median(wider) > 3.0 * stdtrit(2, 0.95) / NINETY
    for one in (plain, by_parts):
        assert (np.abs([one.low, one.high]) <= LOG_WEIGHT_BOUND).all()


def test_fitting_the_kernel_anew_changes_little(fitted):
    """The approximation of the interval: the kernel stays as it was found."""
    _, _, law, engine, targets, profile = fitted
    moved = law.log_weights + 0.1 * np.array([1.0, -1.0, 0.0, 0.0, 0.0])
    count = len(targets.one(moved))
    held = profile.value(law.log_weights) - profile.value(moved)
    theta = optimise_kernel(engine, law.theta, targets.one(moved), 40)
    anew = law.score - engine.log_likelihood(theta, targets.one(moved))
    assert 0.7 * held < count * anew <= held * (1.0 + 1e-6) + 1e-4


def test_true_weights_are_inside_and_a_joint_nothing_is_known_of_is_said():
    raw, demonstrations = planar_demonstrations(seed=3, samples=300)
    fit = MiNsGp.fit(demonstrations, np.random.default_rng(0), optimizer="gradient")
    interval = fit.with_interval(demonstrations, "marginal").interval
    truth = np.log(raw.law.mobility) - np.log(raw.law.mobility).mean()
    assert ((interval.low <= truth) & (truth <= interval.high)).mean() >= 0.8
    assert interval.identified.all() and (interval.high - interval.low < 3.0).all()
    assert (interval.low < fit.log_weights).all() and (fit.log_weights < interval.high).all()
    again = WeightInterval.from_arrays(interval.to_arrays())
    np.testing.assert_array_equal(again.low, interval.low)
    assert again.parts == interval.parts
    assert fit.with_interval(demonstrations, "in-sample").interval is None
    open_end = WeightInterval(np.array([-LOG_WEIGHT_BOUND, -1.0]), np.array([0.3, 1.0]), 3)
    assert open_end.identified.tolist() == [False, True]


class _NearlyFlat:
    """A criterion that says next to nothing of two joints, and cannot be worked out far away."""

    across = np.array([-2.0, 1.0, 1.0]) / np.sqrt(6.0)

    def value(self, at):
        return np.nan if np.abs(at).max() > 100.0 else float(-50.0 * (self.across @ at) ** 2)

    def slope(self, at):
        # nothing near the peak, thousands away from it: Newton steps there are far too long
        return -100.0 * (self.across @ at) * self.across + 1e6 * at**3 * [0.0, 1.0, -1.0]

    def moved(self, at, parts, axes):
        return np.zeros((len(parts), len(at)))


def test_an_end_is_a_number_where_the_others_could_run_away():
    found = weight_interval(_NearlyFlat(), np.zeros(3), [])
    for ends in (found.low, found.high):
        assert np.isfinite(ends).all() and np.abs(ends).max() <= LOG_WEIGHT_BOUND
    assert not found.identified[1] and not found.identified[2]
