import numpy as np
import pytest

from human.markers.ik_priors import Pull, movable_dofs, posture_prior, trusting
from human.markers.ik_system import MarkerSystem

from .worn import worn

#: Markers on the pelvis alone.
SPARSE = np.zeros(4, dtype=np.intp)


@pytest.mark.parametrize(
    "segments", [("Pelvis", "T8", "RightHand", "LeftFoot"), ("Head",)], ids=["body", "neck"]
)
def test_normal_equations_are_those_of_the_jacobian(model, rng, configurations, segments) -> None:
    body = worn(model, segments)
    system = MarkerSystem(model, body.segment, body.offset, movable_dofs(model, body.segment))
    q = configurations(model, 3)
    placed = system.place(q)
    error = rng.normal(size=placed.marker.shape)
    weight = rng.uniform(0.0, 2.0, error.shape[:2])
    step = 1e-6
    columns = []
    for unit in np.eye(system.size):
        ahead, behind = (
            system.place(system.moved(q, sign * step * np.tile(unit, (3, 1)))).marker
            for sign in (1.0, -1.0)
        )
        columns.append((ahead - behind) / (2 * step))
    jacobian = np.stack(columns, axis=-1)
    matrix, rhs = system.normal(placed, error, weight)
    expected = np.einsum("bmik,bm,bmil->bkl", jacobian, weight, jacobian)
    assert np.max(np.abs(matrix - expected)) < 1e-6
    assert np.max(np.abs(rhs - np.einsum("bmik,bm,bmi->bk", jacobian, weight, error))) < 1e-6


def test_prior_descends_its_own_cost(model, rng) -> None:
    free = np.arange(model.n_dof)
    prior = trusting(posture_prior(model, free, SPARSE), rng.uniform(size=len(free)) < 0.3)
    angles = rng.uniform(-1.5, 1.5, (2, len(free)))  # some beyond their limits
    pull = Pull(rng.normal(size=angles.shape), rng.uniform(0.0, 5.0, angles.shape))
    matrix, rhs = np.zeros((2, len(free), len(free))), np.zeros(angles.shape)
    prior.add(matrix, rhs, angles, pull)
    step = 1e-6
    for k in range(len(free)):
        away = step * np.eye(len(free))[k]
        slope = (prior.cost(angles + away, pull) - prior.cost(angles - away, pull)) / (2 * step)
        assert np.allclose(-slope, rhs[:, k], rtol=1e-5, atol=1e-3)


def test_an_evenly_shared_bend_costs_nothing_whatever_its_size(model) -> None:
    prior = posture_prior(model, np.arange(model.n_dof), SPARSE)
    spine = [model.dof_names.index(f"{j}_roty") for j in ("jL5S1", "jL4L3", "jL1T12", "jT9T8")]
    share = (model.upper - model.lower)[spine]
    shared, kinked = prior.mean[None].copy(), prior.mean[None].copy()
    shared[:, spine] = 0.8 * share / share.sum()
    kinked[:, spine[0]] = 0.4
    pull = Pull(np.zeros_like(shared), np.zeros_like(shared))
    assert prior.cost(shared, pull)[0] < 1e-4
    assert prior.cost(kinked, pull)[0] > 1.0
