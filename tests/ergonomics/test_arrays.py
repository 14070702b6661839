from dataclasses import fields, replace
from itertools import product

import numpy as np
import pytest

from ergonomics import (
    PostureError,
    RebaInputs,
    RebaScores,
    RulaInputs,
    RulaScores,
    ScoringRules,
    UnmeasuredError,
    explain_reba,
    explain_rula,
    score_reba,
    score_reba_interval,
    score_rula,
    score_rula_interval,
)
from ergonomics.evidence import Evidence

from .random_postures import random_reba, random_rula

_RULES = [
    ScoringRules(profile, ties, tolerance)
    for profile, ties, tolerance in product(
        ("paper", "worksheet"), ("lower", "higher"), (0.0, 5.0, 10.0)
    )
]
# Together both methods see more than 10^5 postures here; benchmarks/scoring.py takes 10^5 of
# each method through every profile and tie rule.
_PER_RULES = 4_200

_METHODS = {
    "rula": (random_rula, score_rula, explain_rula, RulaScores, score_rula_interval),
    "reba": (random_reba, score_reba, explain_reba, RebaScores, score_reba_interval),
}
_BOTH = pytest.mark.parametrize("method", list(_METHODS))


@_BOTH
@pytest.mark.parametrize("rules", _RULES, ids=str)
def test_arrays_agree_with_the_readable_scorer(method, rules):
    make, score, explain, record, _ = _METHODS[method]
    inputs = make(np.random.default_rng(_RULES.index(rules)), _PER_RULES)
    arrays = score(inputs, rules)
    names = [f.name for f in fields(record)]
    got = np.stack([getattr(arrays, name) for name in names], axis=1)
    one_by_one = [explain(inputs, (i,), rules) for i in range(_PER_RULES)]
    expected = np.array([[getattr(one, name) for name in names] for one in one_by_one])
    np.testing.assert_array_equal(got, expected)
    assert len(np.unique(arrays.final)) >= 6, "the random postures must reach many scores"


@_BOTH
def test_fields_broadcast_over_samples_and_frames(method):
    make, score, _, record, _ = _METHODS[method]
    inputs = make(np.random.default_rng(3), 40_000)
    whole = score(inputs)
    folded = replace(inputs, **{k: a.reshape(200, 200) for k, a in inputs.arrays().items()})
    one = replace(inputs, **{k: a[:200] for k, a in inputs.arrays().items()})
    column = replace(one, trunk_deg=inputs.trunk_deg[:50, None])
    outer = score(column)
    for f in fields(record):
        np.testing.assert_array_equal(
            getattr(score(folded), f.name).reshape(-1), getattr(whole, f.name)
        )
        assert getattr(outer, f.name).shape == (50, 200)
    row = score(replace(one, trunk_deg=inputs.trunk_deg[7]))
    np.testing.assert_array_equal(outer.final[7], row.final)


@_BOTH
@pytest.mark.parametrize(
    ("low", "high"), [({"trunk_deg": 5.0}, {"trunk_deg": 70.0}), ({}, {"shoulder_raised": True})]
)
def test_a_worse_part_never_lowers_the_score(method, low, high):
    make, score, _, _, _ = _METHODS[method]
    inputs = make(np.random.default_rng(5), 20_000)
    better, worse = replace(inputs, **low), replace(inputs, **{**low, **high})
    assert (score(worse).final >= score(better).final).all()


@_BOTH
def test_interval_of_unmeasured_parts_holds_every_value_and_is_attained(method):
    make, score, _, _, interval = _METHODS[method]
    inputs = make(np.random.default_rng(6), 500)
    hidden = replace(inputs, unmeasured=frozenset({"wrist", "legs"}))
    with pytest.raises(UnmeasuredError, match="legs, wrist"):
        score(hidden)
    bounds = interval(hidden)
    wrist = "wrist_deviated" if method == "rula" else "wrist_deviated_or_twisted"
    legs = (
        [{"legs_supported": a} for a in (True, False)]
        if method == "rula"
        else [
            {"bilateral": a, "knee_deg": k, "sitting": False}
            for a in (True, False)
            for k in (0.0, 45.0, 90.0)
        ]
    )
    finals = np.array(
        [
            score(replace(inputs, wrist_deg=angle, **{wrist: flag}, **leg)).final
            for angle in (0.0, 10.0, 30.0)
            for flag in (False, True)
            for leg in legs
        ]
    )
    np.testing.assert_array_equal(finals.min(axis=0), bounds.low.final)
    np.testing.assert_array_equal(finals.max(axis=0), bounds.high.final)
    assert (bounds.high.final > bounds.low.final).any()
    measured = interval(inputs)
    np.testing.assert_array_equal(measured.low.final, measured.high.final)


def _still(**changes):
    angles = {"upper_arm_deg": 0.0, "lower_arm_deg": 80.0, "wrist_deg": 0.0}
    return RulaInputs(**{**angles, "neck_deg": 0.0, "trunk_deg": np.zeros(3), **changes})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"trunk_deg": np.array([0.0, np.nan, 0.0])}, r"trunk_deg at index \[1\].*finite"),
        ({"neck_deg": "bent"}, "neck_deg.*degrees"),
        ({"abducted": 1}, "abducted.*true or false"),
        ({"force_a": 4}, "force_a.*0 to 3"),
        ({"force_a": 0.5}, "force_a.*whole"),
        ({"wrist_deg": np.zeros(4)}, "broadcast"),
        ({"unmeasured": frozenset({"tail"})}, "'tail' is not a part"),
    ],
)
def test_malformed_arrays_name_the_field(changes, message):
    with pytest.raises(PostureError, match=message):
        _still(**changes)


def test_inputs_and_scores_cannot_be_written():
    inputs = _still()
    for array in (inputs.trunk_deg, score_rula(inputs).final):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_words_carry_the_measurement_behind_a_flag():
    raised = np.array([4.0, 24.0, 12.0])
    evidence = Evidence("upper arm abducted", raised, 20.0)
    inputs = _still(
        abducted=evidence.exceeded(),
        force_a=2,
        evidence={"upper_arm.abducted": (evidence,)},
        notes={"force_a": "2: 12 kg, held"},
    )
    assert "abducted" not in explain_rula(inputs, (0,)).reasons["upper_arm"]
    assert (
        explain_rula(inputs, (1,))
        .reasons["upper_arm"]
        .endswith("+1: upper arm abducted 24° (> 20°)")
    )
    assert explain_rula(inputs, (1,)).reasons["force_a"] == "2: 12 kg, held"


def test_reba_words_say_the_load_as_given():
    inputs = RebaInputs(0.0, 0.0, 0.0, 0.0, 80.0, 0.0, load=2, notes={"load": "2: 12 kg"})
    assert explain_reba(inputs, ()).reasons["load"] == "2: 12 kg"
    assert explain_reba(inputs, ()).score_a == 3
