from dataclasses import replace

import numpy as np
import pytest

from estimation import (
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    MeasurementError,
    MissingMeasurementError,
    TreeError,
    calibrate_stance,
    estimate,
    payload,
    real_tree,
    with_mass,
)

from .balanced_scene import balanced, random_motion


@pytest.fixture(scope="module")
def tree(person):
    return real_tree(person)


@pytest.fixture(scope="module")
def moving(person):
    rng = np.random.default_rng(11)
    return balanced(person, *random_motion(person, rng, 40), rng)


def standing(person, load_kg, frames=3):
    q = np.tile(person.neutral(), (frames, 1))
    still = np.zeros((frames, person.nv))
    return balanced(person, q, still, still, np.random.default_rng(6), load_kg)


def run(tree, scene, sensors, **more):
    return estimate(tree, scene.q, scene.v, scene.a, sensors, **more)


def test_five_kilograms_in_the_right_hand_of_a_t_pose(person, tree):
    scene = standing(person, 5.0)
    found = run(tree, scene, scene.sensors)
    for definition in ("inertial", "vertical", "norm"):
        held = payload(found, definition)
        np.testing.assert_allclose(held.mass_kg, 5.0, atol=0.02)
        assert held.bands == "uncertainty"
        assert np.all(held.split_observable)
        assert not np.any(held.weightless)
    np.testing.assert_allclose(found.torque, scene.torque, atol=0.05)


@pytest.mark.parametrize("definition", ["inertial", "vertical", "norm"])
def test_bands_cover_the_mass_of_a_standing_load(person, tree, definition):
    scene = standing(person, 5.0, 200)
    found = run(tree, scene, scene.noisy(np.random.default_rng(0)))
    held = payload(found, definition, (0.025, 0.5, 0.975))
    inside = (held.quantiles_kg[:, 0] < 5.0) & (held.quantiles_kg[:, 2] > 5.0)
    assert 0.90 < np.mean(inside) <= 0.99
    assert np.max(held.sd_kg) < 0.35
    np.testing.assert_allclose(held.quantiles_kg[:, 1], held.mass_kg, atol=0.02)


def test_in_motion_only_the_inertial_mass_is_the_mass(tree, moving):
    found = run(tree, moving, moving.sensors)
    np.testing.assert_allclose(payload(found).mass_kg, 5.0, atol=0.02)
    assert np.abs(payload(found, "norm").mass_kg - 5.0).max() > 1.0
    assert np.abs(payload(found, "vertical").mass_kg - 5.0).max() > 1.0


def test_without_a_load_the_norm_has_a_floor_that_its_quantiles_show(person, tree):
    scene = standing(person, 0.0, 100)
    found = run(tree, scene, scene.noisy(np.random.default_rng(1)))
    norm, inertial = payload(found, "norm"), payload(found, "inertial")
    assert np.min(norm.quantiles_kg) > 0.0
    assert np.mean(inertial.quantiles_kg[:, 0] < 0.0) > 0.8
    assert abs(np.mean(inertial.mass_kg)) < 0.1 < np.mean(norm.mass_kg)


def test_of_two_free_hands_only_the_sum_can_be_told(tree, moving):
    sensors = [*moving.sensors, FreeWrench("LeftHandCOM")]
    held = payload(run(tree, moving, sensors))
    assert held.sites == ("RightHandCOM", "LeftHandCOM")
    assert not np.any(held.split_observable)
    assert np.max(held.sd_kg) < 1.0
    np.testing.assert_allclose(held.force_world, moving.load_world(), atol=0.5)
    nothing = [*moving.sensors, FreeWrench("LeftHandCOM", 0.01, 0.01)]
    assert np.all(payload(run(tree, moving, nothing)).split_observable)


def test_a_free_fall_is_said_to_be_weightless(person, tree):
    frames = 2
    q, still = np.tile(person.neutral(), (frames, 1)), np.zeros((frames, person.nv))
    falling = still.copy()
    falling[:, 2] = -9.81
    hands = [FreeWrench("RightHandCOM")]
    held = payload(estimate(tree, q, still, falling, hands))
    assert np.all(held.weightless)
    assert np.all(np.isfinite(held.mass_kg))


def test_a_payload_needs_a_place_to_act(tree, moving):
    sensors = [s for s in moving.sensors if not isinstance(s, FreeWrench)]
    with pytest.raises(MissingMeasurementError, match="FreeWrench"):
        payload(run(tree, moving, sensors))


def test_an_unloaded_stance_finds_the_mass_and_takes_the_phantom_away(person):
    tree, scene = real_tree(person), standing(person, 0.0, 50)
    heavy = with_mass(tree, 71.0)
    noisy = scene.noisy(np.random.default_rng(3))
    phantom = payload(run(heavy, scene, noisy), "vertical").mass_kg
    assert np.mean(phantom) < -0.5
    found = calibrate_stance(run(heavy, scene, noisy, method="deterministic"))
    assert found.error_kg == pytest.approx(-1.0, abs=3 * found.sd_kg)
    assert found.mass_kg == pytest.approx(70.0, abs=0.1)
    assert np.abs(found.sideways_n).max() < 1.0
    right = with_mass(heavy, found.mass_kg)
    assert np.mean(payload(run(right, scene, noisy), "vertical").mass_kg) == pytest.approx(
        0.0, abs=0.05
    )


def test_a_calibration_wants_a_person_who_stands_still(tree, moving):
    with pytest.raises(MeasurementError, match="standing still"):
        calibrate_stance(run(tree, moving, moving.sensors, method="deterministic"))
    with pytest.raises(MeasurementError, match="deterministic"):
        calibrate_stance(run(tree, moving, moving.sensors))
    with pytest.raises(TreeError, match="more than zero"):
        with_mass(tree, -1.0)


def test_a_saturated_plate_shows_in_the_residual(person, tree):
    scene = standing(person, 0.0)
    held = [s for s in scene.sensors if not isinstance(s, FreeWrench)]
    good = run(tree, scene, held)
    worse = [
        replace(s, value=np.clip(s.value, -100.0, 100.0)) if isinstance(s, ForceTorque) else s
        for s in held
    ]
    assert any(isinstance(s, JointAcceleration) for s in held)
    bad = run(tree, scene, worse)
    assert np.all(good.residual_chi2 < 1.0)
    assert np.all(bad.residual_chi2 > 100.0)


@pytest.mark.parametrize("sd", [-5.0, 0.0, float("nan"), float("inf")])
@pytest.mark.parametrize("name", ["force_sd", "moment_sd"])
def test_how_hard_something_may_push_is_a_positive_number(name, sd):
    with pytest.raises(MeasurementError, match=name):
        FreeWrench("RightHandCOM", **{name: sd})
