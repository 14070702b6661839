from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from estimation import MeasurementError
from estimation.feet.foot_forces import FootState, feet_from_plates
from estimation.feet.required_wrench import required_wrench
from estimation.feet.soles import soles_of
from human import HumanModel, LocalCubic, Motion
from human.marker_recording import ForcePlate, PlateForces
from human.recording import ReadingReport
from human.rotations import quaternion_multiply, rotation_vector_to_quaternion
from human.simulate import SensorNoise, operator, simulate_still

from .plate_scene import PlateScene, floor_plate, plate_forces, walking_scene

#: One plate for each foot, all along the way: what a split-belt treadmill has.
RAILS = (floor_plate("1", 1.0, -0.35, (3.0, 0.69)), floor_plate("2", 1.0, 0.35, (3.0, 0.69)))
NOISE = SensorNoise(sd=[1.0, 1.0, 2.0, 0.3, 0.3, 0.2])


@pytest.fixture(scope="module")
def scene(person: HumanModel) -> PlateScene:
    return walking_scene(person)


@pytest.fixture
def rails(scene):
    return scene.plates(RAILS, np.random.default_rng(3), NOISE)


def found(scene, plates, **options):
    return feet_from_plates(scene.model, scene.motion, plates, **({"window_s": 0.0} | options))


def error_n(scene, feet):
    """Largest error of the forces where they are said to be known, and how often they are."""
    worst, shares = 0.0, []
    for foot, truth in zip((feet.right, feet.left), scene.truth, strict=True):
        ok = foot.usable
        shares.append(ok.mean())
        worst = max(worst, np.abs(foot.wrench - truth)[ok, :3].max())
    return worst, min(shares)


def test_every_stance_goes_to_the_foot_that_stands(scene, rails):
    feet = found(scene, rails)
    worst, known = error_n(scene, feet)
    assert known == 1.0
    assert worst < 12.0  # four sd of the noise; at a switch one sample more or less
    for foot, truth, side in zip((feet.right, feet.left), scene.truth, (0, 1), strict=True):
        measured = foot.state == FootState.MEASURED
        assert np.mean(measured == (truth[:, 2] > 20.0)) > 0.98
        stances = [s for s in feet.stances if s.foot == ("right", "left")[side]]
        assert {s.plate for s in stances} == {str(side + 1)}
        # Four stances of the right foot in this walk, and four of the left.
        assert len(stances) == 4
    assert not feet.findings


def test_the_covariance_is_that_of_the_plate_seen_from_the_world(scene, rails):
    """Monte Carlo: noise about the plate's origin, carried to the world's."""
    feet = found(scene, rails, force_sd_n=3.0, moment_sd_nm=0.5).right.select(slice(0, 1))
    rng = np.random.default_rng(0)
    force, moment = rng.normal(scale=3.0, size=(200000, 3)), rng.normal(scale=0.5, size=(200000, 3))
    about_world = np.concatenate([force, moment + np.cross(RAILS[0].center, force)], axis=1)
    np.testing.assert_allclose(feet.covariance[0], np.cov(about_world.T), atol=0.15)


def test_smoothing_is_that_of_the_derived_accelerations(scene):
    """The plates' sum is mass times the derived acceleration of the centre of mass, to 1 N."""
    model, time = scene.model.pinocchio(), scene.motion.time_s
    data = model.createData()
    center = np.array([pin.centerOfMass(model, data, q).copy() for q in scene.motion.q])
    rate = LocalCubic(time, window_s=0.2).derivatives(center).second
    needed = scene.model.total_mass_kg * (rate - np.array([0.0, 0.0, -9.81]))
    left_over = {}
    for window_s in (0.0, 0.1, 0.2, 0.3):
        feet = found(scene, scene.plates(RAILS, np.random.default_rng(3)), window_s=window_s)
        total = (feet.right.wrench + feet.left.wrench)[:, :3]
        left_over[window_s] = np.sqrt(np.mean((total - needed)[20:-20] ** 2))
    assert left_over[0.2] < 1.0
    assert min(left_over[w] for w in (0.0, 0.1, 0.3)) > 10.0


def test_a_zero_holds_on_where_a_plate_is_never_left(scene, rails):
    off = rails.force.copy()
    off[:, 0, 2] += 30.0
    spoilt = replace(rails, force=off)
    first = found(scene, spoilt)
    stance = np.flatnonzero(scene.truth[0][:, 2] > 300.0)
    stance = stance[: np.flatnonzero(np.diff(stance) > 1)[0]]
    later = scene.motion.select(stance)
    part = (rails.time_s >= later.time_s[0]) & (rails.time_s <= later.time_s[-1])
    plates = replace(spoilt, time_s=rails.time_s[part], force=off[part], moment=rails.moment[part])
    ignorant = feet_from_plates(scene.model, later, plates, window_s=0.0)
    assert any("plate 1: never unloaded" in words for words in ignorant.assumed)
    told = feet_from_plates(scene.model, later, plates, window_s=0.0, zeros=first.zeros)
    error = np.abs(told.right.wrench[:, 2] - scene.truth[0][stance, 2])
    assert np.max(error) < 8.0
    assert told.zeros["1"].reading == pytest.approx(first.zeros["1"].reading)


def test_zeros_that_drift_are_taken_off_and_said(scene, rails):
    drift = np.linspace(12.0, 30.0, len(rails.time_s))[:, None]
    off = rails.force.copy()
    off[:, 0] += drift * np.array([0.3, -0.2, -1.0])
    moment = rails.moment.copy()
    moment[:, 0] += drift * np.array([0.1, 0.2, 0.0])
    feet = found(scene, replace(rails, force=off, moment=moment))
    said = [words for words in feet.assumed if words.startswith("plate 1: unloaded")]
    assert len(said) == 1 and "drifting" in said[0]
    clean = found(scene, rails)
    # Before the first and after the last unloaded time the drift is not known.
    middle = slice(140, 420)
    assert np.abs(feet.right.wrench - clean.right.wrench)[middle, :3].max() < 3.0
    assert not any("plate 2: unloaded" in words for words in feet.assumed)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda f, m: (-f, -m), "points down"),
        (lambda f, m: (f * 1e-3, m * 1e-3), "kN"),
        (lambda f, m: (f / (70.0 * 9.81), m / (70.0 * 9.81)), "body weight"),
        (lambda f, m: (f, m * 1e3), "moments in N mm"),
        (lambda f, m: (f * 1e-3, m), "kN"),
        (lambda f, m: (-f * 1e-3, -m * 1e-3), "points down"),
    ],
)
def test_units_and_signs_are_put_right_and_said(scene, rails, spoil, words):
    force, moment = spoil(rails.force, rails.moment)
    feet = found(scene, replace(rails, force=force, moment=moment))
    assert any(words in text for text in feet.assumed)
    np.testing.assert_allclose(feet.right.wrench, found(scene, rails).right.wrench, atol=0.2)


def test_a_unit_that_several_readings_explain_is_named_and_left(scene, rails):
    spoilt = replace(rails, force=0.1 * rails.force, moment=0.1 * rails.moment)
    feet = found(scene, spoilt)
    assert any("unit is not N" in text for text in feet.findings)
    assert feet.right.wrench[:, 2].max() < 100.0


@pytest.mark.parametrize("turned", [False, True])
def test_plates_plugged_into_each_others_place_are_put_back(scene, turned):
    near = floor_plate("a", 0.05, 0.0, (0.5, 1.2))
    far = floor_plate("b", 1.2, 0.0, (0.6, 1.2))
    if turned:
        far = replace(far, rotation=np.diag([-1.0, -1.0, 1.0]))
    right = scene.plates((near, far), np.random.default_rng(3), NOISE)
    turn = far.rotation
    force, moment = right.force[:, ::-1] @ turn, right.moment[:, ::-1] @ turn
    feet = found(scene, replace(right, force=force, moment=moment))
    assert any("exchanged" in text for text in feet.assumed)
    as_plugged = found(scene, right)
    np.testing.assert_array_equal(feet.right.state, as_plugged.right.state)
    np.testing.assert_allclose(feet.right.wrench, as_plugged.right.wrench, atol=1e-9)
    assert not any("exchanged" in text for text in as_plugged.assumed)


def test_a_plate_at_its_limit_makes_those_frames_unknown_and_no_others(scene):
    limited = SensorNoise(sd=NOISE.sd, limit=[np.inf, np.inf, 640.0, np.inf, np.inf, np.inf])
    feet = found(scene, scene.plates(RAILS, np.random.default_rng(3), limited))
    over = scene.truth[0][:, 2] > 650.0
    assert over.sum() > 20
    assert np.all(feet.right.state[over] == FootState.SATURATED)
    far_below = scene.truth[0][:, 2] < 600.0
    assert not np.any(feet.right.state[far_below] == FootState.SATURATED)
    assert any("at its limit" in text for text in feet.findings)
    assert feet.right.variance[over, 2].min() > 1e5
    worst, known = error_n(scene, feet)
    assert worst < 12.0 and known > 0.5


def test_steps_of_a_coarse_converter_are_no_limit(scene):
    exact = scene.plates(RAILS, np.random.default_rng(3))
    coarse = replace(exact, force=5.0 * np.round(exact.force / 5.0))
    top = coarse.force[:, 0, 2] == coarse.force[:, 0, 2].max()
    assert np.count_nonzero(top) > 4
    assert np.all(found(scene, coarse).right.state != FootState.SATURATED)


def test_lost_samples_are_unknown(scene, rails):
    force, moment = rails.force.copy(), rails.moment.copy()
    time = rails.time_s
    gone = (time > 0.4) & (time < 0.6)
    force[gone, 0], moment[gone, 0] = force[gone, 0][0], moment[gone, 0][0]
    feet = found(scene, replace(rails, force=force, moment=moment))
    inside = (scene.motion.time_s > 0.42) & (scene.motion.time_s < 0.58)
    assert np.all(feet.right.state[inside] == FootState.UNMEASURED)
    assert np.all(feet.left.usable)


def test_samples_repeated_to_a_finer_clock_are_not_lost(scene, rails):
    held = np.arange(len(rails.time_s)) // 5 * 5
    feet = found(scene, replace(rails, force=rails.force[held], moment=rails.moment[held]))
    assert np.all(feet.known)
    assert not feet.findings


def test_feet_beside_the_plates_are_not_known_and_the_others_stay(scene):
    tiles = (floor_plate("a", 0.55, 0.0, (0.6, 0.6)), floor_plate("b", 1.16, 0.0, (0.6, 0.6)))
    feet = found(scene, scene.plates(tiles, np.random.default_rng(3), NOISE))
    for foot, truth in zip((feet.right, feet.left), scene.truth, strict=True):
        loaded, carried = truth[:, 2] > 100.0, foot.wrench[:, 2] > 50.0
        assert np.mean(foot.state[loaded & ~carried] == FootState.UNMEASURED) > 0.95
        wrong = foot.usable & (np.abs(foot.wrench - truth)[:, 2] > 100.0)
        assert wrong.mean() < 0.02
    assert np.mean(feet.known) > 0.1
    assert any("stands on no plate" in text for text in feet.findings)


def test_a_foot_that_rests_beside_the_plates_is_unknown_whatever_the_hands_hide(person):
    """A sixth of the weight on the floor is as much as the box in the hands: none is missing."""
    rng = np.random.default_rng(0)
    still = simulate_still(
        person,
        operator("average", rng, person),
        load_kg={"RightHandCOM": 6.0, "LeftHandCOM": 6.0},
        rate_hz=50.0,
    )
    right, left = still.truth.dynamics.feet
    borne = right * (1.0 + 0.65 * left[:, 2:3] / right[:, 2:3])
    plates = plate_forces(still.motion.time_s, RAILS[:1], borne[:, None])
    feet = feet_from_plates(person, still.motion, plates, window_s=0.0)
    assert np.all(feet.right.state == FootState.MEASURED)
    assert np.all(feet.left.state == FootState.UNMEASURED)


def test_a_foot_that_rolls_from_plate_to_plate_has_the_sum_of_all(scene):
    """Strips of 20 cm across the way: each stance is on two or three of them."""
    strips = tuple(
        floor_plate(f"{side} {k}", -0.2 + 0.2 * k, y, (0.2, 0.69))
        for side, y in (("r", -0.35), ("l", 0.35))
        for k in range(14)
    )
    feet = found(scene, scene.plates(strips, np.random.default_rng(3), NOISE))
    worst, known = error_n(scene, feet)
    assert known == 1.0
    assert worst < 15.0
    assert {s.plate[0] for s in feet.stances if s.foot == "right"} == {"r"}
    assert len({s.plate for s in feet.stances}) > 8


def test_two_feet_on_one_plate_share_it_and_their_sum_is_exact(scene):
    whole = (floor_plate("a", 1.0, 0.0, (3.0, 1.3)),)
    feet = found(scene, scene.plates(whole, np.random.default_rng(3)))
    total = feet.right.wrench + feet.left.wrench
    np.testing.assert_allclose(total, scene.truth.sum(axis=0), atol=1e-6)
    shared = feet.right.state == FootState.SHARED
    both = scene.contact.all(axis=1)
    assert np.mean(shared[both]) == 1.0
    alone = feet.right.state == FootState.MEASURED
    assert alone.sum() > 50
    assert not np.any(both & alone)
    assert np.all(feet.known)


def test_both_feet_on_a_plate_of_which_nothing_is_known_but_its_force(scene):
    """A log often holds one wrench and no corners; it enters between feet that stand abreast."""
    model = scene.model
    time_s = np.arange(0.0, 3.0, 0.01)
    q = np.tile(model.neutral(), (len(time_s), 1))
    right, _ = soles_of(model, q).center[0]
    q[:, 2] -= right[2]
    still = np.zeros((len(time_s), model.nv))
    motion = Motion(model.dof_names, time_s, q, still, still)
    needed = required_wrench(model, motion)
    # Leans from one side to the other, once so far that the force is all but under one sole.
    needed[:, 3] += 0.06 * needed[:, 2] * np.sin(2.0 * time_s)
    plate = ForcePlate("log", np.zeros(3), 0.0)
    plates = PlateForces(
        time_s, (plate,), needed[:, None, :3], needed[:, None, 3:], ReadingReport()
    )
    feet = feet_from_plates(model, motion, plates, window_s=0.0)
    assert [stance.foot for stance in feet.stances] == ["both"]
    assert np.all(feet.right.state == FootState.SHARED)
    np.testing.assert_allclose(feet.right.wrench + feet.left.wrench, needed, atol=1e-6)


def test_half_a_foot_on_a_plate_is_not_known(scene):
    """The right foot's second stance (x 0.4 to 0.7 m): half of it bears on the floor beside."""
    rng = np.random.default_rng(3)
    full = scene.plates(RAILS, rng)
    time = full.time_s
    during = (time > 1.69) & (time < 2.41)
    wrench = np.concatenate(
        [full.force, full.moment + np.cross([p.center for p in RAILS], full.force)], axis=2
    )
    wrench[during, 0] *= 0.5
    at = np.median((-wrench[during, 0, 4] / np.maximum(wrench[during, 0, 2], 1.0))[100:250])
    before = floor_plate("1", at - 2.0, -0.35, (4.0, 0.69))
    spoilt = plate_forces(time, (before, RAILS[1]), wrench)
    feet = found(scene, spoilt)
    inside = (scene.motion.time_s > 1.8) & (scene.motion.time_s < 2.3)
    assert np.all(feet.right.state[inside] == FootState.UNMEASURED)
    assert any("half on plate 1" in text for text in feet.findings)
    assert np.all(feet.left.usable)


def test_moments_that_no_sole_can_hold_are_named(scene, rails):
    spoilt = rails.moment.copy()
    spoilt[..., 2] += 0.5 * rails.force[..., 2]
    feet = found(scene, replace(rails, moment=spoilt))
    assert any("no sole can hold" in text for text in feet.findings)


def test_what_is_loaded_under_no_foot_is_left_out(scene, rails):
    rail = ForcePlate("rail", np.array([1.0, -1.5, 0.9]), 0.9)
    force = np.concatenate([rails.force, np.zeros((len(rails.time_s), 1, 3))], axis=1)
    force[200:900, 2] = [0.0, 0.0, 120.0]
    moment = np.concatenate([rails.moment, np.zeros((len(rails.time_s), 1, 3))], axis=1)
    feet = found(scene, replace(rails, plates=(*rails.plates, rail), force=force, moment=moment))
    assert any("plate rail" in text and "left out" in text for text in feet.findings)
    np.testing.assert_allclose(feet.right.wrench, found(scene, rails).right.wrench, atol=1e-9)


def test_support_that_no_plate_feels_is_said(scene, rails):
    less = replace(rails, force=0.75 * rails.force, moment=0.75 * rails.moment)
    assert any("plates lack 2" in text for text in found(scene, less).findings)


def test_the_caller_knows_better(scene, rails):
    feet = found(scene, rails, assign={"1": "left", "2": "right"})
    assert all(s.given for s in feet.stances)
    assert np.all(feet.left.state[:50] == FootState.MEASURED)
    assert any("given to the left by the caller" in text for text in feet.findings)
    with pytest.raises(MeasurementError, match="assign: expected one of the plates 1, 2"):
        found(scene, rails, assign={"7": "left"})


def test_clock_and_span_of_the_plates_are_their_own(scene, rails):
    early = replace(rails, time_s=rails.time_s + 3.0)
    feet = found(scene, early, clock_offset_s=-3.0)
    np.testing.assert_allclose(feet.right.wrench, found(scene, rails).right.wrench, atol=1e-6)
    with pytest.raises(MeasurementError, match="clock_offset_s"):
        found(scene, replace(rails, time_s=rails.time_s + 30.0))
    part = slice(200, 300)
    cut = feet_from_plates(scene.model, scene.motion.select(part), rails, window_s=0.0)
    whole = found(scene, rails).select(part)
    np.testing.assert_allclose(cut.right.wrench, whole.right.wrench, atol=2.0)


def test_frames_without_plate_samples_are_not_known(scene, rails):
    keep = (rails.time_s < 0.3) | (rails.time_s > 0.8)
    gap = replace(
        rails, time_s=rails.time_s[keep], force=rails.force[keep], moment=rails.moment[keep]
    )
    feet = found(scene, gap)
    inside = (scene.motion.time_s > 0.32) & (scene.motion.time_s < 0.78)
    assert np.all(feet.right.state[inside] == FootState.UNMEASURED)
    assert np.all(feet.right.usable[scene.motion.time_s > 0.9])


def test_plates_in_another_place_than_the_motion_are_noticed(scene, rails):
    shift = np.array([0.09, 0.0, 0.0])
    moved = tuple(
        replace(plate, origin=plate.origin + shift, corners=plate.corners + shift)
        for plate in rails.plates
    )
    (words,) = found(scene, replace(rails, plates=moved)).findings
    assert "(+0.09, " in words
    assert "where the motion needs them" in words


def test_noise_is_neither_a_person_nor_a_unit(scene, rails):
    rng = np.random.default_rng(4)
    for size in (0.6, 5.0):
        noise = replace(
            rails,
            force=rng.normal(scale=size, size=rails.force.shape),
            moment=rng.normal(scale=size, size=rails.force.shape),
        )
        feet = found(scene, noise)
        assert not feet.stances
        assert not any("multiplied" in text or "turned" in text for text in feet.assumed)
        assert any("next to nothing" in text for text in feet.findings)


def test_a_small_zero_is_no_person_in_another_unit(scene, rails):
    """An unloaded plate far from the walk that steadily reads 0.7 N, as 70 kg would in kN."""
    plate = ForcePlate("far", np.array([0.0, 4.0, 0.0]), 0.0)
    force, moment = np.zeros((2, len(rails.time_s), 1, 3))
    force[..., 2] = 0.7
    feet = found(scene, replace(rails, plates=(plate,), force=force, moment=moment))
    assert not feet.stances
    assert not any("multiplied" in text for text in feet.assumed)


def test_turning_the_whole_scene_turns_the_answer(scene, rails):
    angle, shift = 1.1, np.array([2.0, -1.0, 0.0])
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    q = scene.motion.q.copy()
    q[:, :3] = q[:, :3] @ R.T + shift
    turn = np.broadcast_to(rotation_vector_to_quaternion(np.array([0.0, 0.0, angle])), (len(q), 4))
    q[:, 3:7] = quaternion_multiply(turn, q[:, 3:7])
    there = replace(
        rails,
        plates=tuple(
            replace(p, origin=R @ p.origin + shift, corners=p.corners @ R.T + shift)
            for p in rails.plates
        ),
        force=rails.force @ R.T,
        moment=rails.moment @ R.T,
    )
    turned = feet_from_plates(scene.model, replace(scene.motion, q=q), there)
    here = found(scene, rails)
    for a, b in ((turned.right, here.right), (turned.left, here.left)):
        np.testing.assert_array_equal(a.state, b.state)
        force = b.wrench[:, :3] @ R.T
        moment = b.wrench[:, 3:] @ R.T + np.cross(shift, force)
        np.testing.assert_allclose(a.wrench, np.concatenate([force, moment], axis=1), atol=1e-8)
