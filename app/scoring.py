"""RULA and REBA of whole bodies: both sides, each with its own load, and the worse of the two."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ergonomics import (
    DEFAULT_RULES,
    PostureAngles,
    RebaInputs,
    RebaScores,
    RulaInputs,
    RulaScores,
    ScoringRules,
    Side,
    TaskContext,
    WorstMoment,
    posture_angles,
    reba_inputs,
    rula_inputs,
    score_reba,
    score_reba_interval,
    score_rula,
    score_rula_interval,
    worst_moments,
)
from human import HumanModel, SegmentPoses

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]

SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True, slots=True)
class BodyScores:
    """Scores of a batch of postures, ``(...)`` each.

    Attributes:
        angles: What was measured.
        rula_inputs: By side; ``reba_inputs`` likewise.
        rula: Final scores by side; where a part was not measured, the greatest that it allows.
        rula_least: The least that unmeasured parts allow; ``reba_least`` likewise.
        reba: Final scores by side.
        rula_inside: Points that enter the last table of RULA, by side: they tell postures of equal
            score apart.
    """

    angles: PostureAngles
    rula_inputs: Mapping[Side, RulaInputs]
    reba_inputs: Mapping[Side, RebaInputs]
    rula: Mapping[Side, Bytes]
    reba: Mapping[Side, Bytes]
    rula_least: Mapping[Side, Bytes]
    reba_least: Mapping[Side, Bytes]
    rula_inside: Mapping[Side, NDArray[np.int64]]

    @property
    def worst_rula(self) -> Bytes:
        """RULA of the worse side, instant by instant."""
        return np.maximum(self.rula["left"], self.rula["right"])

    @property
    def worst_reba(self) -> Bytes:
        """REBA of the worse side, instant by instant."""
        return np.maximum(self.reba["left"], self.reba["right"])


def tasks_of(
    hand: Side | None, load_kg: float | None, context: TaskContext | None = None
) -> dict[Side, TaskContext]:
    """Returns what each side does.

    Args:
        hand: The hand that bears the load; None shares it between both.
        load_kg: What is borne; None if it is not known.
        context: Everything else that is known of the task.
    """
    base = context or TaskContext()
    tasks: dict[Side, TaskContext] = {}
    for side in SIDES:
        if load_kg is None:
            tasks[side] = base
            continue
        share = 0.5 if hand is None else float(side == hand)
        tasks[side] = TaskContext(
            load_kg=share * load_kg,
            total_load_kg=load_kg,
            force_mode=base.force_mode,
            coupling=base.coupling,
            arm_supported=base.arm_supported,
            legs=base.legs,
            seated_supported=base.seated_supported,
            static=base.static,
            repeated=base.repeated,
            rapid_change=base.rapid_change,
        )
    return tasks


def score_body(
    model: HumanModel,
    poses: SegmentPoses,
    tasks: Mapping[Side, TaskContext],
    rules: ScoringRules = DEFAULT_RULES,
    unmeasured: frozenset[str] = frozenset(),
) -> BodyScores:
    """Scores postures on both sides.

    Args:
        model: The person.
        poses: Segment poses ``(...)``.
        tasks: What each side does.
        rules: The conventions to apply.
        unmeasured: Segments whose pose is a placeholder.
    """
    angles = posture_angles(model, poses, unmeasured=unmeasured)
    rula = {s: rula_inputs(angles, side=s, task=tasks[s], rules=rules) for s in SIDES}
    reba = {s: reba_inputs(angles, side=s, task=tasks[s]) for s in SIDES}
    rula_ends = {s: _rula_ends(rula[s], rules) for s in SIDES}
    reba_ends = {s: _reba_ends(reba[s], rules) for s in SIDES}
    return BodyScores(
        angles=angles,
        rula_inputs=rula,
        reba_inputs=reba,
        rula={s: rula_ends[s][1].final for s in SIDES},
        reba={s: reba_ends[s][1].final for s in SIDES},
        rula_least={s: rula_ends[s][0].final for s in SIDES},
        reba_least={s: reba_ends[s][0].final for s in SIDES},
        rula_inside={
            s: rula_ends[s][1].score_c.astype(np.int64) + rula_ends[s][1].score_d for s in SIDES
        },
    )


def worst_of_both(
    scores: BodyScores,
    time_s: Array,
    *,
    count: int,
    apart_s: float,
    prefer: Side = "right",
    rules: ScoringRules = DEFAULT_RULES,
) -> list[WorstMoment]:
    """Returns the worst moments of either side, worst first.

    Args:
        scores: ``(T,)`` or ``(S, T)``.
        time_s: ``(T,)`` s.
        count: Most moments.
        apart_s: Least time between two of them, s.
        prefer: The side that is told where both are equally bad.
        rules: The conventions the scores were worked out with.
    """
    mean = {s: np.atleast_2d(scores.rula[s]).mean(axis=0) for s in SIDES}
    inside = {s: np.atleast_2d(scores.rula_inside[s]).mean(axis=0) for s in SIDES}
    other: Side = "left" if prefer == "right" else "right"
    turned = (mean[other] > mean[prefer]) | (
        (mean[other] == mean[prefer]) & (inside[other] > inside[prefer])
    )
    worst = np.where(turned, mean[other], mean[prefer])
    points = np.where(turned, inside[other], inside[prefer])
    chosen: list[int] = []
    for frame in np.lexsort((np.arange(len(worst)), -points, -worst)):
        if len(chosen) == count:
            break
        if all(abs(time_s[frame] - time_s[kept]) >= apart_s for kept in chosen):
            chosen.append(int(frame))
    told: dict[int, WorstMoment] = {}
    for side in SIDES:
        frames = np.array(sorted(f for f in chosen if turned[f] == (side == other)), dtype=np.intp)
        if not len(frames):
            continue
        inputs = _at(scores.rula_inputs[side], frames)
        for moment in worst_moments(
            inputs, time_s[frames], side=side, count=len(frames), apart_s=0.0, rules=rules
        ):
            told[int(frames[moment.index])] = replace(moment, index=int(frames[moment.index]))
    return [told[frame] for frame in chosen]


def _at(inputs: RulaInputs, frames: NDArray[np.intp]) -> RulaInputs:
    """Returns some frames of ``(T,)`` or ``(S, T)`` inputs."""
    shape = inputs.shape

    def at(array: NDArray[Any]) -> NDArray[Any]:
        return np.broadcast_to(array, shape)[..., frames]

    changed: dict[str, Any] = {name: at(array) for name, array in inputs.arrays().items()}
    evidence = {
        key: tuple(replace(one, value=at(one.value)) for one in measured)
        for key, measured in inputs.evidence.items()
    }
    return replace(inputs, **changed, evidence=evidence)


def _rula_ends(inputs: RulaInputs, rules: ScoringRules) -> tuple[RulaScores, RulaScores]:
    if not inputs.unmeasured:
        scores = score_rula(inputs, rules)
        return scores, scores
    interval = score_rula_interval(inputs, rules)
    return interval.low, interval.high


def _reba_ends(inputs: RebaInputs, rules: ScoringRules) -> tuple[RebaScores, RebaScores]:
    if not inputs.unmeasured:
        scores = score_reba(inputs, rules)
        return scores, scores
    interval = score_reba_interval(inputs, rules)
    return interval.low, interval.high
