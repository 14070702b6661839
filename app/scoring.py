"""RULA and REBA of whole bodies: both sides, each with its own load, and the worse of the two."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ergonomics import (
    DEFAULT_RULES,
    PostureAngles,
    RebaInputs,
    RulaInputs,
    ScoringRules,
    Side,
    TaskContext,
    posture_angles,
    reba_inputs,
    rula_inputs,
    score_reba_interval,
    score_rula_interval,
)
from human import HumanModel, SegmentPoses

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
    """

    angles: PostureAngles
    rula_inputs: Mapping[Side, RulaInputs]
    reba_inputs: Mapping[Side, RebaInputs]
    rula: Mapping[Side, Bytes]
    reba: Mapping[Side, Bytes]
    rula_least: Mapping[Side, Bytes]
    reba_least: Mapping[Side, Bytes]

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
    rula_ranges = {s: score_rula_interval(rula[s], rules) for s in SIDES}
    reba_ranges = {s: score_reba_interval(reba[s], rules) for s in SIDES}
    return BodyScores(
        angles=angles,
        rula_inputs=rula,
        reba_inputs=reba,
        rula={s: rula_ranges[s].high.final for s in SIDES},
        reba={s: reba_ranges[s].high.final for s in SIDES},
        rula_least={s: rula_ranges[s].low.final for s in SIDES},
        reba_least={s: reba_ranges[s].low.final for s in SIDES},
    )
