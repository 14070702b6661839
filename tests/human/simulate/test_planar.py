import numpy as np
import pytest

from human.simulate import (
    MOBILITY_RANGE,
    PlanarArm,
    PlanarComfort,
    SimulationError,
    planar_law,
    simulate_planar,
)


def _difference(function, q, step=1e-6):
    columns = [
        (function(q + step * e) - function(q - step * e)) / (2 * step) for e in np.eye(q.size)
    ]
    return np.stack(columns, axis=-1)


def test_jacobian_is_the_derivative_of_the_tip():
    arm, rng = PlanarArm(), np.random.default_rng(0)
    for q in rng.uniform(-2, 2, (5, 5)):
        np.testing.assert_allclose(arm.jacobian(q), _difference(arm.forward, q), atol=1e-9)


def test_a_stretched_arm_reaches_the_sum_of_its_links_and_is_singular():
    arm = PlanarArm()
    np.testing.assert_allclose(arm.forward(np.zeros(5)), [1.35, 0.0])
    assert arm.manipulability(np.zeros(5)) == pytest.approx(0.0, abs=1e-9)
    assert arm.manipulability(PlanarComfort().neutral) > 0.1


def test_gradient_is_the_derivative_of_the_cost_and_vanishes_at_neutral():
    comfort, rng = PlanarComfort(), np.random.default_rng(1)
    for q in comfort.neutral + rng.uniform(-1.5, 1.5, (8, 5)):
        np.testing.assert_allclose(comfort.gradient(q), _difference(comfort.cost, q), atol=1e-7)
    np.testing.assert_array_equal(comfort.gradient(comfort.neutral), 0.0)


def test_weighted_inverse_minimises_the_weighted_norm():
    rng = np.random.default_rng(2)
    law = planar_law(rng)
    q, xdot = law.comfort.neutral + rng.uniform(-0.3, 0.3, 5), rng.normal(size=2)
    J = law.arm.jacobian(q)
    best = law.weighted_inverse(J) @ xdot
    np.testing.assert_allclose(J @ best, xdot, atol=1e-12)

    def size(qdot):
        return qdot @ (qdot / law.mobility)

    for other in rng.normal(size=(20, 5)):
        assert size(best) < size(best + 0.1 * law.null_projector(J) @ other)


def test_samples_obey_the_law_up_to_the_stated_noise():
    demos = simulate_planar(np.random.default_rng(3), samples=4000)
    law = demos.law
    residual = demos.qdot - law.mean(demos.q, demos.xdot_true)
    np.testing.assert_allclose(np.einsum("tij,tj->ti", demos.jacobian, residual), 0.0, atol=1e-12)
    # The law's own covariance, with the task velocity known exactly, has rank 3 of 5.
    whitened = [
        r @ np.linalg.pinv(cov, rcond=1e-9, hermitian=True) @ r
        for r, cov in zip(residual, law.covariance(demos.q, 0.0), strict=True)
    ]
    assert np.mean(whitened) == pytest.approx(3.0, abs=0.12)
    assert np.std(demos.xdot - demos.xdot_true) == pytest.approx(demos.sigma_x, rel=0.03)
    assert np.abs(demos.xdot_true).max() <= 0.5 + 1e-12


def test_runs_restart_from_one_posture_and_integrate_within_themselves():
    demos = simulate_planar(np.random.default_rng(0), samples=3000)
    starts = demos.q[demos.time_s == 0.0]
    assert len(starts) == demos.trajectory_id[-1] + 1 > 1
    np.testing.assert_array_equal(starts, np.broadcast_to(starts[0], starts.shape))
    same = np.diff(demos.trajectory_id) == 0
    step = (np.diff(demos.q, axis=0) - 0.05 * demos.qdot[:-1])[same]
    assert np.std(step) == pytest.approx(0.05**2, rel=0.05)
    assert demos.law.arm.manipulability(demos.q).min() >= 0.02


def test_mobilities_are_bounded_and_seeds_repeat():
    laws = np.array([planar_law(np.random.default_rng(s)).mobility for s in range(50)])
    assert laws.min() >= MOBILITY_RANGE[0]
    assert laws.max() <= MOBILITY_RANGE[1]
    a, b = (simulate_planar(np.random.default_rng(5), samples=50) for _ in range(2))
    np.testing.assert_array_equal(a.q, b.q)
    np.testing.assert_array_equal(a.xdot, b.xdot)


@pytest.mark.parametrize("bad", [{"samples": 0}, {"step_s": 0.0}, {"step_s": float("nan")}])
def test_impossible_settings_are_refused(bad):
    with pytest.raises(SimulationError, match="must be positive"):
        simulate_planar(np.random.default_rng(0), **bad)
