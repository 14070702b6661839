"""RULA from one worksheet, with every intermediate score and the reason for each point.

This is the readable scorer: one posture, words included. For arrays of postures use
``score_rula``; the two are written apart and tested against each other.

Source: McAtamney & Corlett 1993, tables and bands in ``tables/rula.json``.
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
class RulaResult:
    """Scores of one RULA worksheet.

    Attributes:
        posture_a: Table A of upper arm, lower arm, wrist and wrist twist.
        score_c: ``posture_a + muscle_a + force_a``, the row of table C.
        posture_b: Table B of neck, trunk and legs.
        score_d: ``posture_b + muscle_b + force_b``, the column of table C.
        final: Table C, 1 to 7.
        action_level: 1 to 4.
        reasons: For each field, where its points come from.
        rules: The conventions applied.
    """

    upper_arm: int
    lower_arm: int
    wrist: int
    wrist_twist: int
    posture_a: int
    muscle_a: int
    force_a: int
    score_c: int
    neck: int
    trunk: int
    legs: int
    posture_b: int
    muscle_b: int
    force_b: int
    score_d: int
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
            "method": "rula",
            "profile": self.rules.profile,
            "ties": self.rules.ties,
            "neutral_tolerance_deg": self.rules.neutral_tolerance_deg,
        }


_NOT_SCORES = {"reasons", "rules"}


def score_rula_worksheet(
    sheet: Mapping[str, Any],
    *,
    profile: Profile = "paper",
    ties: Ties = "lower",
    neutral_tolerance_deg: float = 5.0,
) -> RulaResult:
    """Scores one RULA worksheet.

    Args:
        sheet: The worksheet's input; a field left out counts as an empty box.
        profile: Published reading; only the intermittent force above 10 kg depends on it.
        ties: Score of an angle exactly on an edge.
        neutral_tolerance_deg: Half-width of "neutral", degrees.

    Returns:
        Every intermediate score, the final score, the action level and the reasons.

    Raises:
        WorksheetError: If the worksheet or an option is malformed; the pointer starts at ``sheet``.
    """
    rules = ScoringRules(profile, ties, neutral_tolerance_deg)
    return rula_from_checked(checked_worksheet("rula", sheet), rules)


def rula_from_checked(
    sheet: CheckedSheet,
    rules: ScoringRules,
    measured: Mapping[str, str] = MappingProxyType({}),
    unmeasured: Mapping[str, tuple[int, int]] = MappingProxyType({}),
) -> RulaResult:
    """Scores a checked worksheet.

    Args:
        sheet: A worksheet with every field present.
        rules: The conventions to apply.
        measured: Words for flags that come from a measurement, by ``part.flag``.
        unmeasured: Least and greatest score of parts whose fields mean nothing; the greatest
            counts, and the reason says so.
    """
    data = method_data("rula")
    tallies = {
        "upper_arm": _flagged("upper_arm", sheet, rules, measured),
        "lower_arm": _flagged("lower_arm", sheet, rules, measured),
        "wrist": _flagged("wrist", sheet, rules, measured),
        "wrist_twist": _twist(sheet["wrist"]["twist"], measured),
        "neck": _flagged("neck", sheet, rules, measured),
        "trunk": _flagged("trunk", sheet, rules, measured),
        "legs": _legs(sheet["legs"]["supported_balanced"]),
    }
    for part, tally in tallies.items():
        tally.hold(data.parts[part])
    added = {name: ends for name, ends in unmeasured.items() if name not in tallies}
    tallies |= {name: not_measured(ends) for name, ends in unmeasured.items() if name in tallies}
    score = {part: tally.score for part, tally in tallies.items()}
    reasons = {part: tally.text() for part, tally in tallies.items()}
    for side in "ab":
        muscle = sheet[f"muscle_use_{side}"]
        score[f"muscle_{side}"] = muscle
        reasons[f"muscle_{side}"] = measured.get(
            f"muscle_{side}",
            "1: held long, or repeated 4 times a minute or more" if muscle else "0: none stated",
        )
        force, why = force_points(sheet[f"force_{side}"], rules.profile)
        score[f"force_{side}"] = force
        reasons[f"force_{side}"] = measured.get(f"force_{side}", why)
    for name, ends in added.items():
        tally = not_measured(ends)
        score[name], reasons[name] = tally.score, tally.text()
    for table, axes, name in (
        ("A", ("upper_arm", "lower_arm", "wrist", "wrist_twist"), "posture_a"),
        ("B", ("neck", "trunk", "legs"), "posture_b"),
    ):
        score[name] = data.look_up(table, *(score[axis] for axis in axes))
        cell = ", ".join(f"{axis.replace('_', ' ')} {score[axis]}" for axis in axes)
        reasons[name] = f"{score[name]}: table {table} at {cell}"
    for name, side in (("score_c", "a"), ("score_d", "b")):
        terms = (score[f"posture_{side}"], score[f"muscle_{side}"], score[f"force_{side}"])
        score[name] = sum(terms)
        reasons[name] = (
            f"{score[name]}: posture {terms[0]} + muscle use {terms[1]} + force {terms[2]}"
        )
    rows, columns = data.tables["C"].shape
    row, column = min(score["score_c"], rows), min(score["score_d"], columns)
    score["final"] = data.look_up("C", row, column)
    reasons["final"] = f"{score['final']}: table C at row {row}, column {column}"
    action = data.action(score["final"])
    reasons["action_level"] = f"{action.level}: {action.meaning}"
    return RulaResult(
        **score, action_level=action.level, reasons=MappingProxyType(reasons), rules=rules
    )


def force_points(force: int | CheckedSheet, profile: Profile) -> tuple[int, str]:
    """Returns RULA's force points with their reason.

    Args:
        force: Points as read off the sheet, or ``{"kg", "mode"}``.
        profile: The worksheet gives 3 above 10 kg in any mode.
    """
    if isinstance(force, int):
        return force, f"{force}: as stated on the sheet"
    data = method_data("rula").other["force"]
    small, large = data["limits_kg"]
    kg, mode = force["kg"], force["mode"]
    band = 0 if kg < small else 1 if kg <= large else 2
    points = int(data[profile][mode][band])
    return points, f"{points}: {kg:g} kg, {mode}"


def _flagged(
    name: str, sheet: CheckedSheet, rules: ScoringRules, measured: Mapping[str, str]
) -> Tally:
    part, section = method_data("rula").parts[name], sheet[name]
    if section.get("seated_supported"):
        tally = Tally(1, ["1: seated and well supported"])
    else:
        tally = banded(part, section["flexion_deg"], rules, "flexion")
    for flag, points in part.modifiers.items():
        if section[flag]:
            tally.add(points, flag_words(f"{name}.{flag}", measured))
    return tally


def _twist(word: str, measured: Mapping[str, str]) -> Tally:
    score = method_data("rula").parts["wrist_twist"].values[word]
    what = "forearm in the middle of its twist" if word == "mid" else None
    return Tally(score, [f"{score}: {what or flag_words('wrist.twist', measured)}"])


def _legs(supported: bool) -> Tally:
    word = "supported_balanced" if supported else "otherwise"
    score = method_data("rula").parts["legs"].values[word]
    what = "supported and balanced" if supported else "not stated as supported and balanced"
    return Tally(score, [f"{score}: legs {what}"])
