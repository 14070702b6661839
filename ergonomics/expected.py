"""RULA and REBA of an uncertain posture, in closed form: no sampling, no training.

Each angle is normal and independent of the others; its score is then a step function of a normal
variable, with probabilities that are differences of the normal distribution function. The tables
are contracted with these probabilities instead of looked up, which gives the exact distribution
of the final score. As the deviation goes to zero it becomes the plain score. Use this for a
measured posture with sensor noise, or as a smooth score; for predicted postures, whose joints are
correlated, score the samples and use ``score_distribution``.

The yes/no boxes are taken as given: only the banded angles are uncertain.

Derived here.
"""

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

from .bands import BandScale
from .columns import chunks
from .distribution import ScoreDistribution
from .errors import PostureError, UnmeasuredError
from .method_data import Method, MethodData, method_data
from .reba_arrays import RebaInputs
from .rula_arrays import RulaInputs
from .rules import DEFAULT_RULES, ScoringRules

Floats = NDArray[np.float64]
Columns = Mapping[str, NDArray[Any]]
Sigma = float | Mapping[str, ArrayLike]

#: The widest table joins 144 cells per posture; this many fit the second-level cache.
_CHUNK = 512


def rula_pmf(
    inputs: RulaInputs, sigma_deg: Sigma, rules: ScoringRules = DEFAULT_RULES
) -> ScoreDistribution:
    """Returns the distribution of RULA when each angle is uncertain by itself.

    Args:
        inputs: ``(...)`` mean angles and boxes.
        sigma_deg: Standard deviation of every angle, degrees, or by field name of ``RulaInputs``
            (fields left out are certain); zero gives the plain score.
        rules: The conventions to apply.

    Raises:
        UnmeasuredError: If a part is unmeasured.
        PostureError: If a deviation is negative, not finite or of an unknown field.
    """
    return _distribution("rula", inputs, sigma_deg, rules, _rula_chunk)


def reba_pmf(
    inputs: RebaInputs, sigma_deg: Sigma, rules: ScoringRules = DEFAULT_RULES
) -> ScoreDistribution:
    """Returns the distribution of REBA when each angle is uncertain by itself.

    Args:
        inputs: ``(...)`` mean angles and boxes.
        sigma_deg: As for ``rula_pmf``, by field name of ``RebaInputs``.
        rules: The conventions to apply.

    Raises:
        UnmeasuredError: If a part is unmeasured.
        PostureError: If a deviation is negative, not finite or of an unknown field.
    """
    return _distribution("reba", inputs, sigma_deg, rules, _reba_chunk)


def _distribution(
    method: Method,
    inputs: RulaInputs | RebaInputs,
    sigma_deg: Sigma,
    rules: ScoringRules,
    contract: Callable[[MethodData, Columns, ScoringRules], Floats],
) -> ScoreDistribution:
    if inputs.unmeasured:
        raise UnmeasuredError(inputs.unmeasured)
    data = method_data(method)
    arrays = inputs.arrays()
    angles = [name for name in arrays if name.endswith("_deg")]
    columns = arrays | _sigmas(sigma_deg, angles)
    shape = np.broadcast_shapes(*(column.shape for column in columns.values()))
    pmf = np.empty((*shape, len(data.final_scores)))
    flat = pmf.reshape(-1, len(data.final_scores))
    for run, chunk in chunks(columns, shape, _CHUNK):
        # Fields of one value are written out, so that every row has its own.
        n = run.stop - run.start
        whole = {name: np.broadcast_to(column, (n,)) for name, column in chunk.items()}
        flat[run] = contract(data, whole, rules)
    pmf.setflags(write=False)
    return ScoreDistribution(data.final_scores, pmf)


def _sigmas(sigma_deg: Sigma, angles: list[str]) -> dict[str, Floats]:
    given = sigma_deg if isinstance(sigma_deg, Mapping) else dict.fromkeys(angles, sigma_deg)
    unknown = set(given) - set(angles)
    if unknown:
        raise PostureError("sigma_deg", f"expected fields {angles}, got {sorted(unknown)}")
    sigmas = {name: np.asarray(given.get(name, 0.0), dtype=np.float64) for name in angles}
    for name, sigma in sigmas.items():
        if not (np.isfinite(sigma) & (sigma >= 0.0)).all():
            raise PostureError("sigma_deg", f"{name}: expected degrees of 0 or more, got {sigma}")
    return {f"sigma {name}": sigma for name, sigma in sigmas.items()}


def _rula_chunk(data: MethodData, columns: Columns, rules: ScoringRules) -> Floats:
    def part(name: str, *boxes: str, less: str | None = None) -> Floats:
        return _part(data, name, columns, rules, _count(columns, boxes, less))

    seated = columns["seated_supported"]
    trunk_boxes = ("trunk_twisted", "trunk_side_bent")
    trunk = np.where(
        seated[:, None],
        _certain(1 + _count(columns, trunk_boxes, None), data.parts["trunk"].high),
        part("trunk", *trunk_boxes),
    )
    posture_a = _through(
        data.tables["A"],
        part("upper_arm", "shoulder_raised", "abducted", less="supported"),
        part("lower_arm", "across_midline_or_out_to_side"),
        part("wrist", "wrist_deviated"),
        _certain(1 + columns["wrist_twist_end"], 2),
    )
    posture_b = _through(
        data.tables["B"],
        part("neck", "neck_twisted", "neck_side_bent"),
        trunk,
        _certain(2 - columns["legs_supported"], 2),
    )
    row = _shifted(posture_a, columns["muscle_a"] + columns["force_a"], 8)
    column = _shifted(posture_b, columns["muscle_b"] + columns["force_b"], 7)
    return _through(data.tables["C"], row, column)


def _reba_chunk(data: MethodData, columns: Columns, rules: ScoringRules) -> Floats:
    def twistable(name: str) -> Floats:
        boxes = _count(columns, (f"{name}_twisted", f"{name}_side_bent"), None)
        points = boxes if rules.profile == "worksheet" else np.minimum(boxes, 1)
        return _part(data, name, columns, rules, points)

    def part(name: str, *boxes: str, less: str | None = None) -> Floats:
        return _part(data, name, columns, rules, _count(columns, boxes, less))

    base = np.where(columns["bilateral"] | columns["sitting"], 1, 2)
    legs = np.where(
        columns["sitting"][:, None],
        _certain(base, 4),
        _part(data, "legs", columns, rules, base, angle="knee_deg"),
    )
    table_a = _through(data.tables["A"], twistable("neck"), twistable("trunk"), legs)
    table_b = _through(
        data.tables["B"],
        part(
            "upper_arm",
            "shoulder_raised",
            "abducted_or_rotated",
            less="supported_or_gravity_assisted",
        ),
        part("lower_arm"),
        part("wrist", "wrist_deviated_or_twisted"),
    )
    score_a = _shifted(table_a, columns["load"], 12)
    score_b = _shifted(table_b, columns["coupling"], 12)
    score_c = _through(data.tables["C"], score_a, score_b)
    activity = _count(
        columns,
        ("static_over_1min", "repeated_over_4_per_min", "rapid_large_change_or_unstable"),
        None,
    )
    return _shifted(score_c, activity, data.final_high)


def _count(columns: Columns, boxes: tuple[str, ...], less: str | None) -> NDArray[np.int64]:
    n = len(next(iter(columns.values())))
    total = np.zeros(n, dtype=np.int64)
    for box in boxes:
        total += columns[box]
    if less is not None:
        total -= columns[less]
    return total


def _part(
    data: MethodData,
    name: str,
    columns: Columns,
    rules: ScoringRules,
    points: NDArray[np.int64],
    angle: str | None = None,
) -> Floats:
    part = data.parts[name]
    assert part.bands is not None
    angle = angle or f"{name}_deg"
    bands = _band_probabilities(part.bands, columns[angle], columns[f"sigma {angle}"], rules)
    pmf = np.zeros((len(points), part.high))
    rows = np.arange(len(points))
    for score, probability in zip(part.bands.scores, bands, strict=True):
        pmf[rows, np.clip(score + points, part.low, part.high) - 1] += probability
    return pmf


def _band_probabilities(
    scale: BandScale, mean: Floats, sigma: Floats, rules: ScoringRules
) -> list[Floats]:
    certain = sigma == 0.0
    spread = np.where(certain, 1.0, sigma)
    below = [np.zeros_like(mean)]
    for step in scale.steps(rules):
        sure = mean < step.at_deg if step.includes_edge else mean <= step.at_deg
        below.append(np.where(certain, sure, ndtr((step.at_deg - mean) / spread)))
    below.append(np.ones_like(mean))
    return [high - low for low, high in pairwise(below)]


def _certain(score: NDArray[Any], high: int) -> Floats:
    return np.asarray(score[:, None] == np.arange(1, high + 1), dtype=np.float64)


def _shifted(pmf: Floats, points: NDArray[Any], high: int) -> Floats:
    """Adds whole points to a score that counts from 1, and gathers what passes the last level."""
    out = np.zeros((len(pmf), high))
    rows = np.arange(len(pmf))
    for level in range(pmf.shape[1]):
        out[rows, np.minimum(level + points.astype(np.intp), high - 1)] += pmf[:, level]
    return out


def _through(table: NDArray[np.uint8], *axes: Floats) -> Floats:
    """Returns the distribution of a table's cell when its axes are independent."""
    joint = axes[0]
    for axis in axes[1:]:
        joint = (joint[:, :, None] * axis[:, None, :]).reshape(len(axis), -1)
    cells = table.reshape(-1)
    onto = np.asarray(cells[:, None] == np.arange(1, cells.max() + 1), dtype=np.float64)
    pmf: Floats = joint @ onto
    return pmf
