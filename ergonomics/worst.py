"""The worst moment of a movement: when, which part of the body, and why, in words.

Which part is to blame is decided by ``blame``: its share of the points over the least score.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .angles import Side
from .blame import reba_blame, rula_blame
from .errors import PostureError
from .evidence import Evidence
from .method_data import method_data
from .reba import RebaResult
from .reba_arrays import RebaInputs, RebaScores, explain_reba, score_reba_interval
from .rula import RulaResult
from .rula_arrays import RulaInputs, RulaScores, explain_rula, score_rula_interval
from .rules import DEFAULT_RULES, ScoringRules
from .timeline import time_weights

Floats = NDArray[np.float64]
Inputs = TypeVar("Inputs", RulaInputs, RebaInputs)

_ONE_SIDED = frozenset({"upper_arm", "lower_arm", "wrist", "wrist_twist"})
_PART_WORDS: Mapping[str, str] = {
    "wrist_twist": "forearm twist",
    "muscle_use": "muscle use",
    "coupling": "grip",
}
#: Where the reason of a part stands that enters twice.
_REASON_OF: Mapping[str, str] = {"muscle_use": "muscle_a", "load": "force_a"}


@dataclass(frozen=True, slots=True)
class WorstMoment:
    """A moment with a high score, and what makes it so.

    Attributes:
        index: Frame.
        time_s: When.
        side: Arm scored.
        expected: Mean score over the samples.
        score: Score of the sample that the words describe: the median one.
        part: The part to blame, by field name; empty if none is.
        body_part: The same in words, or ``none``.
        points: Mean points of the final score, over its least, that it is to blame for.
        reason: One sentence.
        reasons: Reason of every field of the described sample.
    """

    index: int
    time_s: float
    side: Side
    expected: float
    score: int
    part: str
    body_part: str
    points: float
    reason: str
    reasons: Mapping[str, str]

    def to_dict(self) -> dict[str, Any]:
        """Returns JSON-ready values."""
        return {
            "time_s": self.time_s,
            "side": self.side,
            "expected": self.expected,
            "score": self.score,
            "body_part": self.body_part,
            "reason": self.reason,
            "reasons": dict(self.reasons),
        }


def worst_moments(
    inputs: RulaInputs | RebaInputs,
    time_s: ArrayLike,
    *,
    side: Side,
    count: int = 1,
    apart_s: float = 1.0,
    rules: ScoringRules = DEFAULT_RULES,
) -> tuple[WorstMoment, ...]:
    """Finds the frames with the highest mean score, worst first.

    Among frames of the same mean score the one with the higher scores before the last table is
    the worse; among those, the first.

    Args:
        inputs: ``(frames,)`` or ``(samples, frames)``.
        time_s: ``(frames,)`` seconds.
        side: The arm that ``inputs`` are of, for the words.
        count: Most moments to return.
        apart_s: Least time between two of them, seconds.
        rules: The conventions to apply.

    Parts that are not measured count at their greatest, and are never to blame.

    Raises:
        PostureError: If shapes or times do not fit.
    """
    shape = inputs.shape
    frames = len(time_weights(time_s))
    if len(shape) not in (1, 2) or shape[-1] != frames:
        raise PostureError("inputs", f"expected (frames,) or (samples, {frames}), got {shape}")
    scores: RulaScores | RebaScores
    if isinstance(inputs, RulaInputs):
        scores = score_rula_interval(inputs, rules).high
    else:
        scores = score_reba_interval(inputs, rules).high
    final = np.atleast_2d(scores.final).mean(axis=0)
    before = np.atleast_2d(_before_last_table(scores)).mean(axis=0)
    order = np.lexsort((np.arange(frames), -before, -final))
    time = np.asarray(time_s, dtype=np.float64)
    chosen: list[int] = []
    for frame in order:
        if len(chosen) == count:
            break
        if all(abs(time[frame] - time[other]) >= apart_s for other in chosen):
            chosen.append(int(frame))
    if not chosen:
        return ()
    # All chosen frames at once: what a call costs does not depend on how many there are.
    moments: RulaInputs | RebaInputs
    if isinstance(inputs, RulaInputs):
        moments = _taken(inputs, lambda array: np.atleast_2d(array[..., chosen]))
        finals, blame = score_rula_interval(moments, rules).high.final, rula_blame(moments, rules)
    else:
        moments = _taken(inputs, lambda array: np.atleast_2d(array[..., chosen]))
        finals, blame = score_reba_interval(moments, rules).high.final, reba_blame(moments, rules)
    return tuple(
        _moment(
            moments,
            place,
            frame,
            float(time[frame]),
            finals[:, place],
            {part: points[:, place] for part, points in blame.items()},
            side,
            rules,
        )
        for place, frame in enumerate(chosen)
    )


def _before_last_table(scores: RulaScores | RebaScores) -> Floats:
    if isinstance(scores, RulaScores):
        return scores.score_c.astype(np.float64) + scores.score_d
    return scores.score_a.astype(np.float64) + scores.score_b


def _moment(
    moments: RulaInputs | RebaInputs,
    place: int,
    frame: int,
    time_s: float,
    finals: NDArray[np.uint8],
    blame: Mapping[str, Floats],
    side: Side,
    rules: ScoringRules,
) -> WorstMoment:
    result: RulaResult | RebaResult
    sample = _described(finals, blame)
    if isinstance(moments, RulaInputs):
        method = "RULA"
        result = explain_rula(moments, (sample, place), rules)
    else:
        method = "REBA"
        result = explain_reba(moments, (sample, place), rules)
    part = _most_to_blame(blame)
    level = method_data("rula" if method == "RULA" else "reba").action(result.final)
    if blame[part].mean() > 0.0:
        words = _PART_WORDS.get(part, part.replace("_", " "))
        body_part = f"{side} {words}" if part in _ONE_SIDED else words
        told = part if part in result.reasons else _REASON_OF[part]
        why = f"{body_part} {result.reasons[told]}"
    else:
        part, body_part, why = "", "none", "no part stands out"
    return WorstMoment(
        index=frame,
        time_s=time_s,
        side=side,
        expected=float(finals.mean()),
        score=result.final,
        part=part,
        body_part=body_part,
        points=float(blame[part].mean()) if part else 0.0,
        reason=f"{method} {result.final} ({level.meaning}): {why}",
        reasons=result.reasons,
    )


def _most_to_blame(blame: Mapping[str, Floats]) -> str:
    return max(blame, key=lambda name: float(blame[name].mean()))


def _described(finals: NDArray[np.uint8], blame: Mapping[str, Floats]) -> int:
    """Returns a sample with the median score in which the blamed part is most to blame."""
    part = _most_to_blame(blame)
    median = np.sort(finals)[len(finals) // 2]
    return int(np.argmax(np.where(finals == median, blame[part], -np.inf)))


def frame_inputs(inputs: Inputs, frame: int) -> Inputs:
    """Returns one frame of ``(frames,)`` or ``(samples, frames)`` inputs, as ``(samples,)``.

    Args:
        inputs: The batch.
        frame: Index along its last axis.
    """
    return _taken(inputs, lambda array: np.atleast_1d(array[..., frame]))


def _taken(inputs: Inputs, take: Callable[[NDArray[Any]], NDArray[Any]]) -> Inputs:
    shape = inputs.shape

    def at(array: NDArray[Any]) -> NDArray[Any]:
        return take(np.broadcast_to(array, shape))

    evidence = {
        key: tuple(Evidence(e.words, at(e.value), e.limit, e.unit) for e in measured)
        for key, measured in inputs.evidence.items()
    }
    changed: dict[str, Any] = {name: at(array) for name, array in inputs.arrays().items()}
    return replace(inputs, **changed, evidence=evidence)
