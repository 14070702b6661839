"""Every method answers the same questions; add a row to `METHODS` and these cases run on it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations
from scipy.stats import multivariate_normal

from prediction import (
    METHODS,
    CovIk,
    DemonstrationError,
    MinimumNormIk,
    MiNsGp,
    ProMp,
    TrainingCancelledError,
    UnsupportedMethodError,
    WIk,
    demonstrations_from_samples,
)
from prediction.laws.null_space import weighted_solution

SIGMA_X = np.diag([0.002**2, 0.003**2])


@pytest.fixture(scope="module")
def split():
    raw, demonstrations = planar_demonstrations(seed=3)
    order = np.random.default_rng(1).permutation(len(demonstrations))
    first, rest = np.sort(order[:280]), np.sort(order[280:])
    flat = demonstrations.trajectory_id * 0, np.arange(len(demonstrations)) * 0.05
    one_take = replace(demonstrations, trajectory_id=flat[0], time_s=flat[1])
    return raw, one_take.take(first), one_take.take(rest)


@pytest.fixture(scope="module")
def fitted(split):
    options = {name: {"optimizer": "gradient"} for name in ("mi-nsgp", "nsgp")}
    return {
        name: cls.fit(split[1], np.random.default_rng(0), **options.get(name, {}))
        for name, cls in METHODS.items()
    }


@pytest.fixture(params=sorted(METHODS))
def predictor(request, fitted):
    return fitted[request.param]


@pytest.fixture(params=sorted(name for name, cls in METHODS.items() if cls.keeps_hand))
def constrained(request, fitted):
    return fitted[request.param]


def test_mean_moves_the_hand_exactly_as_led(constrained, split):
    test = split[2]
    mean = constrained.predict(test.q, test.xdot, test.jacobian).mean
    np.testing.assert_allclose(np.einsum("tmn,tn->tm", test.jacobian, mean), test.xdot, atol=1e-12)


def test_null_space_factor_leaves_the_hand(constrained, split):
    test = split[2]
    factor = constrained.predict(test.q, test.xdot, test.jacobian).null_factor
    np.testing.assert_allclose(test.jacobian @ factor, 0.0, atol=1e-10)


def test_density_split_is_the_full_gaussian(constrained, split, rng):
    test = split[2].take(slice(0, 20))
    # a commanded velocity that differs from the observed one, so that the task term matters
    xdot = test.xdot + 0.003 * rng.normal(size=test.xdot.shape)
    parts = constrained.log_prob(test.q, xdot, test.qdot, test.jacobian, SIGMA_X)
    moved = test.xdot  # the null-space law is that of the velocity the hand really had
    law = constrained.predict(test.q, moved, test.jacobian)
    W = constrained.weights_at(test.q)
    mean = law.mean + weighted_solution(W, test.jacobian, xdot - moved)
    if constrained.name == "locov-ik":  # not Gaussian; see test_locov_ik.py
        return
    for i, covariance in enumerate(law.covariance(SIGMA_X)):
        full = multivariate_normal(mean[i], covariance).logpdf(test.qdot[i])
        assert parts.total[i] == pytest.approx(full, abs=1e-6)


def test_axes_of_hand_and_null_space_change_nothing(fitted, split):
    """Turning the task axes turns every row-space basis; nothing about the joints may change."""
    train, test = split[1], split[2]
    angle = 1.1
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned = replace(train, jacobian=turn @ train.jacobian)
    for name, cls in METHODS.items():
        options = {"optimizer": "gradient"} if name in ("mi-nsgp", "nsgp") else {}
        a = fitted[name]
        b = cls.fit(turned, np.random.default_rng(0), **options)
        one = a.predict(test.q, test.xdot, test.jacobian).mean
        other = b.predict(test.q, test.xdot @ turn.T, turn @ test.jacobian).mean
        np.testing.assert_allclose(one, other, atol=2e-4, err_msg=name)


def test_null_velocity_is_the_part_of_the_mean_that_weights_do_not_make(constrained, split):
    test = split[2]
    mean = constrained.predict(test.q, test.xdot, test.jacobian).mean
    followed = weighted_solution(constrained.weights_at(test.q), test.jacobian, test.xdot)
    null = constrained.null_velocity(test.q, test.xdot, test.jacobian)
    np.testing.assert_allclose(mean, followed + null, atol=1e-12)


def test_rescaling_multiplies_the_variance_and_keeps_the_mean(predictor, split):
    test = split[2].take(slice(0, 5))
    wide = predictor.rescaled(4.0)
    a, b = (p.predict(test.q, test.xdot, test.jacobian) for p in (predictor, wide))
    np.testing.assert_array_equal(a.mean, b.mean)
    zero = np.zeros((2, 2))
    np.testing.assert_allclose(b.covariance(zero), 4.0 * a.covariance(zero), atol=1e-12)
    z = predictor.standardised_residuals(split[2])
    np.testing.assert_allclose(np.abs(wide.standardised_residuals(split[2])), np.abs(z) / 2.0)


def test_arrays_rebuild_the_predictor(predictor, split):
    test = split[2].take(slice(0, 5))
    arrays, values = predictor.to_arrays()
    again = type(predictor).from_arrays(arrays, json.loads(json.dumps(values)))
    a, b = (p.predict(test.q, test.xdot, test.jacobian) for p in (predictor, again))
    np.testing.assert_array_equal(a.mean, b.mean)
    np.testing.assert_array_equal(a.null_factor, b.null_factor)


def test_single_postures_and_batches_agree(predictor, split):
    test = split[2].take(slice(0, 6))
    many = predictor.predict(test.q, test.xdot, test.jacobian)
    for i in range(6):
        one = predictor.predict(test.q[i], test.xdot[i], test.jacobian[i])
        np.testing.assert_allclose(one.mean, many.mean[i], atol=1e-12)
    shaped = predictor.predict(
        test.q.reshape(2, 3, 5), test.xdot.reshape(2, 3, 2), test.jacobian.reshape(2, 3, 2, 5)
    )
    np.testing.assert_allclose(shaped.mean.reshape(6, 5), many.mean, atol=1e-12)


def test_too_few_samples_are_refused(split):
    for cls in METHODS.values():
        with pytest.raises(DemonstrationError):
            cls.fit(split[1].take(slice(0, 8)), np.random.default_rng(0))


def test_fitting_stops_when_asked(split):
    for cls in METHODS.values():
        with pytest.raises(TrainingCancelledError):
            cls.fit(split[1], np.random.default_rng(0), should_stop=lambda: True)


def held_out_log_likelihood(predictor, split):
    test = split[2]
    return float(
        predictor.log_prob(test.q, test.xdot, test.qdot, test.jacobian, SIGMA_X).total.mean()
    )


def test_mi_nsgp_learns_the_law_and_the_weights(fitted, split):
    raw, _, test = split
    scores = {name: held_out_log_likelihood(p, split) for name, p in fitted.items()}
    assert scores["mi-nsgp"] > scores["cov-ik"] + 2.0
    assert scores["cov-ik"] > scores["minimum-norm"]
    error = np.std(fitted["mi-nsgp"].log_weights - np.log(raw.law.mobility))
    assert error < 0.1
    z = fitted["mi-nsgp"].standardised_residuals(test)
    assert 0.8 < (np.abs(z) < 1.645).mean() < 0.97


def test_separate_length_scales_beat_the_papers_one(split, fitted):
    paper = MiNsGp.fit(split[1], np.random.default_rng(0), kernel="paper", optimizer="gradient")
    assert held_out_log_likelihood(fitted["mi-nsgp"], split) > held_out_log_likelihood(paper, split)


def test_bipop_reaches_what_the_gradient_reaches(split, fitted):
    told = []
    bipop = MiNsGp.fit(
        split[1],
        np.random.default_rng(0),
        optimizer="bipop",
        max_evaluations=800,
        progress=lambda *a: told.append(a),
    )
    assert bipop.law.score == pytest.approx(fitted["mi-nsgp"].law.score, abs=5e-3)
    assert told and np.isfinite([t[2] for t in told]).all()
    shares = [t[1] for t in told]
    assert shares == sorted(shares) and shares[-1] <= 1.0


def test_gpytorch_engine_trains_the_same_model(split):
    few = split[1].take(slice(0, 60))
    models = [
        MiNsGp.fit(
            few,
            np.random.default_rng(0),
            optimizer="gradient",
            engine=engine,
            max_evaluations=60,
        )
        for engine in ("fast", "gpytorch")
    ]
    np.testing.assert_allclose(models[0].log_weights, models[1].log_weights, atol=0.1)
    assert models[0].law.score == pytest.approx(models[1].law.score, abs=0.05)


@pytest.mark.parametrize("criterion", ["marginal", "held-out"])
def test_correlated_weights_start_from_the_demonstrations_and_gain(split, criterion):
    train = split[1].take(slice(0, 100))
    model = MiNsGp.fit(
        train,
        np.random.default_rng(0),
        optimizer="gradient",
        criterion=criterion,
        weights="correlated",
        max_evaluations=60,
    )
    W = model.weights
    assert W.shape == (5, 5) and (np.linalg.eigvalsh(W) > 0).all()
    root = np.sqrt(np.diagonal(W))
    C = CovIk.fit(train, np.random.default_rng(0)).second_moment
    scale = np.sqrt(np.diagonal(C))
    np.testing.assert_allclose(W / root[:, None] / root, C / scale[:, None] / scale, atol=1e-12)
    law = model.predict(split[2].q, split[2].xdot, split[2].jacobian)
    hand = np.einsum("tmn,tn->tm", split[2].jacobian, law.mean)
    np.testing.assert_allclose(hand, split[2].xdot, atol=1e-12)


def test_automatic_weights_are_those_the_criterion_prefers(split):
    train = split[1].take(slice(0, 80))
    options = {"optimizer": "gradient", "criterion": "held-out", "max_evaluations": 40}
    laws = {
        kind: MiNsGp.fit(train, np.random.default_rng(0), weights=kind, **options).law
        for kind in ("diagonal", "correlated", "auto")
    }
    best = max(laws["diagonal"].score, laws["correlated"].score)
    assert laws["auto"].score == pytest.approx(best, abs=1e-12)


def test_search_ends_with_the_best_law_it_has_seen(split):
    for seed in (2, 4):
        told = []
        model = MiNsGp.fit(
            split[1].take(slice(0, 80)),
            np.random.default_rng(seed),
            max_evaluations=120,
            progress=lambda what, _, score, told=told: told.append((what, score)),
        )
        reached = [score for what, score in told if what == "fitting the kernel"]
        assert model.law.score == max(reached)


def test_held_out_criterion_finds_the_weights_and_fades_far_away(split):
    raw, train, test = split
    model = MiNsGp.fit(
        train.take(slice(0, 160)),
        np.random.default_rng(0),
        optimizer="gradient",
        criterion="held-out",
        max_evaluations=100,
    )
    assert np.std(model.log_weights - np.log(raw.law.mobility)) < 0.3
    far = test.q[:5] + 50.0
    null = model.null_velocity(far, test.xdot[:5], test.jacobian[:5])
    np.testing.assert_allclose(null, 0.0, atol=1e-12)


@pytest.mark.parametrize("option", ["kernel", "optimizer", "engine", "criterion"])
def test_unknown_options_are_refused_by_name(split, option):
    with pytest.raises(UnsupportedMethodError, match="magic") as caught:
        MiNsGp.fit(split[1], np.random.default_rng(0), **{option: "magic"})
    assert caught.value.available


def test_held_out_criterion_needs_the_fast_engine(split):
    with pytest.raises(UnsupportedMethodError, match="held-out"):
        MiNsGp.fit(split[1], np.random.default_rng(0), engine="gpytorch", criterion="held-out")


def test_cov_ik_is_gaussian_conditioning(fitted, split):
    model: CovIk = fitted["cov-ik"]
    test = split[2].take(slice(0, 5))
    C = model.second_moment
    law = model.predict(test.q, test.xdot, test.jacobian)
    for i, J in enumerate(test.jacobian):
        gain = C @ J.T @ np.linalg.inv(J @ C @ J.T)
        np.testing.assert_allclose(law.mean[i], gain @ test.xdot[i], atol=1e-10)
        np.testing.assert_allclose(
            law.covariance(np.zeros((2, 2)))[i], C - gain @ J @ C, atol=1e-10
        )


def test_a_process_without_the_null_space_misses_the_hand(fitted, split):
    test = split[2]
    moved = fitted["gp"].predict(test.q, test.xdot, test.jacobian).mean
    miss = np.einsum("tmn,tn->tm", test.jacobian, moved) - test.xdot
    assert 1e-3 < np.sqrt((miss**2).mean()) < 0.1
    parts = fitted["gp"].log_prob(test.q, test.xdot, test.qdot, test.jacobian, SIGMA_X)
    law = fitted["gp"].predict(test.q, test.xdot, test.jacobian)
    for i, covariance in enumerate(law.covariance(SIGMA_X)[:10]):
        full = multivariate_normal(law.mean[i], covariance).logpdf(test.qdot[i])
        assert parts.total[i] == pytest.approx(full, abs=1e-6)
    conditioned = fitted["cc-gp"]
    S = conditioned.weights
    law = conditioned.predict(test.q[:5], test.xdot[:5], test.jacobian[:5])
    for i, J in enumerate(test.jacobian[:5]):
        gain = S @ J.T @ np.linalg.inv(J @ S @ J.T)
        mu = conditioned.process.mean(test.q[i], test.xdot[i])
        np.testing.assert_allclose(law.mean[i], mu + gain @ (test.xdot[i] - J @ mu), atol=1e-9)


def test_ablations_learn_their_part_only(fitted, split):
    raw = split[0]
    np.testing.assert_array_equal(fitted["nsgp"].weights, 1.0)
    np.testing.assert_array_equal(fitted["sb-m"].weights, 1.0)
    learned = np.log(fitted["w-ik"].weights)
    assert np.std(learned - np.log(raw.law.mobility)) < 0.3
    nats = {name: held_out_log_likelihood(fitted[name], split) for name in METHODS}
    assert nats["mi-nsgp"] > nats["nsgp"] > nats["sb-m"] >= nats["minimum-norm"] - 0.1
    assert nats["w-ik"] > nats["sb-m"]


@pytest.mark.parametrize("optimizer", ["gradient", "bipop"])
def test_weights_alone_are_found_by_either_optimiser(split, fitted, optimizer):
    found = WIk.fit(split[1], np.random.default_rng(0), optimizer=optimizer, max_evaluations=1500)
    np.testing.assert_allclose(np.log(found.weights), np.log(fitted["w-ik"].weights), atol=0.02)


def test_a_primitive_tells_the_phase_and_is_held_to_the_hand(rng):
    """Four noisy repetitions of one movement: phase, velocity and spread are those of it."""
    chain, count = PlanarChain(), 60
    time = np.tile(np.linspace(0.0, 2.0, count), 4)
    phase = time / 2.0
    amplitude = np.repeat(1.0 + 0.1 * rng.normal(size=4), count)[:, None]
    shape = np.array([0.5, -0.4, 0.3, 0.2, -0.3])
    q = 0.4 + amplitude * shape * (1 - np.cos(np.pi * phase))[:, None] / 2
    qdot = amplitude * shape * (np.pi / 4 * np.sin(np.pi * phase))[:, None]
    takes = np.repeat(np.arange(4), count)
    data = demonstrations_from_samples(
        chain, q, qdot + 0.01 * rng.normal(size=q.shape), time, takes
    )
    model = ProMp.fit(data, rng)
    found = model.phase(q) / 49
    assert np.abs(found - phase)[(phase > 0.15) & (phase < 0.85)].max() < 0.1
    middle = np.abs(phase - 0.5) < 0.02
    np.testing.assert_allclose(model.joint_mean(q, data.xdot)[middle], qdot[middle], atol=0.08)
    sd = np.sqrt(np.einsum("tii->ti", model.weights_at(q[middle])))
    assert (sd > 0.3 * 0.1 * np.pi / 4 * np.abs(shape)).all() and (sd < 0.15).all()


def test_minimum_norm_is_the_smallest_velocity(fitted, split):
    model: MinimumNormIk = fitted["minimum-norm"]
    test = split[2].take(slice(0, 5))
    law = model.predict(test.q, test.xdot, test.jacobian)
    for i, J in enumerate(test.jacobian):
        np.testing.assert_allclose(law.mean[i], np.linalg.pinv(J) @ test.xdot[i], atol=1e-10)
        expected = model.covariance[0, 0] * (np.eye(5) - np.linalg.pinv(J) @ J)
        np.testing.assert_allclose(law.covariance(np.zeros((2, 2)))[i], expected, atol=1e-10)
