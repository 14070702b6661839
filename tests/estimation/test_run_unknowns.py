"""What a run did not see, or cannot be sure of, is unknown or within its bands."""

from dataclasses import replace

import numpy as np
import pytest

from estimation import HandState, RunSettings, estimate_run
from estimation.run.run_sensors import both_hands_load
from human.simulate import operator, simulate_still

from .run_scene import feet_of


def test_a_segment_lost_for_a_while_is_not_known_meanwhile(person):
    rng = np.random.default_rng(0)
    still = simulate_still(person, operator("average", rng, person), duration_s=1.2, rate_hz=50.0)
    motion, here = still.motion.select(slice(0, 60)), feet_of(still, rng).select(slice(0, 60))
    lost = np.arange(60) // 20 == 1
    flagged = replace(motion, flags={"unseen RightForeArm": lost})
    settings = RunSettings(model_errors=None, free_hands="none")
    chunk, summary = estimate_run(person, flagged, here, settings)
    seen, _ = estimate_run(person, motion, here, settings)
    never, _ = estimate_run(person, motion, here, replace(settings, unobserved=("RightForeArm",)))
    elbow = summary.joint_names.index("jRightElbow")
    assert np.array_equal(chunk.effort_known[:, elbow], ~lost)
    for other, frames in ((seen, ~lost), (never, lost)):
        assert np.array_equal(chunk.effort_known[frames], other.effort_known[frames])
        assert np.max(np.abs(chunk.torque_nm - other.torque_nm)[frames]) < 1e-6
        assert np.max(np.abs(chunk.torque_sd_nm / other.torque_sd_nm - 1.0)[frames]) < 1e-6
    assert any("RightForeArm was not seen" in text for text in summary.findings)


def test_a_load_too_small_to_be_sure_of_is_within_the_bands_of_the_arms(person):
    rng = np.random.default_rng(5)
    held = simulate_still(
        person,
        operator("average", rng, person),
        load_kg={"RightHandCOM": 2.0},
        duration_s=2.0,
        rate_hz=50.0,
    )
    # With a body mass that nobody weighed, two kilograms may as well be none.
    chunk, _ = estimate_run(person, held.motion, feet_of(held, rng), RunSettings())
    assert np.all(chunk.hands_state == HandState.FREE)
    known = np.all(chunk.torque_known, axis=0)
    assert np.mean(known) > 0.9
    error = np.abs(np.mean(chunk.torque_nm - held.truth.dynamics.effort[:, 6:], axis=0))
    assert np.all(error[known] < 1.5 * np.mean(chunk.torque_sd_nm, axis=0)[known])


def test_what_two_hands_may_share_is_an_even_spread_once_their_sum_is_known():
    force = np.tile([0.0, 36.0, -48.0], (1, 2, 1))
    right, left = both_hands_load(RunSettings(), force, None)
    one, other = (np.asarray(hand.covariance)[0, :3, :3] for hand in (right, left))
    left_over = one - one @ np.linalg.inv(one + other) @ one
    along = np.array([0.0, 0.6, -0.8])
    assert along @ left_over @ along == pytest.approx(60.0**2 / 12.0)
    assert np.asarray(right.value)[0, :3] == pytest.approx(0.5 * force[0, 0])
