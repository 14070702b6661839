from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from scipy.signal import savgol_filter

from human import LocalCubic, MotionError, Provenance, motion_from_configurations
from human.differentiate import GAP_FACTOR, run_starts


def uneven(rng, count=200):
    return np.cumsum(rng.uniform(0.006, 0.024, count))


def cubic(t):
    """A cubic and its first two derivatives."""
    return 0.3 * t**3 - 2.0 * t**2 + t, 0.9 * t**2 - 4.0 * t + 1.0, 1.8 * t - 4.0


def test_cubics_are_exact_on_uneven_times(rng):
    t = uneven(rng)
    value, first, second = cubic(t)
    got = LocalCubic(t).derivatives(value)
    np.testing.assert_allclose(got.value, value, atol=1e-11)
    np.testing.assert_allclose(got.first, first, atol=1e-10)
    np.testing.assert_allclose(got.second, second, atol=1e-8)
    assert not np.any(got.weak)


def test_even_times_give_the_classical_filter_ends_included(rng):
    t = np.arange(300) / 60.0
    signal = rng.normal(size=(300, 4))
    got = LocalCubic(t, window_s=0.2).derivatives(signal)
    for order, values in enumerate((got.value, got.first, got.second)):
        expected = savgol_filter(signal, 13, 3, deriv=order, delta=1 / 60, axis=0)
        np.testing.assert_allclose(values, expected, atol=1e-9 * np.max(np.abs(expected)))


def test_window_is_a_time_not_a_count(rng):
    noise = rng.normal(size=(4000, 3))

    def spread(rate):
        return np.std(LocalCubic(np.arange(4000) / rate).derivatives(noise).value)

    # 49 samples in the window instead of 13: the noise left falls with the root of their ratio.
    assert spread(240.0) / spread(60.0) == pytest.approx(np.sqrt(13 / 49), rel=0.05)


def test_nothing_crosses_a_gap(rng):
    t = uneven(rng)
    t[120:] += 1.0
    value, first, second = cubic(t)
    # A jump during the gap: any window across it would ring.
    value[120:] += 100.0
    got = LocalCubic(t).derivatives(value)
    np.testing.assert_allclose(got.first, first, atol=1e-9)
    np.testing.assert_allclose(got.second, second, atol=1e-7)


def test_gaps_are_told_from_jitter(rng):
    t = np.arange(50) * 0.01
    late = t.copy()
    late[20:] += 0.01 * (GAP_FACTOR - 1.0) * 0.99
    np.testing.assert_array_equal(run_starts(late), [0])
    late[20:] += 0.01
    np.testing.assert_array_equal(run_starts(late), [0, 20])


@pytest.mark.parametrize("frames", [1, 2, 3, 4])
def test_short_runs_lower_the_order_and_say_so(frames):
    t = np.arange(frames) * 0.1
    value = t ** (frames - 1)
    got = LocalCubic(t).derivatives(value)
    assert np.all(got.weak == (frames < 4))
    np.testing.assert_allclose(got.value, value, atol=1e-12)
    if frames > 1:
        np.testing.assert_allclose(got.first, (frames - 1) * t ** (frames - 2), atol=1e-11)
    else:
        np.testing.assert_array_equal([got.first, got.second], [[0.0], [0.0]])


def test_sparse_sampling_takes_the_nearest_samples():
    t = np.arange(20) * 0.5
    value, first, second = cubic(t)
    got = LocalCubic(t, window_s=0.1).derivatives(value)
    np.testing.assert_allclose(got.first, first, atol=1e-9)
    np.testing.assert_allclose(got.second, second, atol=1e-9)


def smooth_path(model, t):
    """A path on the configuration manifold with known velocity and acceleration, by integration."""
    rng = np.random.default_rng(5)
    amplitude, phase = rng.normal(size=(2, model.nv))
    v = amplitude * np.sin(2.0 * t[:, None] + phase)
    a = 2.0 * amplitude * np.cos(2.0 * t[:, None] + phase)
    peer = model.pinocchio()
    q = [pin.integrate(peer, model.neutral(), rng.normal(size=model.nv))]
    # The midpoint rule in many small steps: its error is far below the tolerances below.
    for now, then in pairwise(t):
        here, parts = q[-1], 40
        step = (then - now) / parts
        for k in range(parts):
            middle = amplitude * np.sin(2.0 * (now + (k + 0.5) * step) + phase)
            here = pin.integrate(peer, here, middle * step)
        q.append(here)
    return np.array(q), v, a


def test_whole_body_motion_in_pinocchios_sense(model):
    t = np.arange(60) / 100.0
    q, v, a = smooth_path(model, t)
    motion = motion_from_configurations(model.dof_names, t, q, window_s=0.1)
    inner = slice(6, -6)
    np.testing.assert_allclose(motion.v[inner], v[inner], atol=2e-3)
    np.testing.assert_allclose(motion.a[inner], a[inner], atol=0.15)
    # The ends hang on half a window; they stay close, too.
    np.testing.assert_allclose(motion.v, v, atol=2e-2)
    np.testing.assert_array_equal(motion.q, q)


def test_error_falls_with_the_window(model):
    errors = []
    for window in (0.2, 0.1, 0.05):
        t = np.arange(0.0, 0.6, window / 10.0)
        q, v, _ = smooth_path(model, t)
        motion = motion_from_configurations(model.dof_names, t, q, window_s=window)
        middle = len(t) // 2
        errors.append(np.max(np.abs(motion.v[middle] - v[middle])))
    # Fourth order in theory at a window's centre: halving it must help at least eightfold.
    assert errors[1] < errors[0] / 8.0 and errors[2] < errors[1] / 8.0


def test_constant_spin_over_many_turns(rng):
    t = uneven(rng, 300)
    omega = np.array([1.0, -2.0, 8.0])
    quats = np.array([pin.Quaternion(pin.exp3(omega * x)).coeffs() for x in t])
    quats *= rng.choice([-1.0, 1.0], (300, 1))
    velocity, acceleration = LocalCubic(t).body_rates(quats)
    np.testing.assert_allclose(velocity, np.broadcast_to(omega, (300, 3)), atol=1e-9)
    np.testing.assert_allclose(acceleration, 0.0, atol=1e-6)


def test_whole_turns_of_a_joint_are_followed(model):
    t = np.arange(100) / 50.0
    q = np.tile(model.neutral(), (100, 1))
    angle = 4.0 * t
    q[:, 20] = (angle + np.pi) % (2 * np.pi) - np.pi
    motion = motion_from_configurations(model.dof_names, t, q)
    np.testing.assert_allclose(motion.v[:, 19], 4.0, atol=1e-9)
    np.testing.assert_array_equal(motion.q, q)


def test_motion_says_what_was_done(model):
    t = np.r_[np.arange(30), np.arange(60, 62)] / 60.0
    q = np.tile(model.neutral(), (32, 1))
    motion = motion_from_configurations(
        model.dof_names,
        t,
        q,
        provenance=Provenance("file", sha256="ab"),
        flags={"mine": np.ones(32, dtype=bool)},
    )
    assert set(motion.flags) == {"mine", "gap", "weak_derivative"}
    np.testing.assert_array_equal(np.flatnonzero(motion.flags["gap"]), [29, 30])
    np.testing.assert_array_equal(np.flatnonzero(motion.flags["weak_derivative"]), [30, 31])
    assert motion.provenance.sha256 == "ab"
    assert "window 0.2 s" in motion.provenance.steps[-1]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: LocalCubic([0.0, 1.0, 1.0]), "strictly increasing"),
        (lambda: LocalCubic([]), "at least one frame"),
        (lambda: LocalCubic([0.0, 1.0], window_s=0.0), "window_s"),
        (lambda: LocalCubic([0.0, 1.0], window_s=float("nan")), "window_s"),
        (lambda: LocalCubic([0.0, 1.0], gap_factor=1.0), "gap_factor"),
        (lambda: LocalCubic([0.0, 1.0]).derivatives([1.0]), "expected shape"),
        (lambda: LocalCubic([0.0, 1.0]).derivatives([1.0, np.nan]), "finite"),
        (lambda: LocalCubic([0.0, 1.0]).body_rates(np.eye(4)), "quaternions"),
        (lambda: LocalCubic([0.0, 1.0]).body_rates(np.ones((2, 4))), "norm 1"),
        (lambda: motion_from_configurations(("j",), [0.0, 1.0], np.zeros((2, 7))), "q: expected"),
    ],
)
def test_malformed_inputs_are_refused(call, message):
    with pytest.raises(MotionError, match=message):
        call()
