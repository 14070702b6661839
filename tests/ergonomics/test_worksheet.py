import copy
import json
import math
from typing import Any

import pytest

from ergonomics import (
    ScoringRules,
    WorksheetError,
    score_reba_worksheet,
    score_rula_worksheet,
    score_worksheet,
)

from .worksheet_cases import CASES

_SCORERS = {"rula": score_rula_worksheet, "reba": score_reba_worksheet}


@pytest.mark.parametrize(
    ("method", "name", "sheet", "expected"), CASES, ids=[f"{m} {n}" for m, n, _, _ in CASES]
)
def test_worked_case_has_every_published_score(
    method: str, name: str, sheet: dict[str, Any], expected: dict[str, int]
) -> None:
    result = _SCORERS[method](sheet).to_dict()
    assert {key: result[key] for key in expected} == expected
    assert set(result["reasons"]) == set(expected)
    for key, reason in result["reasons"].items():
        assert reason, key
    assert json.loads(json.dumps(result)) == result


def test_part_points_add_up_to_what_the_reason_says() -> None:
    sheet = {
        "upper_arm": {"flexion_deg": 50, "shoulder_raised": True, "supported": True},
        "neck": {"flexion_deg": 12, "twisted": True, "side_bent": True},
    }
    result = score_rula_worksheet(sheet)
    assert result.upper_arm == 3
    assert result.reasons["upper_arm"] == (
        "3: flexion 50° (45° to 90°); +1: shoulder raised; -1: arm supported or leaning"
    )
    assert result.neck == 4
    assert result.reasons["neck"].count("+1") == 2


# (part, edge, score under "lower", score under "higher")
_RULA_EDGES = [
    ("upper_arm", -20, 1, 2),
    ("upper_arm", 20, 1, 2),
    ("upper_arm", 45, 2, 3),
    ("upper_arm", 90, 3, 4),
    ("lower_arm", 60, 1, 2),
    ("lower_arm", 100, 1, 2),
    ("wrist", 15, 2, 3),
    ("wrist", -15, 2, 3),
    ("neck", 10, 1, 2),
    ("neck", 20, 2, 3),
    ("trunk", 20, 2, 3),
    ("trunk", 60, 3, 4),
    ("trunk", -20, 2, 3),
    # Our own tolerance is inclusive under either rule.
    ("wrist", 5, 1, 1),
    ("wrist", -5, 1, 1),
    ("neck", -5, 1, 1),
    ("trunk", 5, 1, 1),
    ("trunk", -5, 1, 1),
]


@pytest.mark.parametrize(("part", "edge", "lower", "higher"), _RULA_EDGES)
def test_rula_edges_follow_the_tie_rule(part: str, edge: float, lower: int, higher: int) -> None:
    sheet = {part: {"flexion_deg": edge}}
    assert getattr(score_rula_worksheet(sheet), part) == lower
    assert getattr(score_rula_worksheet(sheet, ties="higher"), part) == higher
    for nudge in (-1e-9, 1e-9):
        near = {part: {"flexion_deg": edge + nudge}}
        one, other = (
            getattr(score_rula_worksheet(near, ties=t), part) for t in ("lower", "higher")
        )
        assert one == other


_REBA_EDGES = [
    ("neck", "flexion_deg", 20, 1, 2),
    ("neck", "flexion_deg", -5, 1, 1),
    ("trunk", "flexion_deg", 20, 2, 3),
    ("trunk", "flexion_deg", 60, 3, 4),
    ("trunk", "flexion_deg", -20, 2, 3),
    ("upper_arm", "flexion_deg", 45, 2, 3),
    ("lower_arm", "flexion_deg", 60, 1, 2),
    ("wrist", "flexion_deg", 15, 1, 2),
    ("legs", "knee_flexion_deg", 30, 1, 2),
    ("legs", "knee_flexion_deg", 60, 2, 3),
]


@pytest.mark.parametrize(("part", "angle", "edge", "lower", "higher"), _REBA_EDGES)
def test_reba_edges_follow_the_tie_rule(
    part: str, angle: str, edge: float, lower: int, higher: int
) -> None:
    sheet = {part: {angle: edge, **({"bilateral": True} if part == "legs" else {})}}
    assert getattr(score_reba_worksheet(sheet), part) == lower
    assert getattr(score_reba_worksheet(sheet, ties="higher"), part) == higher


def test_tolerance_moves_only_the_neutral_bands() -> None:
    sheet = {"trunk": {"flexion_deg": 8}, "neck": {"flexion_deg": -8}, "wrist": {"flexion_deg": 8}}
    strict, wide = (score_rula_worksheet(sheet, neutral_tolerance_deg=t) for t in (0, 10))
    assert (strict.trunk, strict.neck, strict.wrist) == (2, 4, 2)
    assert (wide.trunk, wide.neck, wide.wrist) == (1, 1, 1)
    assert score_reba_worksheet({"wrist": {"flexion_deg": 8}}, neutral_tolerance_deg=0).wrist == 1
    upright = {"trunk": {"flexion_deg": 0}}
    assert score_rula_worksheet(upright, neutral_tolerance_deg=0, ties="higher").trunk == 1


_FORCES = [
    ("paper", 1.99, "intermittent", 0),
    ("paper", 2, "intermittent", 1),
    ("paper", 10, "intermittent", 1),
    ("paper", 10.01, "intermittent", 2),
    ("worksheet", 10.01, "intermittent", 3),
    ("worksheet", 10, "intermittent", 1),
    ("paper", 2, "static", 2),
    ("paper", 10, "repeated", 2),
    ("paper", 11, "static", 3),
    ("paper", 1, "static", 0),
    ("paper", 0.5, "shock", 3),
]


@pytest.mark.parametrize(("profile", "kg", "mode", "points"), _FORCES)
def test_rula_force_by_load_and_mode(profile: Any, kg: float, mode: str, points: int) -> None:
    result = score_rula_worksheet({"force_a": {"kg": kg, "mode": mode}}, profile=profile)
    assert (result.force_a, result.force_b) == (points, 0)


@pytest.mark.parametrize(
    ("kg", "shock", "points"), [(4.9, False, 0), (5, False, 1), (10, False, 1), (10.1, True, 3)]
)
def test_reba_load(kg: float, shock: bool, points: int) -> None:
    assert score_reba_worksheet({"load": {"kg": kg, "shock": shock}}).load == points


def test_reba_twist_and_side_bend_by_profile() -> None:
    both = {"flexion_deg": 30, "twisted": True, "side_bent": True}
    sheet = {"neck": both, "trunk": both}
    paper, printed = (score_reba_worksheet(sheet, profile=p) for p in ("paper", "worksheet"))
    assert (paper.neck, paper.trunk) == (3, 4)
    assert (printed.neck, printed.trunk) == (3, 5), "the neck is held at the table's last row"
    assert "held at 3" in printed.reasons["neck"]


def test_sitting_takes_the_knees_out_and_seated_support_the_trunk_angle() -> None:
    bent = {"knee_flexion_deg": 90}
    assert score_reba_worksheet({"legs": {**bent, "sitting": True}}).legs == 1
    assert score_reba_worksheet({"legs": {**bent, "bilateral": True}}).legs == 3
    assert score_reba_worksheet({"legs": bent}).legs == 4
    seated = {"trunk": {"flexion_deg": 30, "seated_supported": True, "twisted": True}}
    assert score_rula_worksheet(seated).trunk == 2


def test_an_empty_box_counts_as_nothing() -> None:
    spelled = {
        "legs": {"supported_balanced": False},
        "wrist": {"flexion_deg": 0, "twist": "mid"},
        "force_a": 0,
    }
    assert score_rula_worksheet({}).to_dict() == score_rula_worksheet(spelled).to_dict()
    assert score_reba_worksheet({}) == score_reba_worksheet({"coupling": "good"})


_BAD = [
    ("rula", {"upper_arm": {"flexion_deg": math.nan}}, "/input/upper_arm/flexion_deg"),
    ("rula", {"upper_arm": {"flexion_deg": math.inf}}, "/input/upper_arm/flexion_deg"),
    ("rula", {"upper_arm": {"flexion_deg": 181}}, "/input/upper_arm/flexion_deg"),
    ("rula", {"upper_arm": {"flexion_deg": "20"}}, "/input/upper_arm/flexion_deg"),
    ("rula", {"upper_arm": {"flexion_deg": True}}, "/input/upper_arm/flexion_deg"),
    ("rula", {"upper_arm": {"flexion_deg": None}}, "/input/upper_arm/flexion_deg"),
    ("rula", {"upper_arm": {"raised": True}}, "/input/upper_arm/raised"),
    ("rula", {"upper_arm": {"abducted": 1}}, "/input/upper_arm/abducted"),
    ("rula", {"upper_arm": [20]}, "/input/upper_arm"),
    ("rula", {"upper/arm": {}}, "/input/upper~1arm"),
    ("rula", {"wrist": {"twist": "full"}}, "/input/wrist/twist"),
    ("rula", {"muscle_use_a": 2}, "/input/muscle_use_a"),
    ("rula", {"force_a": 4}, "/input/force_a"),
    ("rula", {"force_a": 1.5}, "/input/force_a"),
    ("rula", {"force_b": {"kg": -1}}, "/input/force_b/kg"),
    ("rula", {"force_b": {"kg": 1, "mode": "now and then"}}, "/input/force_b/mode"),
    ("reba", {"coupling": "great"}, "/input/coupling"),
    ("reba", {"load": {"lb": 3}}, "/input/load/lb"),
    ("reba", {"legs": {"knee_flexion_deg": -math.inf}}, "/input/legs/knee_flexion_deg"),
    ("reba", {"activity": {"static_over_1min": "yes"}}, "/input/activity/static_over_1min"),
    ("reba", [], "/input"),
]


@pytest.mark.parametrize(("method", "sheet", "pointer"), _BAD, ids=[p for _, _, p in _BAD])
def test_malformed_worksheet_names_the_place(method: Any, sheet: Any, pointer: str) -> None:
    with pytest.raises(WorksheetError) as caught:
        score_worksheet(method, {"input": sheet})
    assert caught.value.pointer == pointer
    assert caught.value.expected and pointer in str(caught.value)


@pytest.mark.parametrize(
    ("document", "pointer"),
    [
        ({"input": {}, "profile": "book"}, "/profile"),
        ({"input": {}, "ties": "up"}, "/ties"),
        ({"input": {}, "neutral_tolerance_deg": -1}, "/neutral_tolerance_deg"),
        ({"input": {}, "neutral_tolerance_deg": "5"}, "/neutral_tolerance_deg"),
        ({"input": {}, "neutral_tolerance_deg": math.nan}, "/neutral_tolerance_deg"),
        ({"input": {}, "tie": "lower"}, "/tie"),
        ({"profile": "paper"}, "/input"),
        ({"input": {}, "method": "reba"}, "/method"),
        ("text", ""),
    ],
)
def test_malformed_document_names_the_place(document: Any, pointer: str) -> None:
    with pytest.raises(WorksheetError) as caught:
        score_worksheet("rula", document)
    assert caught.value.pointer == pointer


def test_document_carries_its_options_and_is_left_alone() -> None:
    document = {
        "id": "X",
        "expected": {},
        "input": {"upper_arm": {"flexion_deg": 45}},
        "ties": "higher",
        "neutral_tolerance_deg": 2,
    }
    before = copy.deepcopy(document)
    result = score_worksheet("rula", document)
    assert result.upper_arm == 3
    assert result.rules == ScoringRules("paper", "higher", 2)
    assert document == before
