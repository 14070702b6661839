"""REBA over arrays of postures: samples, frames, both.

Use this for recordings and roll-outs; ``score_reba_worksheet`` for one posture with words.
``explain_reba`` gives the words for any one posture of an array.

Source: Hignett & McAtamney 2000; bands and tables in ``tables/reba.json``.
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
from .reba import RebaResult, reba_from_checked
from .rules import DEFAULT_RULES, ScoringRules
from .worksheet_schema import CheckedSheet

Bytes = NDArray[np.uint8]

REBA_PARTS = ("neck", "trunk", "legs", "upper_arm", "lower_arm", "wrist")
REBA_ADDED = ("load", "coupling", "activity")
_GRIPS = ("good", "fair", "poor", "unacceptable")

_COLUMNS: Mapping[str, Column] = MappingProxyType(
    {
        "neck_deg": ANGLE,
        "trunk_deg": ANGLE,
        "knee_deg": ANGLE,
        "upper_arm_deg": ANGLE,
        "lower_arm_deg": ANGLE,
        "wrist_deg": ANGLE,
        "neck_twisted": FLAG,
        "neck_side_bent": FLAG,
        "trunk_twisted": FLAG,
        "trunk_side_bent": FLAG,
        "bilateral": FLAG,
        "sitting": FLAG,
        "shoulder_raised": FLAG,
        "abducted_or_rotated": FLAG,
        "supported_or_gravity_assisted": FLAG,
        "wrist_deviated_or_twisted": FLAG,
        "static_over_1min": FLAG,
        "repeated_over_4_per_min": FLAG,
        "rapid_large_change_or_unstable": FLAG,
        "load": points(3),
        "coupling": points(3),
    }
)


@dataclass(frozen=True, slots=True)
class RebaInputs:
    """What REBA needs of one arm, the neck, trunk and legs; fields broadcast together.

    Attributes:
        neck_deg: Signed flexion, degrees; likewise ``trunk_deg``.
        knee_deg: Flexion of the worse knee, degrees.
        upper_arm_deg: Signed elevation, + flexion, degrees.
        lower_arm_deg: Elbow flexion, 0 straight, degrees.
        wrist_deg: Signed flexion, degrees.
        bilateral: Weight on both legs, or walking.
        load: Load points, shock included.
        coupling: Grip points, 0 good to 3 unacceptable.
        unmeasured: Parts (names of ``REBA_PARTS`` or ``REBA_ADDED``) whose fields mean nothing.
        evidence: Measurements behind a flag, by ``part.flag`` of the worksheet.
        notes: Words for points that come from elsewhere, by name (``load``).
    """

    neck_deg: ArrayLike
    trunk_deg: ArrayLike
    knee_deg: ArrayLike
    upper_arm_deg: ArrayLike
    lower_arm_deg: ArrayLike
    wrist_deg: ArrayLike
    neck_twisted: ArrayLike = False
    neck_side_bent: ArrayLike = False
    trunk_twisted: ArrayLike = False
    trunk_side_bent: ArrayLike = False
    bilateral: ArrayLike = True
    sitting: ArrayLike = False
    shoulder_raised: ArrayLike = False
    abducted_or_rotated: ArrayLike = False
    supported_or_gravity_assisted: ArrayLike = False
    wrist_deviated_or_twisted: ArrayLike = False
    static_over_1min: ArrayLike = False
    repeated_over_4_per_min: ArrayLike = False
    rapid_large_change_or_unstable: ArrayLike = False
    load: ArrayLike = 0
    coupling: ArrayLike = 0
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
            if name not in REBA_PARTS and name not in REBA_ADDED:
                raise PostureError("unmeasured", f"{name!r} is not a part of REBA")
        common_shape(self.arrays())

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Returns the array fields by name."""
        return {name: getattr(self, name) for name in _COLUMNS}

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the batch."""
        return common_shape(self.arrays())

    def sheet(self, index: tuple[int, ...]) -> CheckedSheet:
        """Returns one posture of the batch as a worksheet's input, its load as points."""
        value = {name: entry(array, index) for name, array in self.arrays().items()}
        return {
            **{
                part: {
                    "flexion_deg": value[f"{part}_deg"],
                    "twisted": value[f"{part}_twisted"],
                    "side_bent": value[f"{part}_side_bent"],
                }
                for part in ("neck", "trunk")
            },
            "legs": {
                "bilateral": value["bilateral"],
                "sitting": value["sitting"],
                "knee_flexion_deg": value["knee_deg"],
            },
            "upper_arm": {
                "flexion_deg": value["upper_arm_deg"],
                "shoulder_raised": value["shoulder_raised"],
                "abducted_or_rotated": value["abducted_or_rotated"],
                "supported_or_gravity_assisted": value["supported_or_gravity_assisted"],
            },
            "lower_arm": {"flexion_deg": value["lower_arm_deg"]},
            "wrist": {
                "flexion_deg": value["wrist_deg"],
                "deviated_or_twisted": value["wrist_deviated_or_twisted"],
            },
            "load": {"points": value["load"]},
            "coupling": _GRIPS[value["coupling"]],
            "activity": {
                name: value[name]
                for name in (
                    "static_over_1min",
                    "repeated_over_4_per_min",
                    "rapid_large_change_or_unstable",
                )
            },
        }


@dataclass(frozen=True, slots=True)
class RebaScores:
    """Every REBA score of a batch, ``(...)`` ``uint8`` each; names as in ``RebaResult``."""

    neck: Bytes
    trunk: Bytes
    legs: Bytes
    table_a: Bytes
    load: Bytes
    score_a: Bytes
    upper_arm: Bytes
    lower_arm: Bytes
    wrist: Bytes
    table_b: Bytes
    coupling: Bytes
    score_b: Bytes
    score_c: Bytes
    activity: Bytes
    final: Bytes
    action_level: Bytes


@dataclass(frozen=True, slots=True)
class RebaInterval:
    """The least and the greatest score that the unmeasured parts allow; both are attained."""

    low: RebaScores
    high: RebaScores
    unmeasured: frozenset[str]


def score_reba(inputs: RebaInputs, rules: ScoringRules = DEFAULT_RULES) -> RebaScores:
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


def score_reba_interval(inputs: RebaInputs, rules: ScoringRules = DEFAULT_RULES) -> RebaInterval:
    """Scores a batch twice: unmeasured parts at their least, then at their greatest.

    The tables never fall along an axis, so no value of the unmeasured parts leaves the interval.

    Args:
        inputs: Fields that broadcast to ``(...)``.
        rules: The conventions to apply.
    """
    low, high = reba_ranges(inputs.unmeasured)
    if not inputs.unmeasured:
        scores = _score(inputs, rules, {})
        return RebaInterval(scores, scores, inputs.unmeasured)
    return RebaInterval(_score(inputs, rules, low), _score(inputs, rules, high), inputs.unmeasured)


def score_reba_with(
    inputs: RebaInputs, scores: Mapping[str, int], rules: ScoringRules = DEFAULT_RULES
) -> RebaScores:
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


def reba_ranges(parts: frozenset[str]) -> tuple[dict[str, int], dict[str, int]]:
    """Returns the least and greatest score of each named part."""
    data = method_data("reba")
    ends: dict[str, tuple[int, int]] = {}
    for name in parts:
        if name in data.parts:
            ends[name] = (data.parts[name].low, data.parts[name].high)
        else:
            # Every addition of REBA (load with shock, coupling, activity) runs from 0 to 3.
            ends[name] = (0, 3)
    return {k: v[0] for k, v in ends.items()}, {k: v[1] for k, v in ends.items()}


def explain_reba(
    inputs: RebaInputs, index: tuple[int, ...], rules: ScoringRules = DEFAULT_RULES
) -> RebaResult:
    """Scores one posture of a batch in words, with the measurements behind each flag.

    Args:
        inputs: The batch.
        index: Index of the posture in ``inputs.shape``.
        rules: The conventions to apply.

    Returns:
        The scores and their reasons; a part that is not measured counts at its greatest, as in
        the upper end of ``score_reba_interval``, and its reason says so.
    """
    words = evidence_words(inputs.evidence, inputs.notes, index)
    low, high = reba_ranges(inputs.unmeasured)
    unmeasured = {part: (low[part], high[part]) for part in inputs.unmeasured}
    return reba_from_checked(inputs.sheet(index), rules, words, unmeasured)


def combine_reba(parts: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Takes part scores through tables A, B and C.

    Args:
        parts: ``(n,)`` or ``(1,)`` scores of ``REBA_PARTS`` and points of ``REBA_ADDED``.

    Returns:
        All scores of ``RebaScores`` by name.
    """
    data = method_data("reba")
    table = {name: values.reshape(-1) for name, values in data.tables.items()}
    byte = {name: np.asarray(score, dtype=np.uint8) for name, score in parts.items()}
    cell_a = ((byte["neck"] - 1) * 5 + (byte["trunk"] - 1)) * 4 + (byte["legs"] - 1)
    cell_b = ((byte["upper_arm"] - 1) * 2 + (byte["lower_arm"] - 1)) * 3 + (byte["wrist"] - 1)
    table_a, table_b = table["A"][cell_a], table["B"][cell_b]
    score_a, score_b = table_a + byte["load"], table_b + byte["coupling"]
    score_c = table["C"][(score_a - 1) * 12 + (score_b - 1)]
    final = score_c + byte["activity"]
    levels = np.array([0, *(data.action(s).level for s in data.final_scores)], dtype=np.uint8)
    return {
        **byte,
        "table_a": table_a,
        "score_a": score_a,
        "table_b": table_b,
        "score_b": score_b,
        "score_c": score_c,
        "final": final,
        "action_level": levels[final],
    }


def reba_parts(
    columns: Mapping[str, NDArray[Any]], rules: ScoringRules
) -> dict[str, NDArray[np.int8]]:
    """Scores each part by itself.

    Args:
        columns: ``(n,)`` or ``(1,)`` fields of ``RebaInputs``.
        rules: The conventions to apply.
    """
    parts = method_data("reba").parts

    def banded(part: str, angle: str) -> NDArray[np.int8]:
        bands = parts[part].bands
        assert bands is not None
        return band_scores(bands, columns[angle], rules)

    def flag(name: str) -> NDArray[np.int8]:
        return columns[name].view(np.int8)

    def twistable(part: str, high: int) -> NDArray[np.int8]:
        twisted, bent = flag(f"{part}_twisted"), flag(f"{part}_side_bent")
        extra = twisted + bent if rules.profile == "worksheet" else twisted | bent
        return np.minimum(banded(part, f"{part}_deg") + extra, np.int8(high))

    standing = ~columns["sitting"]
    legs = 1 + (standing & ~columns["bilateral"]).view(np.int8)
    upper_arm = banded("upper_arm", "upper_arm_deg")
    upper_arm = upper_arm + flag("shoulder_raised") + flag("abducted_or_rotated")
    return {
        "neck": twistable("neck", parts["neck"].high),
        "trunk": twistable("trunk", parts["trunk"].high),
        "legs": legs + banded("legs", "knee_deg") * standing.view(np.int8),
        "upper_arm": np.maximum(upper_arm - flag("supported_or_gravity_assisted"), 1),
        "lower_arm": banded("lower_arm", "lower_arm_deg"),
        "wrist": banded("wrist", "wrist_deg") + flag("wrist_deviated_or_twisted"),
        "load": columns["load"].view(np.int8),
        "coupling": columns["coupling"].view(np.int8),
        "activity": flag("static_over_1min")
        + flag("repeated_over_4_per_min")
        + flag("rapid_large_change_or_unstable"),
    }


def _score(inputs: RebaInputs, rules: ScoringRules, fixed: Mapping[str, int]) -> RebaScores:
    shape = inputs.shape
    out = {f.name: np.empty(shape, dtype=np.uint8) for f in fields(RebaScores)}
    flat = {name: array.reshape(-1) for name, array in out.items()}
    for run, columns in chunks(inputs.arrays(), shape):
        parts: dict[str, NDArray[Any]] = dict(reba_parts(columns, rules))
        parts |= {name: np.array([score]) for name, score in fixed.items()}
        for name, score in combine_reba(parts).items():
            flat[name][run] = score
    for array in out.values():
        array.setflags(write=False)
    return RebaScores(**out)
