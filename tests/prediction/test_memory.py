"""What the step before says about the next one."""

from dataclasses import replace

import numpy as np
import pytest
from planar import PlanarChain
from scipy.stats import multivariate_normal

from prediction import (
    METHODS,
    CovIk,
    MinimumNormIk,
    NullSpaceMemory,
    PredictionError,
    TrainingOptions,
    demonstrations_from_samples,
    model_bytes,
    model_from_bytes,
    score_method,
    train_operator,
)
from prediction.laws.memory import elapsed_in
from prediction.laws.null_space import weighted_pseudo_inverse

DT, TAU = 0.02, 0.2
SIGMA_X = np.diag([0.002**2, 0.003**2])


@pytest.fixture(scope="module")
def strays():
    """A planar arm, two takes: least-norm, plus a null-space residual that lasts `TAU`."""
    chain, rng, count = PlanarChain(), np.random.default_rng(5), 3000
    time_s = np.arange(count) * DT
    start = np.deg2rad([90.0, -25.0, -25.0, -60.0, -20.0])
    pace, swing = rng.uniform(1.0, 3.0, (4, 1)), rng.normal(0, 0.05, (4, 2))
    kept, half = np.exp(-DT / TAU), count // 2
    q, qdot, residual = (np.zeros((count, 5)) for _ in range(3))
    for t in range(count):
        q[t] = start if t % half == 0 else q[t - 1] + DT * qdot[t - 1]
        J = chain.arm.jacobian(q[t])
        kick = np.sqrt(1 - kept**2) * 0.05 * rng.normal(size=5)
        last = 0.0 if t % half == 0 else residual[t - 1]
        residual[t] = (np.eye(5) - np.linalg.pinv(J) @ J) @ (kept * last + kick)
        led = (pace * np.cos(pace * time_s[t]) * swing).sum(axis=0)
        qdot[t] = np.linalg.pinv(J) @ led + residual[t]
    takes = np.arange(count) // half
    return demonstrations_from_samples(chain, q, qdot, time_s, takes), residual


def test_memory_of_a_known_process_is_recovered(strays):
    demonstrations, residual = strays
    law = MinimumNormIk.fit(demonstrations, np.random.default_rng(0))
    found = law.null_residual(demonstrations.q, demonstrations.qdot, demonstrations.jacobian)
    np.testing.assert_allclose(found, residual, atol=1e-10)
    memory = NullSpaceMemory.fit([(law, demonstrations)])
    assert memory.time_s == pytest.approx(TAU, rel=0.15)
    assert memory.explained == pytest.approx(1.0, abs=0.03)
    white = law.standardised_residuals(demonstrations, memory.within(law, demonstrations))
    assert (white**2).mean() == pytest.approx(1.0, abs=0.05)
    again = np.einsum("tk,tk->t", white[1:], white[:-1]).mean() / 3
    assert abs(again) < 0.05  # nothing is left to be remembered


def test_one_hurried_sample_does_not_set_the_pace(strays):
    demonstrations = strays[0]
    time_s = demonstrations.time_s.copy()
    time_s[700] = time_s[701] - 0.1 * DT
    hurried = replace(demonstrations, time_s=time_s)
    law = MinimumNormIk.fit(demonstrations, np.random.default_rng(0))
    memory = NullSpaceMemory.fit([(law, hurried)])
    assert memory.time_s == pytest.approx(TAU, rel=0.15)
    assert memory.explained == pytest.approx(1.0, abs=0.03)


def test_motion_that_forgets_at_once_has_no_memory_to_speak_of(strays, rng):
    demonstrations = strays[0]
    white = replace(demonstrations, qdot=rng.normal(size=demonstrations.qdot.shape))
    law = CovIk.fit(white, rng)
    memory = NullSpaceMemory.fit([(law, white)])
    assert memory is None or memory.time_s < DT


def test_samples_that_are_no_neighbours_say_nothing(strays):
    demonstrations = strays[0].take(slice(1400, 1600))
    law = CovIk.fit(demonstrations, np.random.default_rng(0))
    memory = NullSpaceMemory(TAU, 0.9)
    elapsed = elapsed_in(demonstrations)
    first = np.flatnonzero(np.isinf(elapsed))
    np.testing.assert_array_equal(first, [0, 100])
    previous = memory.within(law, demonstrations)
    d = demonstrations
    told = law.predict(d.q, d.xdot, d.jacobian, previous)
    alone = law.predict(d.q, d.xdot, d.jacobian)
    np.testing.assert_array_equal(told.mean[first], alone.mean[first])
    np.testing.assert_array_equal(told.null_factor[first], alone.null_factor[first])
    assert np.abs(told.mean - alone.mean)[1:100].max() > 1e-3
    one = memory.after(law, d.q[4], d.qdot[4], d.jacobian[4], d.time_s[5] - d.time_s[4])
    np.testing.assert_allclose(
        law.predict(d.q[5], d.xdot[5], d.jacobian[5], one).mean, told.mean[5], atol=1e-12
    )
    alone_each = d.take(slice(0, 2000, 1))
    scattered = replace(alone_each, trajectory_id=np.arange(len(d)))
    assert NullSpaceMemory.fit([(law, scattered)]) is None


@pytest.mark.parametrize("name", sorted(METHODS))
def test_density_with_memory_is_that_of_the_predicted_law(strays, name):
    """The residual is carried by ``I - K J`` and the law narrows in the null space alone."""
    train, test = strays[0].take(slice(0, 120)), strays[0].take(slice(500, 520))
    options = {name: {"optimizer": "gradient", "max_evaluations": 30} for name in ("mi-nsgp",)}
    law = METHODS[name].fit(train, np.random.default_rng(0), **options.get(name, {}))
    q, xdot, J = test.q, test.xdot, test.jacobian
    previous = NullSpaceMemory(TAU, 0.9).within(law, test)
    alone, told = law.predict(q, xdot, J), law.predict(q, xdot, J, previous)
    hand = np.einsum("tmn,tn->tm", J, told.mean - alone.mean)
    np.testing.assert_allclose(hand, 0.0, atol=1e-12)
    W = law.weights_at(q)
    off = np.eye(5) - weighted_pseudo_inverse(W, J) @ J
    carried = np.einsum("tij,tj->ti", off, previous.residual) * previous.kept[:, None]
    np.testing.assert_allclose(told.mean, alone.mean + carried, atol=1e-10)
    parts = law.log_prob(q, xdot, test.qdot, J, SIGMA_X, previous)
    if name == "locov-ik":  # not Gaussian: the density of a t with this mean and covariance
        plain = law.log_prob(q, xdot, test.qdot - carried, J, SIGMA_X)
        first = np.isinf(elapsed_in(test))
        np.testing.assert_allclose(parts.total[first], plain.total[first])
        wide = law.rescaled(float(previous.spread[1]))
        narrow = wide.log_prob(q, xdot, test.qdot - carried, J, SIGMA_X)
        np.testing.assert_allclose(parts.total[~first], narrow.total[~first], atol=1e-9)
        return
    for i, covariance in enumerate(told.covariance(SIGMA_X)):
        full = multivariate_normal(told.mean[i], covariance, allow_singular=True)
        assert parts.total[i] == pytest.approx(full.logpdf(test.qdot[i]), abs=1e-5)


def test_a_trained_model_keeps_its_memory_and_is_scored_with_it(strays):
    train, test = strays[0].take(slice(0, 500)), strays[0].take(slice(1500, 1800))
    options = TrainingOptions(method="cov-ik", tasks=("position",))
    model = train_operator(PlanarChain(), train, seed=1, options=options)
    memory = model.fitted(task="position").memory
    assert memory == model_from_bytes(model_bytes(model)).fitted(task="position").memory
    assert memory.time_s == pytest.approx(TAU, rel=0.5)
    score = score_method(
        model, "cov-ik", test, np.random.default_rng(0), task="position", chain=PlanarChain()
    )
    told = score.with_previous
    assert told["log_likelihood"] > score.log_likelihood + 0.5
    assert told["rmse_rad_s"] < 0.8 * score.rmse_rad_s
    assert told["coverage90_one_step"] == pytest.approx(0.9, abs=0.06)


def test_a_memory_that_cannot_be_is_refused():
    for time_s, explained in ((0.0, 0.5), (np.inf, 0.5), (0.2, 1.5), (0.2, -0.1), (np.nan, 0.5)):
        with pytest.raises(PredictionError, match="positive time"):
            NullSpaceMemory(time_s, explained)
