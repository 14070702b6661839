"""RULA over arrays of postures: samples, frames, both.

Use this for recordings and roll-outs; ``score_rula_worksheet`` for one posture with words.
``explain_rula`` gives the words for any one posture of an array.

Source: McAtamney & Corlett 1993; bands and tables in ``tables/rula.json``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .bands import band_scores
from .columns import ANGLE, FLAG, Column, chunks, common_shape, entry, points
from .errors import PostureError, UnmeasuredError
from .evidence import Evidence, evidence_words
from .method_data import method_data
from .rula import RulaResult, rula_from_checked
from .rules import DEFAULT_RULES, ScoringRules
from .worksheet_schema import CheckedSheet

Bytes = NDArray[np.uint8]

#: Scores that go into the tables, with the range each may take when it is not measured.
RULA_PARTS = ("upper_arm", "lower_arm", "wrist", "wrist_twist", "neck", "trunk", "legs")
RULA_ADDED = ("muscle_a", "force_a", "muscle_b", "force_b")

_COLUMNS: Mapping[str, Column] = MappingProxyType(
    {
        "upper_arm_deg": ANGLE,
        "lower_arm_deg": ANGLE,
        "wrist_deg": ANGLE,
        "neck_deg": ANGLE,
        "trunk_deg": ANGLE,
        "shoulder_raised": FLAG,
        "abducted": FLAG,
        "supported": FLAG,
        "across_midline_or_out_to_side": FLAG,
        "wrist_deviated": FLAG,
        "wrist_twist_end": FLAG,
        "neck_twisted": FLAG,
        "neck_side_bent": FLAG,
        "trunk_twisted": FLAG,
        "trunk_side_bent": FLAG,
        "seated_supported": FLAG,
        "legs_supported": FLAG,
        "muscle_a": points(1),
        "muscle_b": points(1),
        "force_a": points(3),
        "force_b": points(3),
    }
)


@dataclass(frozen=True, slots=True)
class RulaInputs:
    """What RULA needs of one arm, the neck, trunk and legs; fields broadcast together.

    Attributes:
        upper_arm_deg: Signed elevation, + flexion, degrees.
        lower_arm_deg: Elbow flexion, 0 straight, degrees.
        wrist_deg: Signed flexion, degrees.
        neck_deg: Signed flexion, degrees.
        trunk_deg: Signed flexion, degrees.
        legs_supported: Legs and feet supported and balanced.
        muscle_a: Muscle-use points of arm and wrist; ``muscle_b`` of neck, trunk, legs.
        force_a: Force points of arm and wrist; ``force_b`` of neck, trunk, legs.
        unmeasured: Parts (names of ``RULA_PARTS`` or ``RULA_ADDED``) whose fields mean nothing.
        evidence: Measurements behind a flag, by ``part.flag`` of the worksheet.
        notes: Words for points that come from elsewhere, by name (``force_a``).
    """

    upper_arm_deg: ArrayLike
    lower_arm_deg: ArrayLike
    wrist_deg: ArrayLike
    neck_deg: ArrayLike
    trunk_deg: ArrayLike
    shoulder_raised: ArrayLike = False
    abducted: ArrayLike = False
    supported: ArrayLike = False
    across_midline_or_out_to_side: ArrayLike = False
    wrist_deviated: ArrayLike = False
    wrist_twist_end: ArrayLike = False
    neck_twisted: ArrayLike = False
    neck_side_bent: ArrayLike = False
    trunk_twisted: ArrayLike = False
    trunk_side_bent: ArrayLike = False
    seated_supported: ArrayLike = False
    legs_supported: ArrayLike = True
    muscle_a: ArrayLike = 0
    muscle_b: ArrayLike = 0
    force_a: ArrayLike = 0
    force_b: ArrayLike = 0
    unmeasured: frozenset[str] = frozenset()
    evidence: Mapping[str, tuple[Evidence, ...]] = field(default_factory=dict)
    notes: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Checks every field and keeps it as an array.

        Raises:
            PostureError: If a field is malformed, or the fields do not broadcast together.
        """
        for name, column in _COLUMNS.items():
            object.__setattr__(self, name, column.checked(name, getattr(self, name)))
        for name in self.unmeasured:
            if name not in RULA_PARTS and name not in RULA_ADDED:
                raise PostureError("unmeasured", f"{name!r} is not a part of RULA")
        common_shape(self.arrays())

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Returns the array fields by name."""
        return {name: getattr(self, name) for name in _COLUMNS}

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the batch."""
        return common_shape(self.arrays())

    def sheet(self, index: tuple[int, ...]) -> CheckedSheet:
        """Returns one posture of the batch as a worksheet's input."""
        value = {name: entry(array, index) for name, array in self.arrays().items()}
        return {
            "upper_arm": {
                "flexion_deg": value["upper_arm_deg"],
                "shoulder_raised": value["shoulder_raised"],
                "abducted": value["abducted"],
                "supported": value["supported"],
            },
            "lower_arm": {
                "flexion_deg": value["lower_arm_deg"],
                "across_midline_or_out_to_side": value["across_midline_or_out_to_side"],
            },
            "wrist": {
                "flexion_deg": value["wrist_deg"],
                "deviated": value["wrist_deviated"],
                "twist": "end" if value["wrist_twist_end"] else "mid",
            },
            "neck": {
                "flexion_deg": value["neck_deg"],
                "twisted": value["neck_twisted"],
                "side_bent": value["neck_side_bent"],
            },
            "trunk": {
                "flexion_deg": value["trunk_deg"],
                "twisted": value["trunk_twisted"],
                "side_bent": value["trunk_side_bent"],
                "seated_supported": value["seated_supported"],
            },
            "legs": {"supported_balanced": value["legs_supported"]},
            "muscle_use_a": value["muscle_a"],
            "muscle_use_b": value["muscle_b"],
            "force_a": value["force_a"],
            "force_b": value["force_b"],
        }


@dataclass(frozen=True, slots=True)
class RulaScores:
    """Every RULA score of a batch, ``(...)`` ``uint8`` each; names as in ``RulaResult``."""

    upper_arm: Bytes
    lower_arm: Bytes
    wrist: Bytes
    wrist_twist: Bytes
    posture_a: Bytes
    muscle_a: Bytes
    force_a: Bytes
    score_c: Bytes
    neck: Bytes
    trunk: Bytes
    legs: Bytes
    posture_b: Bytes
    muscle_b: Bytes
    force_b: Bytes
    score_d: Bytes
    final: Bytes
    action_level: Bytes


@dataclass(frozen=True, slots=True)
class RulaInterval:
    """The least and the greatest score that the unmeasured parts allow; both are attained."""

    low: RulaScores
    high: RulaScores
    unmeasured: frozenset[str]


def score_rula(inputs: RulaInputs, rules: ScoringRules = DEFAULT_RULES) -> RulaScores:
    """Scores a batch of postures.

    Args:
        inputs: Fields that broadcast to ``(...)``.
        rules: The conventions to apply.

    Raises:
        UnmeasuredError: If a part is unmeasured; ask for the interval then.
    """
    if inputs.unmeasured:
        raise UnmeasuredError(inputs.unmeasured)
    return _score(inputs, rules, {})


def score_rula_interval(inputs: RulaInputs, rules: ScoringRules = DEFAULT_RULES) -> RulaInterval:
    """Scores a batch twice: unmeasured parts at their least, then at their greatest.

    The tables never fall along an axis, so no value of the unmeasured parts leaves the interval.

    Args:
        inputs: Fields that broadcast to ``(...)``.
        rules: The conventions to apply.
    """
    low, high = rula_ranges(inputs.unmeasured)
    if not inputs.unmeasured:
        scores = _score(inputs, rules, {})
        return RulaInterval(scores, scores, inputs.unmeasured)
    return RulaInterval(_score(inputs, rules, low), _score(inputs, rules, high), inputs.unmeasured)


def score_rula_with(
    inputs: RulaInputs, scores: Mapping[str, int], rules: ScoringRules = DEFAULT_RULES
) -> RulaScores:
    """Scores a batch as if some parts had the given scores, e.g. to see what they cost.

    Args:
        inputs: Fields that broadcast to ``(...)``.
        scores: Score by part; those parts need not be measured.
        rules: The conventions to apply.

    Raises:
        UnmeasuredError: If another part is unmeasured.
    """
    if inputs.unmeasured - set(scores):
        raise UnmeasuredError(inputs.unmeasured - set(scores))
    return _score(inputs, rules, scores)


def rula_ranges(parts: frozenset[str]) -> tuple[dict[str, int], dict[str, int]]:
    """Returns the least and greatest score of each named part."""
    data = method_data("rula")
    ends: dict[str, tuple[int, int]] = {}
    for name in parts:
        if name in data.parts:
            ends[name] = (data.parts[name].low, data.parts[name].high)
        else:
            low, high = data.other["muscle_use" if name.startswith("muscle") else "force"]["range"]
            ends[name] = (low, high)
    return {k: v[0] for k, v in ends.items()}, {k: v[1] for k, v in ends.items()}


def explain_rula(
    inputs: RulaInputs, index: tuple[int, ...], rules: ScoringRules = DEFAULT_RULES
) -> RulaResult:
    """Scores one posture of a batch in words, with the measurements behind each flag.

    Args:
        inputs: The batch.
        index: Index of the posture in ``inputs.shape``.
        rules: The conventions to apply.

    Returns:
        The scores and their reasons; a part that is not measured counts at its greatest, as in
        the upper end of ``score_rula_interval``, and its reason says so.
    """
    words = evidence_words(inputs.evidence, inputs.notes, index)
    low, high = rula_ranges(inputs.unmeasured)
    unmeasured = {part: (low[part], high[part]) for part in inputs.unmeasured}
    return rula_from_checked(inputs.sheet(index), rules, words, unmeasured)


def combine_rula(parts: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Takes part scores through tables A, B and C.

    Args:
        parts: ``(n,)`` or ``(1,)`` scores of ``RULA_PARTS`` and points of ``RULA_ADDED``.

    Returns:
        All scores of ``RulaScores`` by name.
    """
    data = method_data("rula")
    table = {name: values.reshape(-1) for name, values in data.tables.items()}
    byte = {name: np.asarray(score, dtype=np.uint8) for name, score in parts.items()}
    cell_a = (byte["upper_arm"] - 1) * 3 + (byte["lower_arm"] - 1)
    cell_a = (cell_a * 4 + (byte["wrist"] - 1)) * 2 + (byte["wrist_twist"] - 1)
    cell_b = ((byte["neck"] - 1) * 6 + (byte["trunk"] - 1)) * 2 + (byte["legs"] - 1)
    posture_a, posture_b = table["A"][cell_a], table["B"][cell_b]
    score_c = posture_a + byte["muscle_a"] + byte["force_a"]
    score_d = posture_b + byte["muscle_b"] + byte["force_b"]
    cell_c = (np.minimum(score_c, 8) - 1) * 7 + (np.minimum(score_d, 7) - 1)
    final = table["C"][cell_c]
    levels = np.array([0, *(data.action(s).level for s in data.final_scores)], dtype=np.uint8)
    return {
        **byte,
        "posture_a": posture_a,
        "score_c": score_c,
        "posture_b": posture_b,
        "score_d": score_d,
        "final": final,
        "action_level": levels[final],
    }


def rula_parts(
    columns: Mapping[str, NDArray[Any]], rules: ScoringRules
) -> dict[str, NDArray[np.int8]]:
    """Scores each part by itself.

    Args:
        columns: ``(n,)`` or ``(1,)`` fields of ``RulaInputs``.
        rules: The conventions to apply.
    """
    parts = method_data("rula").parts

    def banded(part: str, angle: str) -> NDArray[np.int8]:
        bands = parts[part].bands
        assert bands is not None
        return band_scores(bands, columns[angle], rules)

    def flag(name: str) -> NDArray[np.int8]:
        return columns[name].view(np.int8)

    upper_arm = banded("upper_arm", "upper_arm_deg") + flag("shoulder_raised") + flag("abducted")
    trunk = np.where(columns["seated_supported"], np.int8(1), banded("trunk", "trunk_deg"))
    return {
        "upper_arm": np.maximum(upper_arm - flag("supported"), 1),
        "lower_arm": banded("lower_arm", "lower_arm_deg") + flag("across_midline_or_out_to_side"),
        "wrist": banded("wrist", "wrist_deg") + flag("wrist_deviated"),
        "wrist_twist": 1 + flag("wrist_twist_end"),
        "neck": banded("neck", "neck_deg") + flag("neck_twisted") + flag("neck_side_bent"),
        "trunk": trunk + flag("trunk_twisted") + flag("trunk_side_bent"),
        "legs": 2 - flag("legs_supported"),
        **{name: columns[name].view(np.int8) for name in RULA_ADDED},
    }


def _score(inputs: RulaInputs, rules: ScoringRules, fixed: Mapping[str, int]) -> RulaScores:
    shape = inputs.shape
    out = {f.name: np.empty(shape, dtype=np.uint8) for f in fields(RulaScores)}
    flat = {name: array.reshape(-1) for name, array in out.items()}
    for run, columns in chunks(inputs.arrays(), shape):
        parts: dict[str, NDArray[Any]] = dict(rula_parts(columns, rules))
        parts |= {name: np.array([score]) for name, score in fixed.items()}
        for name, score in combine_rula(parts).items():
            flat[name][run] = score
    for array in out.values():
        array.setflags(write=False)
    return RulaScores(**out)
