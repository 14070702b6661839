"""The floor that the comparison on simulated people shows is the law they follow."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from benchmarks.prediction.simulated_operators import WAYS, Person, TrueLaw
from human import Chain, Subject, generate_model
from human.simulate import operator, simulate_reaching
from prediction import demonstrations_from_motion


@pytest.fixture(scope="module")
def person():
    """One free movement in place of all that a person does, which would take seconds."""
    model = generate_model(Subject(1.75, 72.0))
    rng = np.random.default_rng(4)
    who = operator("twister", rng, model)
    simulated = simulate_reaching(model, who, rng, movements=1, rate_hz=30.0)
    chain = Chain(model)
    take = demonstrations_from_motion(chain, simulated.motion, rate_hz=30.0)
    return Person(who, chain, (take,), take), simulated.truth


def test_what_the_law_leaves_open_is_the_noise_pushed_into_the_null_space(person):
    who, truth = person
    take = who.free
    law = TrueLaw.of_person(who, take)
    order = [truth.dof.tolist().index(i) for i in who.chain.dof_indices]
    noise = truth.noise[:, order]
    W = np.diag(who.operator.mobility[who.chain.dof_indices])
    law_of = law.predict(take.q, take.xdot, take.jacobian)
    for t in range(0, len(take), 17):
        J = take.jacobian[t]
        off = np.eye(24) - W @ J.T @ np.linalg.solve(J @ W @ J.T, J)
        np.testing.assert_allclose(take.qdot[t] - law_of.mean[t], off @ noise[t], atol=1e-8)
        spread = off @ np.diag(who.operator.null_noise[who.chain.dof_indices] ** 2) @ off.T
        np.testing.assert_allclose(law_of.covariance(np.zeros((6, 6)))[t], spread, atol=1e-10)
    sigma_x = 1e-4 * np.eye(6)
    parts = law.log_prob(take.q, take.xdot, take.qdot, take.jacobian, sigma_x)
    full = multivariate_normal(law_of.mean[3], law_of.covariance(sigma_x)[3])
    assert parts.total[3] == pytest.approx(full.logpdf(take.qdot[3]), abs=1e-5)


def test_each_way_is_held_out_once_and_trained_on(person):
    who, _ = person
    takes = [
        replace(who.free.take(slice(0, 3)), trajectory_id=np.full(3, k)) for k in range(WAYS * 4)
    ]
    marked = [replace(take, q=take.q * 0 + k) for k, take in enumerate(takes)]
    several = Person(who.operator, who.chain, tuple(marked), who.free)
    for train, test in (several.interleaved(), several.later()):
        trained, tested = (set(d.q[:, 0].astype(int)) for d in (train, test))
        assert trained | tested == set(range(WAYS * 4)) and not trained & tested
        assert sorted(k % WAYS for k in tested) == list(range(WAYS))
    assert min(several.later()[1].q[:, 0]) == WAYS * 3
