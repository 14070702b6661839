"""REBA from one worksheet, with every intermediate score and the reason for each point.

This is the readable scorer: one posture, words included. For arrays of postures use
``score_reba``; the two are written apart and tested against each other.

Source: Hignett & McAtamney 2000, tables and bands in ``tables/reba.json``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Any

from .method_data import method_data
from .reasons import Tally, banded, flag_words, not_measured
from .rules import Profile, ScoringRules, Ties
from .worksheet_schema import CheckedSheet, checked_worksheet


@dataclass(frozen=True, slots=True)
class RebaResult:
    """Scores of one REBA worksheet.

    Attributes:
        table_a: Table A of neck, trunk and legs.
        score_a: ``table_a + load``.
        table_b: Table B of upper arm, lower arm and wrist.
        score_b: ``table_b + coupling``.
        score_c: Table C of score A (row) and score B (column).
        final: ``score_c + activity``, 1 to 15.
        action_level: 0 to 4.
        reasons: For each field, where its points come from.
        rules: The conventions applied.
    """

    neck: int
    trunk: int
    legs: int
    table_a: int
    load: int
    score_a: int
    upper_arm: int
    lower_arm: int
    wrist: int
    table_b: int
    coupling: int
    score_b: int
    score_c: int
    activity: int
    final: int
    action_level: int
    reasons: Mapping[str, str]
    rules: ScoringRules

    def to_dict(self) -> dict[str, Any]:
        """Returns the scores, reasons and rules as JSON-ready values."""
        scores = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _NOT_SCORES}
        return {
            **scores,
            "reasons": dict(self.reasons),
            "method": "reba",
            "profile": self.rules.profile,
            "ties": self.rules.ties,
            "neutral_tolerance_deg": self.rules.neutral_tolerance_deg,
        }


_NOT_SCORES = {"reasons", "rules"}


def score_reba_worksheet(
    sheet: Mapping[str, Any],
    *,
    profile: Profile = "paper",
    ties: Ties = "lower",
    neutral_tolerance_deg: float = 5.0,
) -> RebaResult:
    """Scores one REBA worksheet.

    Args:
        sheet: The worksheet's input; a field left out counts as an empty box.
        profile: ``paper`` gives one point for twist or side-bend, ``worksheet`` one for each.
        ties: Score of an angle exactly on an edge.
        neutral_tolerance_deg: Half-width of "neutral", degrees.

    Returns:
        Every intermediate score, the final score, the action level and the reasons.

    Raises:
        WorksheetError: If the worksheet or an option is malformed; the pointer starts at ``sheet``.
    """
    rules = ScoringRules(profile, ties, neutral_tolerance_deg)
    return reba_from_checked(checked_worksheet("reba", sheet), rules)


def reba_from_checked(
    sheet: CheckedSheet,
    rules: ScoringRules,
    measured: Mapping[str, str] = MappingProxyType({}),
    unmeasured: Mapping[str, tuple[int, int]] = MappingProxyType({}),
) -> RebaResult:
    """Scores a checked worksheet.

    Args:
        sheet: A worksheet with every field present.
        rules: The conventions to apply.
        measured: Words for flags that come from a measurement, by ``part.flag``.
        unmeasured: Least and greatest score of parts whose fields mean nothing; the greatest
            counts, and the reason says so.
    """
    data = method_data("reba")
    tallies = {
        "neck": _twistable("neck", sheet, rules, measured),
        "trunk": _twistable("trunk", sheet, rules, measured),
        "legs": _legs(sheet["legs"], rules),
        "upper_arm": _flagged("upper_arm", sheet, rules, measured),
        "lower_arm": _flagged("lower_arm", sheet, rules, measured),
        "wrist": _flagged("wrist", sheet, rules, measured),
    }
    for part, tally in tallies.items():
        tally.hold(data.parts[part])
    tallies["load"] = _load(sheet["load"], measured)
    coupling = sheet["coupling"]
    points = int(data.other["coupling"][coupling])
    tallies["coupling"] = Tally(points, [f"{points}: {coupling} grip"])
    tallies["activity"] = _activity(sheet["activity"])
    tallies |= {name: not_measured(ends) for name, ends in unmeasured.items()}
    score = {part: tally.score for part, tally in tallies.items()}
    reasons = {part: tally.text() for part, tally in tallies.items()}
    for table, axes, extra in (
        ("a", ("neck", "trunk", "legs"), "load"),
        ("b", ("upper_arm", "lower_arm", "wrist"), "coupling"),
    ):
        cell = data.look_up(table.upper(), *(score[axis] for axis in axes))
        at = ", ".join(f"{axis.replace('_', ' ')} {score[axis]}" for axis in axes)
        score[f"table_{table}"] = cell
        reasons[f"table_{table}"] = f"{cell}: table {table.upper()} at {at}"
        score[f"score_{table}"] = cell + score[extra]
        reasons[f"score_{table}"] = (
            f"{cell + score[extra]}: posture {cell} + {extra} {score[extra]}"
        )
    row, column = score["score_a"], score["score_b"]
    score["score_c"] = data.look_up("C", row, column)
    reasons["score_c"] = f"{score['score_c']}: table C at row {row}, column {column}"
    score["final"] = score["score_c"] + score["activity"]
    reasons["final"] = (
        f"{score['final']}: table C {score['score_c']} + activity {score['activity']}"
    )
    action = data.action(score["final"])
    reasons["action_level"] = f"{action.level}: {action.meaning}"
    return RebaResult(
        **score, action_level=action.level, reasons=MappingProxyType(reasons), rules=rules
    )


def _flagged(
    name: str, sheet: CheckedSheet, rules: ScoringRules, measured: Mapping[str, str]
) -> Tally:
    part, section = method_data("reba").parts[name], sheet[name]
    tally = banded(part, section["flexion_deg"], rules, "flexion")
    for flag, points in part.modifiers.items():
        if section[flag]:
            tally.add(points, flag_words(f"{name}.{flag}", measured))
    return tally


def _twistable(
    name: str, sheet: CheckedSheet, rules: ScoringRules, measured: Mapping[str, str]
) -> Tally:
    tally = banded(method_data("reba").parts[name], sheet[name]["flexion_deg"], rules, "flexion")
    words = [
        flag_words(f"{name}.{flag}", measured)
        for flag in ("twisted", "side_bent")
        if sheet[name][flag]
    ]
    if rules.profile == "worksheet":
        for word in words:
            tally.add(1, word)
    elif words:
        tally.add(1, " and ".join(words))
    return tally


def _legs(section: CheckedSheet, rules: ScoringRules) -> Tally:
    part = method_data("reba").parts["legs"]
    sitting = section["sitting"]
    both = sitting or section["bilateral"]
    score = part.values["bilateral" if both else "unilateral"]
    where = (
        "sitting" if sitting else "weight on both legs" if both else "weight on one leg or unstable"
    )
    tally = Tally(score, [f"{score}: {where}"])
    if not sitting and part.bands is not None:
        points, band = part.bands.score(section["knee_flexion_deg"], rules)
        tally.add(points, f"knee bent {round(section['knee_flexion_deg'], 1):g}° ({band})")
    return tally


def _load(section: CheckedSheet, measured: Mapping[str, str]) -> Tally:
    if "points" in section:
        points = section["points"]
        return Tally(points, [measured.get("load", f"{points}: as stated")])
    data = method_data("reba").other["load"]
    small, large = data["limits_kg"]
    kg = section["kg"]
    points = int(data["scores"][0 if kg < small else 1 if kg <= large else 2])
    tally = Tally(points, [f"{points}: {kg:g} kg"])
    if section["shock"]:
        tally.add(int(data["shock"]), "shock or rapid build-up of force")
    return tally


_ACTIVITY_WORDS = {
    "static_over_1min": "a part held longer than 1 min",
    "repeated_over_4_per_min": "small movements repeated more than 4 times a minute",
    "rapid_large_change_or_unstable": "rapid large changes of posture, or an unstable base",
}


def _activity(section: CheckedSheet) -> Tally:
    tally = Tally(0)
    for flag, points in method_data("reba").other["activity"]["values"].items():
        if section[flag]:
            tally.add(int(points), _ACTIVITY_WORDS[flag])
    if not tally.words:
        tally.words.append("0: none stated")
    return tally
