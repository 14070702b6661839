"""Effort along sampled postures: what they bear, and what noise must not add."""

import numpy as np

from app.assessments.effort import HandLoad, joint_efforts, velocities
from human import HumanModel, Subject, generate_model

_HAND = np.array([0.3, -0.2, 1.2])
_LOAD = HandLoad(("RightHandCOM",), 2.0, np.zeros(3))


def _arm(model: HumanModel) -> np.ndarray:
    names = ("jRightShoulder_rotz", "jRightElbow_rotz", "jL5S1_roty")
    return np.array([model.dof_names.index(name) for name in names])


def _samples(model: HumanModel, sigma: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns times, samples ``(S, T, nq)`` that stray as coherent noise does, and their centre."""
    time = np.arange(60) * 0.05
    central = np.tile(model.neutral(), (len(time), 1))
    moving = _arm(model)
    central[:, 7 + moving] = 0.3 * np.sin(np.pi * time / time[-1])[:, None] ** 2
    rng = np.random.default_rng(3)
    rho = np.exp(-0.05 / 0.5)
    stray = np.zeros((24, len(time), len(moving)))
    for k in range(1, len(time)):
        fresh = rng.normal(0.0, sigma, (24, len(moving)))
        stray[:, k] = rho * stray[:, k - 1] + np.sqrt(1 - rho**2) * fresh
    q = np.tile(central, (24, 1, 1))
    q[..., 7 + moving] += stray
    return time, q, central


def test_samples_accelerate_as_the_central_path_however_far_they_stray() -> None:
    model = generate_model(Subject(1.75, 75.0, "male"))
    for sigma in (0.02, 0.2):
        time, q, central = _samples(model, sigma)
        smooth, v, a = velocities(model, q, time, _arm(model), central)
        _, own_v, own_a = velocities(model, central[None], time, _arm(model))
        np.testing.assert_array_equal(v, np.broadcast_to(own_v, v.shape))
        np.testing.assert_array_equal(a, np.broadcast_to(own_a, a.shape))
        # The postures themselves stay those that were sampled, but for the roughness.
        assert np.corrcoef(smooth[..., 7 + _arm(model)].ravel(), q[..., 7 + _arm(model)].ravel())[
            0, 1
        ] > (0.9)


def test_accelerations_hold_at_the_ends_and_across_the_longest_steps() -> None:
    model = generate_model(Subject(1.75, 75.0, "male"))
    moving = _arm(model)
    step = np.tile([0.02, 0.02, 0.02, 0.08], 12)  # the grid's shortest and longest together
    time = np.concatenate([[0.0], np.cumsum(step)])
    cubic = np.polynomial.Polynomial([0.1, -0.4, 0.9, -0.3])
    central = np.tile(model.neutral(), (len(time), 1))
    central[:, 7 + moving] = cubic(time)[:, None]
    _, v, a = velocities(model, central[None], time, moving)
    for k in 6 + moving:
        np.testing.assert_allclose(v[0, :, k], cubic.deriv()(time), atol=1e-9)
        np.testing.assert_allclose(a[0, :, k], cubic.deriv(2)(time), atol=1e-8)


def test_the_band_of_effort_is_that_of_postures_not_of_rough_noise() -> None:
    model = generate_model(Subject(1.75, 75.0, "male"))
    time, q, central = _samples(model, 0.1)
    hand = np.tile(_HAND, (len(time), 1))
    found = joint_efforts(model, q, time, hand, "right", _LOAD, _arm(model), None, central)
    k = found.joint_names.index("jL5S1")
    smooth, v, _ = velocities(model, q, time, _arm(model), central)
    slow = time * 100.0  # the same postures, so slowly that nothing but their weight is left
    held = joint_efforts(
        model, smooth, slow, hand, "right", _LOAD, _arm(model), None, central
    ).moment_norm[..., k]
    spread, weight = found.moment_norm[..., k].std(axis=0), held.std(axis=0)
    assert v.any()
    np.testing.assert_allclose(spread[5:].mean(), weight[5:].mean(), rtol=0.1)
