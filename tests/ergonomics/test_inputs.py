from dataclasses import replace

import numpy as np
import pytest

from ergonomics import (
    PostureError,
    ScoringRules,
    SecondaryThresholds,
    TaskContext,
    UnmeasuredError,
    explain_reba,
    explain_rula,
    posture_angles,
    reba_inputs,
    rula_inputs,
    score_reba,
    score_rula,
    score_rula_interval,
    with_effects,
)

from .puppet import FORWARD, LEFT, UP, Sticks, pose, stack, turn

_KNOWN = TaskContext(
    load_kg=0.0,
    coupling="good",
    arm_supported=False,
    legs="both",
    static=False,
    repeated=False,
    rapid_change=False,
)
_FOREARM_UP = turn(LEFT, -80)


def _angles(*moves, **kwargs):
    working = [{"RightForeArm": _FOREARM_UP, "LeftForeArm": _FOREARM_UP, **m} for m in moves]
    return posture_angles(Sticks(), stack([pose(m) for m in working]), **kwargs)


def test_each_measured_box_adds_its_point_and_says_the_number():
    angles = _angles(
        {"RightUpperArm": turn(FORWARD, -24)},
        {"RightShoulder": turn(FORWARD, -12)},
        {"RightUpperArm": turn(UP, 60)},
        {"RightHand": turn(LEFT, -15)},
        {"RightForeArm": _FOREARM_UP @ turn(UP, 60)},
        {"Head": turn(UP, 30)},
        {"Head": turn(FORWARD, 20)},
        {"L3": turn(UP, 25)},
        {"L3": turn(FORWARD, 15)},
        {},
    )
    rula = rula_inputs(angles, side="right", task=_KNOWN)
    expected = [
        ("upper_arm", "+1: upper arm abducted 24° (> 20°)"),
        ("upper_arm", "+1: shoulder raised 12° (> 10°)"),
        ("lower_arm", "+1: lower arm across the midline by 4 cm (> 2 cm)"),
        ("wrist", "+1: wrist deviated 15° (> 10°)"),
        ("wrist_twist", "2: forearm twisted 60° (> 45°)"),
        ("neck", "+1: neck twisted 30° (> 10°)"),
        ("neck", "+1: neck side-bent 20° (> 10°)"),
        ("trunk", "+1: trunk twisted 25° (> 10°)"),
        ("trunk", "+1: trunk side-bent 15° (> 10°)"),
    ]
    rested = explain_rula(rula, (9,))
    assert rested.final == 1
    for k, (part, words) in enumerate(expected):
        result = explain_rula(rula, (k,))
        assert words in result.reasons[part], result.reasons[part]
        changed = {
            p
            for p in ("upper_arm", "lower_arm", "wrist", "wrist_twist", "neck", "trunk")
            if getattr(result, p) != getattr(rested, p)
        }
        # An abducted arm with a bent elbow also carries the wrist out to the side.
        assert changed == {part, "lower_arm"} if k == 0 else changed == {part}
    reba = reba_inputs(angles, side="right", task=_KNOWN)
    assert "forearm twisted 60°" in explain_reba(reba, (4,)).reasons["wrist"]
    assert explain_reba(reba, (9,)).final == 1


def test_a_turned_upper_arm_counts_in_reba_alone():
    angles = _angles({"RightUpperArm": turn(UP, 60)})
    assert (
        "rotated 60°" in explain_reba(reba_inputs(angles, side="right"), (0,)).reasons["upper_arm"]
    )
    assert explain_rula(rula_inputs(angles, side="right"), (0,)).upper_arm == 1


def test_sides_are_scored_apart():
    angles = _angles({"LeftUpperArm": turn(LEFT, -100)}, {})
    left, right = (score_rula(rula_inputs(angles, side=s, task=_KNOWN)) for s in ("left", "right"))
    assert left.upper_arm.tolist() == [4, 1]
    assert right.upper_arm.tolist() == [1, 1]
    one = posture_angles(Sticks(), pose(), sides=("right",))
    with pytest.raises(PostureError, match="'left'"):
        rula_inputs(one, side="left")


def test_thresholds_and_upper_arm_convention_are_settable():
    angles = _angles({"RightUpperArm": turn(FORWARD, -89.5)})
    by = {
        c: score_rula(rula_inputs(angles, side="right", task=_KNOWN, upper_arm=c)).upper_arm[0]
        for c in ("elevation", "sagittal")
    }
    assert by == {"elevation": 4, "sagittal": 2}
    lax = SecondaryThresholds(abducted_deg=95.0)
    inputs = rula_inputs(angles, side="right", task=_KNOWN, thresholds=lax)
    assert score_rula(inputs).upper_arm[0] == 3


@pytest.mark.parametrize(
    ("kg", "mode", "profile", "rula", "reba"),
    [
        (1.0, "intermittent", "paper", 0, 0),
        (2.0, "intermittent", "paper", 1, 0),
        (7.0, "static", "paper", 2, 1),
        (12.0, "intermittent", "paper", 2, 2),
        (12.0, "intermittent", "worksheet", 3, 2),
        (12.0, "shock", "paper", 3, 3),
    ],
)
def test_load_becomes_points(kg, mode, profile, rula, reba):
    rules = ScoringRules(profile)
    task = replace(_KNOWN, load_kg=kg, force_mode=mode)
    angles = _angles({})
    inputs = rula_inputs(angles, side="right", task=task, rules=rules)
    assert (inputs.force_a, inputs.force_b) == (rula, rula)
    assert explain_rula(inputs, (0,), rules).reasons["force_a"] == f"{rula}: {kg:g} kg, {mode}"
    assert reba_inputs(angles, side="right", task=task).load == reba


def test_a_worked_out_load_is_told_in_the_digits_a_person_reads():
    inputs = rula_inputs(_angles({}), side="right", task=replace(_KNOWN, load_kg=3.2441936))
    assert explain_rula(inputs, (0,)).reasons["force_a"] == "1: 3.24 kg, intermittent"


def test_load_may_change_over_time_and_differ_between_hand_and_body():
    task = replace(_KNOWN, load_kg=np.array([0.0, 4.0]), total_load_kg=np.array([0.0, 11.0]))
    inputs = rula_inputs(_angles({}, {}), side="right", task=task)
    assert inputs.force_a.tolist() == [0, 1]
    assert inputs.force_b.tolist() == [0, 2]


def test_what_is_not_known_is_named_with_the_range_it_opens():
    angles = _angles({"L3": turn(LEFT, 30)}, {})
    assert _KNOWN.assumptions() == ()
    task = TaskContext()
    rula, reba = rula_inputs(angles, side="right"), reba_inputs(angles, side="right")
    told = {a.what: a for a in with_effects(task.assumptions(), rula, reba)}
    assert len(told) == 7
    here, there = (
        score_rula(rula).final.mean(),
        score_rula(replace(rula, legs_supported=False)).final.mean(),
    )
    assert there > here
    assert f"RULA mean {here:.1f} to {there:.1f}" in told["what the legs stand on"].effect
    base, shaky = score_reba(reba), score_reba(replace(reba, rapid_large_change_or_unstable=True))
    assert told["rapid changes of posture"].effect == (
        f"REBA mean {base.final.mean():.1f} to {shaky.final.mean():.1f}"
    )
    assert set(told["load in the hand"].to_dict()) == {"what", "value", "range", "effect"}
    assert "none assumed" in explain_rula(rula, (0,)).reasons["force_a"]


def test_unmeasured_segments_become_unmeasured_parts():
    angles = _angles({}, unmeasured=("RightHand", "RightUpperLeg"))
    hand = {"lower_arm", "wrist", "wrist_twist"}
    assert rula_inputs(angles, side="right").unmeasured == hand | {"legs"}
    assert rula_inputs(angles, side="right", task=_KNOWN).unmeasured == hand
    assert rula_inputs(angles, side="left", task=_KNOWN).unmeasured == frozenset()
    assert reba_inputs(angles, side="left", task=_KNOWN).unmeasured == {"legs"}
    seated = replace(_KNOWN, legs="sitting")
    assert reba_inputs(angles, side="left", task=seated).unmeasured == frozenset()
    with pytest.raises(UnmeasuredError):
        score_rula(rula_inputs(angles, side="right"))
    bounds = score_rula_interval(rula_inputs(angles, side="right", task=_KNOWN))
    assert (bounds.low.final[0], bounds.high.final[0]) == (1, 3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"load_kg": -1.0}, "load_kg.*0 or more"),
        ({"load_kg": float("nan")}, "load_kg.*finite"),
        ({"legs": "three"}, "legs.*expected one of"),
        ({"coupling": "great"}, "coupling"),
        ({"force_mode": None}, "force_mode"),
    ],
)
def test_unknown_words_and_impossible_loads_are_refused(changes, message):
    with pytest.raises(PostureError, match=message):
        TaskContext(**changes)
