from dataclasses import fields, replace

import numpy as np
import pytest

from estimation import (
    Accelerometer,
    Balance,
    FootState,
    HandState,
    ModelErrors,
    RecordingRun,
    RunChunk,
    RunInputError,
    RunSettings,
    estimate_run,
    tare_stance,
)
from human import Motion, Subject, generate_model
from human.simulate import operator, simulate_box_handling, simulate_still

from .run_scene import feet_of, turned, with_state

NOISE = RunSettings(model_errors=None)
FEW = ModelErrors(pairs=3, grid_s=1.0)


@pytest.fixture(scope="module")
def carried(person):
    """Standing, taking a box of 9.55 kg with both hands, carrying and leaving it."""
    rng = np.random.default_rng(0)
    who = operator("average", rng, person)
    return simulate_box_handling(person, who, rng, box_kg=9.55, rate_hz=50.0)


@pytest.fixture(scope="module")
def feet(carried):
    return feet_of(carried, np.random.default_rng(1))


@pytest.fixture(scope="module")
def answer(person, carried, feet):
    return estimate_run(person, carried.motion, feet, NOISE)


@pytest.fixture(scope="module")
def stance(person):
    return simulate_still(
        person, operator("average", np.random.default_rng(0), person), rate_hz=50.0
    )


def truth(simulated):
    return simulated.truth.dynamics.effort[:, 6:]


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def load_of(simulated):
    return sum(simulated.truth.load_kg.values())


def test_a_box_in_both_hands_is_weighed_in_the_hold_and_nothing_beside_it(carried, answer):
    chunk, summary = answer
    states = [hold.state for hold in summary.holds]
    assert states == [HandState.FREE, HandState.LOADED, HandState.FREE]
    for hold, true in zip(summary.holds, (0.0, 9.55, 0.0), strict=True):
        mass = hold.mass()
        assert abs(mass.mass_kg - true) < min(0.3, 3.0 * mass.sd_kg)
        assert mass.quantiles_kg[0] < mass.mass_kg < mass.quantiles_kg[2]
        assert hold.split_kg is None
    loaded = load_of(carried) > 0.5
    assert np.mean((chunk.hands_state == HandState.LOADED) == loaded) > 0.97
    assert summary.bands == "noise"
    # What the body alone leaves over is the box, whatever was found of it.
    held = chunk.hands_state == HandState.LOADED
    assert np.median(chunk.residual_n[held, 2]) == pytest.approx(-9.81 * 9.55, abs=3.0)
    assert summary.plates_minus_model_kg[2] == pytest.approx(9.55, abs=1.0)
    assert summary.holds[1].mass("norm").mass_kg == pytest.approx(9.55, abs=0.4)


@pytest.mark.parametrize("right_kg", [8.0, 4.0, 0.0])
def test_however_two_hands_share_the_bands_hold_and_the_back_is_known(person, right_kg):
    """Eight kilograms, of which nobody is told which hand bears them; an errant model besides."""
    rng = np.random.default_rng(4)
    held = simulate_still(
        person,
        operator("average", rng, person),
        load_kg={"RightHandCOM": right_kg, "LeftHandCOM": 8.0 - right_kg},
        duration_s=1.0,
        rate_hz=50.0,
    )
    for settings in (NOISE, RunSettings(free_hands="both", model_errors=FEW)):
        chunk, summary = estimate_run(person, held.motion, feet_of(held, rng), settings)
        assert np.all(chunk.hands_state == HandState.LOADED)
        assert np.all(chunk.low_back_known) and not np.any(chunk.hand_kg_known)
        assert np.all(np.sum(chunk.torque_known, axis=1) > 60)
        z = (chunk.torque_nm - truth(held)) / chunk.torque_sd_nm
        assert np.max(np.abs(z[chunk.torque_known])) < 4.0
        # However the load is shared, it is within the 5 and 95 % quantiles of every torque.
        assert np.max(np.abs(np.mean(z, axis=0)[np.all(chunk.torque_known, axis=0)])) < 1.645
        assert any("any split between nothing and all" in text for text in summary.assumed)


def test_which_of_two_hands_bears_the_box_is_not_made_up(answer):
    chunk, summary = answer
    loaded = chunk.hands_state == HandState.LOADED
    assert np.all(chunk.hand_state[loaded] == HandState.UNKNOWN)
    assert not np.any(chunk.hand_kg_known[loaded])
    shoulder = summary.joint_names.index("jRightShoulder")
    wide = chunk.effort_nm[loaded][:, shoulder, 2] - chunk.effort_nm[loaded][:, shoulder, 0]
    assert np.median(wide) > 15.0  # N m: half of 9.55 kg, more or less, at an arm's length
    assert np.mean(chunk.effort_known[loaded][:, shoulder]) > 0.8
    assert np.all(chunk.low_back_known)
    assert np.all(chunk.payload_known)


def test_what_is_called_known_is_right(carried, answer):
    chunk, summary = answer
    error = chunk.torque_nm - truth(carried)
    free = chunk.hands_state == HandState.FREE
    # Past the edges of a hold, where the state is not yet that of the truth.
    settled = free & (load_of(carried) == 0.0)
    assert np.mean(chunk.torque_known[settled]) > 0.99
    assert rms(error[settled]) < 1.0
    assert rms(error[chunk.torque_known]) < 1.0
    inside = np.abs(error) < 1.96 * chunk.torque_sd_nm
    assert np.mean(inside[chunk.torque_known]) > 0.95
    assert np.max(chunk.torque_sd_nm[chunk.torque_known]) < 25.0  # 30 N at an arm's length
    assert summary.joint_known_share["jL5S1"] == 1.0
    assert 0.2 < summary.joint_known_share["jRightElbow"] < 0.6
    assert summary.joint_known_share["jRightShoulder"] > 0.8


def test_one_hand_that_may_bear_bears_all_and_shows_it(person, stance):
    """A second without load, then two with 4 kg hanging from the right hand."""
    rng = np.random.default_rng(2)
    held = simulate_still(
        person,
        operator("average", rng, person),
        load_kg={"RightHandCOM": 4.0},
        duration_s=2.0,
        rate_hz=50.0,
    )
    run = RecordingRun(person, replace(NOISE, free_hands="right"))
    chunks = list(run.add(stance.motion, feet_of(stance, rng)))
    after = stance.motion.time_s[-1] + 0.02 + held.motion.time_s
    feet = replace(feet_of(held, rng), time_s=after)
    chunks += run.add(replace(held.motion, time_s=after), feet)
    chunk, summary = RunChunk.joined(chunks), run.finish()
    free, loaded = summary.holds
    assert (free.state, loaded.state) == (HandState.FREE, HandState.LOADED)
    assert loaded.hands == ("right",)
    assert loaded.split_kg == pytest.approx((4.0,), abs=0.05)
    assert abs(free.mass().mass_kg) < 3.0 * free.mass().sd_kg
    assert np.all(chunk.torque_known)
    assert np.all(chunk.hand_state[:, 1] == HandState.FREE)
    assert loaded.start_s == pytest.approx(after[0], abs=0.2)
    true = np.concatenate([truth(stance), truth(held)])
    settled = np.abs(chunk.time_s - after[0]) > 0.3
    assert rms((chunk.torque_nm - true)[settled]) < 0.5


def test_portions_make_no_difference(person, carried, feet, answer):
    run = RecordingRun(person, NOISE)
    chunks = []
    for rows in np.array_split(np.arange(len(carried.motion)), 3):
        chunks.extend(run.add(carried.motion.select(rows), feet.select(rows)))
    chunk, summary = RunChunk.joined(chunks), run.finish()
    for item in fields(RunChunk):
        np.testing.assert_allclose(
            getattr(chunk, item.name), getattr(answer[0], item.name), atol=1e-8, err_msg=item.name
        )
    assert len(summary.holds) == 3
    for ours, theirs in zip(summary.holds, answer[1].holds, strict=True):
        assert ours.mass().mass_kg == pytest.approx(theirs.mass().mass_kg, abs=1e-9)
        assert ours.mass().sd_kg == pytest.approx(theirs.mass().sd_kg, abs=1e-9)
        assert (ours.start_s, ours.end_s) == (theirs.start_s, theirs.end_s)
    assert summary.findings == answer[1].findings


def test_a_scene_turned_about_the_vertical_gives_the_same(person, carried, feet):
    rows = slice(60, 160)
    motion, here = carried.motion.select(rows), feet.select(rows)
    settings = RunSettings(model_errors=ModelErrors(pairs=2))
    one, first = estimate_run(person, motion, here, settings)
    two, second = estimate_run(person, *turned(motion, here, 2.1, (3.0, -1.0, 0.0)), settings)
    for name in (
        "torque_nm",
        "torque_sd_nm",
        "effort_nm",
        "low_back_force_n",
        "low_back_moment_nm",
        "payload_kg",
        "hand_kg",
        "loaded_probability",
        "torque_known",
    ):
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), atol=1e-9, err_msg=name)
    assert first.plates_minus_model_kg == pytest.approx(second.plates_minus_model_kg, abs=1e-9)


def test_a_foot_that_nothing_measures_leaves_unknown_what_it_bears_on(person, carried, feet):
    beside = np.arange(200, 260)
    off = with_state(feet, "right", beside, FootState.UNMEASURED)
    settings = replace(NOISE, free_hands="both")
    chunk, summary = estimate_run(person, carried.motion, off, settings)
    assert np.all(chunk.balance[beside] == Balance.UNKNOWN)
    assert not np.any(chunk.payload_known[beside])
    assert np.all(chunk.hands_state[beside] == HandState.UNKNOWN)
    columns = summary.joint_names.index("jRightKnee"), summary.joint_names.index("jL5S1")
    assert not np.any(chunk.effort_known[beside][:, columns])
    # The other leg stands on its plate, and the head bears nothing but itself.
    for joint in ("jLeftKnee", "jC1Head"):
        assert np.all(chunk.effort_known[beside, summary.joint_names.index(joint)])
    error = chunk.torque_nm - truth(carried)
    assert rms(error[beside][chunk.torque_known[beside]]) < 1.5
    assert any("right foot stands where nothing measures: 60 frames" in f for f in summary.findings)
    rest = np.setdiff1d(np.arange(len(carried.motion)), beside)
    whole, _ = estimate_run(person, carried.motion, feet, settings)
    same = rest[(chunk.hands_state == whole.hands_state)[rest]]
    assert len(same) > 0.9 * len(rest)
    np.testing.assert_allclose(chunk.torque_nm[same], whole.torque_nm[same], atol=1e-9)
    assert len(summary.holds) == 4


def test_with_empty_hands_balance_finds_what_one_foot_bears(person, stance):
    feet = with_state(feet_of(stance), "left", slice(None), FootState.SATURATED)
    clipped = replace(feet.left, wrench=0.5 * feet.left.wrench)
    off = replace(feet, left=clipped)
    settings = replace(NOISE, free_hands="none")
    chunk, summary = estimate_run(person, stance.motion, off, settings)
    np.testing.assert_allclose(chunk.torque_nm, truth(stance), atol=1e-3)
    # Where exactly the foot bears is told by the balance of moments alone: too little for an ankle.
    unknown = [name for name, share in summary.joint_known_share.items() if share < 1.0]
    assert unknown == ["jLeftAnkle"]
    assert any("left foot is on a plate at its limit" in text for text in summary.findings)
    assert summary.holds == ()


def test_feet_on_one_plate_leave_the_legs_unknown_and_all_above_right(person, carried, feet):
    shared = feet
    for side in ("right", "left"):
        shared = with_state(shared, side, slice(None), FootState.SHARED)
    # The split is a guess: all of it to the right foot.
    right = replace(shared.right, wrench=feet.right.wrench + feet.left.wrench)
    left = replace(shared.left, wrench=np.zeros_like(feet.left.wrench))
    chunk, summary = estimate_run(
        person, carried.motion, replace(shared, right=right, left=left), NOISE
    )
    names = list(summary.joint_names)
    assert not np.any(chunk.effort_known[:, names.index("jLeftHip")])
    assert np.all(chunk.low_back_known)
    assert np.all(chunk.balance == Balance.SPLIT_UNKNOWN)
    hold = max(summary.holds, key=lambda hold: hold.mass().mass_kg)
    assert hold.mass().mass_kg == pytest.approx(9.55, abs=0.3)
    spine = [dof for dof, name in enumerate(summary.dof_names) if name.startswith("jL5S1")]
    assert rms((chunk.torque_nm - truth(carried))[:, spine]) < 2.5


def test_what_a_chair_bears_is_no_balance_and_no_payload(person, stance):
    """Four tenths of the weight are borne at the pelvis, by nothing that measures."""
    feet = feet_of(stance)
    weight = 9.81 * person.total_mass_kg
    lighter = {side: getattr(feet, side) for side in ("right", "left")}
    lighter = {s: replace(f, wrench=0.6 * f.wrench) for s, f in lighter.items()}
    seated = replace(feet, **lighter, missing_n=np.full(len(feet.time_s), 0.4 * weight))
    settings = replace(NOISE, free_hands="none")
    chunk, summary = estimate_run(person, stance.motion, seated, settings)
    assert np.all(chunk.balance == Balance.UNKNOWN)
    unknown = {name for name, share in summary.joint_known_share.items() if share < 1.0}
    assert unknown == {"jRightHip", "jLeftHip"}
    legs = ("Hip", "Knee", "Ankle")
    above = [
        dof for dof, name in enumerate(summary.dof_names) if not any(part in name for part in legs)
    ]
    np.testing.assert_allclose(chunk.torque_nm[:, above], truth(stance)[:, above], atol=0.1)
    _, free = estimate_run(person, stance.motion, seated, replace(NOISE, free_hands="both"))
    assert free.holds == ()
    assert any("a chair, a table" in text for text in free.findings)
    assert free.plates_minus_model_kg is None


def test_without_feet_the_arms_and_spine_hold_and_the_legs_do_not(person, carried):
    unloaded = carried.motion.time_s < 1.0
    chunk, summary = estimate_run(person, carried.motion.select(unloaded), None, NOISE)
    names = list(summary.joint_names)
    known = np.all(chunk.effort_known, axis=0)
    legs = [place for place, name in enumerate(names) if "Hip" in name or "Knee" in name]
    assert not np.any(chunk.effort_known[:, legs])
    assert all(known[names.index(n)] for n in ("jL5S1", "jRightShoulder", "jLeftElbow", "jC1Head"))
    assert np.all(chunk.balance == Balance.UNKNOWN)
    error = (chunk.torque_nm - truth(carried)[unloaded])[chunk.torque_known]
    assert rms(error) < 0.1
    assert not np.any(chunk.payload_known)
    assert any("no foot forces" in text for text in summary.findings)
    assert "hands: bear nothing" in summary.assumed
    assert summary.plates_minus_model_kg is None


def test_segments_that_nobody_saw_are_not_known_and_weigh_on_those_above(person, carried, feet):
    rows = slice(0, 40)
    motion, here = carried.motion.select(rows), feet.select(rows)
    arm = ("RightUpperArm", "RightForeArm", "RightHand")
    settings = replace(NOISE, free_hands="none", unobserved=arm)
    chunk, summary = estimate_run(person, motion, here, settings)
    seen, _ = estimate_run(person, motion, here, replace(settings, unobserved=()))
    names = list(summary.joint_names)
    for joint in ("jRightShoulder", "jRightElbow", "jRightWrist"):
        assert not np.any(chunk.effort_known[:, names.index(joint)])
    assert np.all(chunk.effort_known[:, names.index("jLeftElbow")])
    assert np.all(chunk.low_back_moment_sd_nm > seen.low_back_moment_sd_nm)
    assert any("RightForeArm" in text for text in summary.assumed)
    with pytest.raises(RunInputError, match="unobserved"):
        estimate_run(person, motion, here, RunSettings(unobserved=("Tail",)))


def test_a_tare_takes_the_phantom_out_of_the_hands(person, stance):
    heavy = generate_model(Subject(1.75, 72.0, "male"))
    feet = feet_of(stance, np.random.default_rng(4))
    settings = RunSettings(model_errors=FEW, free_hands="right")
    _, phantom = estimate_run(heavy, stance.motion, feet, settings)
    assert phantom.holds[0].mass("vertical").mass_kg == pytest.approx(-2.0, abs=0.3)
    assert any("give an unloaded stance" in text for text in phantom.assumed)
    window = (0.0, float(stance.motion.time_s[-1]))
    _, summary = estimate_run(heavy, stance.motion, feet, replace(settings, tare_s=window))
    assert summary.body_mass_kg == pytest.approx(70.0, abs=0.1)
    assert summary.tare.error_kg == pytest.approx(-2.0, abs=0.1)
    assert summary.holds[0].mass("vertical").mass_kg == pytest.approx(0.0, abs=0.1)
    assert any("set from the model's 72.00 kg" in text for text in summary.assumed)
    given = tare_stance(heavy, stance.motion, feet, window)
    run = RecordingRun(heavy, settings, tare=given)
    list(run.add(stance.motion, feet))
    assert run.finish().body_mass_kg == summary.body_mass_kg


def test_a_tare_tells_a_heavy_model_from_a_chair(person, stance):
    heavy = generate_model(Subject(1.75, 85.0, "male"))
    lacking = np.full(len(stance.motion), 15.0 * 9.81)
    feet = replace(feet_of(stance), missing_n=lacking)
    seated, _ = estimate_run(heavy, stance.motion, feet, NOISE)
    assert np.all(seated.balance == Balance.UNKNOWN)
    settings = replace(NOISE, tare_s=(0.0, float(stance.motion.time_s[-1])))
    chunk, summary = estimate_run(heavy, stance.motion, feet, settings)
    assert np.all(chunk.balance == Balance.KNOWN)
    assert any("15.0 kg less than the body of 85.0 kg" in text for text in summary.findings)


def test_a_model_that_is_far_from_the_plates_is_named(person, stance):
    heavy = generate_model(Subject(1.75, 90.0, "male"))
    feet = feet_of(stance)
    _, summary = estimate_run(heavy, stance.motion, feet, NOISE)
    assert any("bear 20.0 kg less than the body of 90.0 kg" in text for text in summary.findings)


@pytest.mark.parametrize(
    ("tare_s", "words"),
    [((0.0, 99.0), "within the first stretch"), ((0.001, 0.002), "bear both feet, got 0")],
)
def test_a_tare_needs_frames(person, stance, tare_s, words):
    with pytest.raises(RunInputError, match=words):
        estimate_run(person, stance.motion, feet_of(stance), RunSettings(tare_s=tare_s))


def test_frames_that_make_no_sense_are_named_and_the_rest_is_untouched(person, carried, feet):
    rows = slice(0, 80)
    good, here = carried.motion.select(rows), feet.select(rows)
    settings = replace(NOISE, free_hands="none")
    whole, _ = estimate_run(person, good, here, settings)
    a = good.a.copy()
    a[10, 30] = 1e7
    lost = np.zeros(80, dtype=bool)
    lost[20:23] = True
    motion = Motion(good.model_dof_names, good.time_s, good.q, good.v, a, flags={"unfitted": lost})
    wrench, variance = here.left.wrench.copy(), here.left.variance.copy()
    wrench[30], variance[31] = np.nan, 1e30
    broken = replace(here, left=replace(here.left, wrench=wrench, variance=variance))
    value = np.tile([0.0, 0.0, 9.81], (80, 1))
    value[40:42] = np.nan
    imu = Accelerometer("Head", value, 100.0)
    chunk, summary = estimate_run(person, motion, broken, settings, [imu])
    assert sorted(set(range(80)) - set(chunk.frames.tolist())) == [10, 20, 21, 22, 40, 41]
    assert sum(summary.left_out.values()) == 6
    text = " | ".join(summary.findings)
    for words in (
        "rad/s^2: 1 frames (0.20",
        "'unfitted': 3 frames",
        "Head is not finite: 2",
        "not a number",
    ):
        assert words in text
    assert [chunk.balance[chunk.frames == f][0] for f in (30, 31, 32)] == [2, 2, 0]
    sound = np.setdiff1d(chunk.frames, [30, 31])
    ours = chunk.torque_nm[np.isin(chunk.frames, sound)]
    np.testing.assert_allclose(ours, whole.torque_nm[sound], atol=0.5)
    for item in fields(RunChunk):
        assert np.all(np.isfinite(getattr(chunk, item.name))), item.name


def test_a_pose_near_its_singularity_is_named(person):
    q = np.tile(person.neutral(), (5, 1))
    q[2, 7 + list(person.dof_names).index("jRightHip_roty")] = -np.pi / 2
    still = np.zeros((5, person.nv))
    motion = Motion(person.dof_names, np.arange(5) / 50.0, q, still, still)
    _, summary = estimate_run(person, motion, None, NOISE)
    assert any("jRightHip within 5 deg" in f and ": 1 frames" in f for f in summary.findings)


@pytest.mark.parametrize("method", ["two_step", "deterministic"])
def test_other_methods_run_and_are_labelled(person, carried, feet, method):
    rows = slice(150, 170)
    motion, here = carried.motion.select(rows), feet.select(rows)
    settings = RunSettings(method=method, free_hands="right")
    chunk, summary = estimate_run(person, motion, here, settings)
    assert summary.bands == {"two_step": "tuning", "deterministic": "none"}[method]
    assert (chunk.torque_sd_nm is None) == (method == "deterministic")
    assert chunk.effort_nm.shape == (20, 22, 3)
    told = method == "two_step"
    assert np.all(chunk.payload_known == told)
    assert np.all((chunk.hands_state == HandState.UNKNOWN) != told)


def test_stretches_must_fit(person, carried, feet):
    run = RecordingRun(person, NOISE)
    first = carried.motion.select(slice(0, 10))
    list(run.add(first, None))
    with pytest.raises(RunInputError, match="stretch after"):
        next(run.add(first, None))
    with pytest.raises(RunInputError, match="the motion's 10 times"):
        next(RecordingRun(person).add(first, feet.select(slice(1, 11))))
    with pytest.raises(RunInputError, match="at least one frame"):
        RecordingRun(person).finish()
    other = Motion(
        ("x",), [0.0], np.r_[np.zeros(6), 1.0, 0.0][None], np.zeros((1, 7)), np.zeros((1, 7))
    )
    with pytest.raises(RunInputError, match="joint angles"):
        next(RecordingRun(person).add(other, None))
