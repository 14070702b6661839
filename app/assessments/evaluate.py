"""Scores predicted postures: RULA, REBA, back, effort, and the cost of each sample."""

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.assessments.body import Taken
from app.assessments.effort import Efforts, HandLoad, arm_joints, joint_efforts
from app.assessments.footing import Footing
from app.assessments.poses import Array
from app.assessments.schemas import AssessmentRequest, Assumption
from app.models.operator import Operator
from app.scoring import SIDES, BodyScores, score_body, tasks_of
from ergonomics import (
    DEFAULT_COST,
    CostSamples,
    RebaInputs,
    RulaInputs,
    Side,
    TaskContext,
    back_angle,
    cost_samples,
    effort_share,
    score_reba,
    score_reba_interval,
    score_rula,
    score_rula_interval,
)
from human import forward_kinematics

#: Samples that the effect of an assumption is worked out on.
_EFFECT_SAMPLES = 4
#: Where REBA counts what RULA counts by itself.
_REBA_PART = {"wrist_twist": "wrist", "force_a": "load", "force_b": "load"}


@dataclass(frozen=True, slots=True)
class Evaluated:
    """Postures, scored.

    Attributes:
        scores: RULA and REBA, ``(S, T)``.
        back_deg: Sum of the bends of the back, ``(S, T)`` degrees.
        efforts: ``(S, T, m)`` N·m.
        cost: By sample, ``(S,)``.
    """

    scores: BodyScores
    back_deg: Array
    efforts: Efforts
    cost: CostSamples


def led_side(request: AssessmentRequest) -> Side | None:
    """Returns the side of the led hand; None of both."""
    return None if request.hand == "both" else request.hand


def hand_load(request: AssessmentRequest, operator: Operator) -> HandLoad:
    """Returns what acts on the person at the hand, or at both together."""
    return HandLoad(
        operator.tips,
        borne_kg(request),
        np.array(request.hand_force_n, dtype=float),
    )


def borne_kg(request: AssessmentRequest) -> float:
    """Returns the mass that the person bears, zero if it is not known."""
    return (request.payload_kg or 0.0) * request.payload_share


def scored_load_kg(request: AssessmentRequest) -> float | None:
    """Returns the load that RULA and REBA count: weight borne and further force, in kg.

    The force's size counts whatever its direction: the tables know loads, not directions. None if
    nothing was said of either.
    """
    force = np.array(request.hand_force_n, dtype=float)
    if request.payload_kg is None and not force.any():
        return None
    weight = np.array([0.0, 0.0, -9.81 * borne_kg(request)])
    return float(np.linalg.norm(weight + force) / 9.81)


def task_contexts(request: AssessmentRequest) -> Mapping[Side, TaskContext]:
    """Returns what is known of the task, by side."""
    context = TaskContext(coupling=None, legs=None)
    return tasks_of(led_side(request), scored_load_kg(request), context)


def evaluate(
    q: Array,
    time_s: Array,
    hand_position: Array,
    request: AssessmentRequest,
    operator: Operator,
    footing: Footing,
    central: Array | None = None,
) -> Evaluated:
    """Scores postures that share their times.

    Args:
        q: ``(S, T, nq)`` configurations: samples of one candidate, or one of each of several.
        time_s: ``(T,)`` s.
        hand_position: Where the hand is led, or the middle of both, ``(T, 3)`` or ``(S, T, 3)`` m,
            world.
        request: Load, force and foot split.
        operator: The person.
        footing: What stays in place.
        central: The path that the samples deviate from, ``(T, nq)``; None if ``q`` holds such
            paths.
    """
    poses = forward_kinematics(operator.model, q)
    scores = score_body(operator.model, poses, task_contexts(request))
    back = back_angle(operator.model, poses).chain_sum_deg
    efforts = joint_efforts(
        operator.model,
        q,
        time_s,
        hand_position,
        request.hand,
        hand_load(request, operator),
        operator.chain.dof_indices,
        request.foot_split,
        central,
        footing,
    )
    arm = arm_joints(request.hand)
    shares = effort_share(efforts.moment_norm[..., : len(arm)], arm)
    cost = cost_samples(
        {
            "rula": scores.worst_rula,
            "back_angle_deg": back,
            "effort_share": shares.max(axis=-1),
        },
        time_s,
        DEFAULT_COST,
    )
    return Evaluated(scores, back, efforts, cost)


def task_assumptions(
    evaluated: Sequence[Evaluated], request: AssessmentRequest, taken: Sequence[Taken] = ()
) -> list[list[Assumption]]:
    """Returns what was taken for granted, with the range each opens in the scores.

    The range is that of the led side's mean score over time (with both hands led, of the side that
    scores worse): when an assumption about the task is
    turned over; and for one about the body, between the parts it decides at their least and at
    their greatest, which no posture leaves. All candidates are scored together, a few samples of
    each.

    Args:
        evaluated: The candidates.
        request: What is known of the task.
        taken: What was taken for granted of the body; comes first.

    Returns:
        One list per candidate.
    """
    side = _worse_side(evaluated) if request.hand == "both" else request.hand
    rula = _Stacked.of([one.scores.rula_inputs[side] for one in evaluated])
    reba = _Stacked.of([one.scores.reba_inputs[side] for one in evaluated])
    out: list[list[Assumption]] = [[] for _ in evaluated]
    for body in taken:
        if not body.parts:
            for found in out:
                found.append(body.assumption)
            continue
        low, high = rula.bounds(body.parts)
        reba_low, reba_high = reba.bounds({_REBA_PART.get(part, part) for part in body.parts})
        for k, found in enumerate(out):
            effect = (
                f"{body.assumption.effect}: RULA mean {low[k]:.1f} to {high[k]:.1f}; "
                f"REBA mean {reba_low[k]:.1f} to {reba_high[k]:.1f}"
            )
            found.append(body.assumption.model_copy(update={"effect": effect}))
    for one in task_contexts(request)[side].assumptions():
        spans = [
            (method, stacked.means({}), stacked.means(changes))
            for method, stacked, changes in (("RULA", rula, one.rula), ("REBA", reba, one.reba))
            if changes
        ]
        for k, found in enumerate(out):
            words = [
                f"{method} mean {min(here[k], there[k]):.1f} to {max(here[k], there[k]):.1f}"
                for method, here, there in spans
            ]
            effect = "; ".join(words) or "none on these scores"
            found.append(Assumption(what=one.what, value=one.value, range=one.range, effect=effect))
    return out


def _worse_side(evaluated: Sequence[Evaluated]) -> Side:
    means = {s: np.mean([one.scores.rula[s].mean() for one in evaluated]) for s in SIDES}
    return "left" if means["left"] > means["right"] else "right"


@dataclass(frozen=True, slots=True)
class _Stacked:
    """A few samples of many candidates as one batch, and the mean scores of each.

    Attributes:
        inputs: ``(n,)``, candidate after candidate.
        edges: Where each candidate begins, ``(C,)``.
        known: Mean scores by what was changed.
    """

    inputs: RulaInputs | RebaInputs
    edges: NDArray[np.intp]
    known: dict[tuple[Any, ...], Array]

    @classmethod
    def of(cls, parts: Sequence[RulaInputs | RebaInputs]) -> "_Stacked":
        """Stacks the first samples of each candidate, without the words behind them."""
        sizes = [min(part.shape[0], _EFFECT_SAMPLES) * part.shape[-1] for part in parts]
        arrays: dict[str, NDArray[Any]] = {}
        for name, first in parts[0].arrays().items():
            if first.ndim == 0:
                arrays[name] = first
                continue
            arrays[name] = np.concatenate(
                [
                    np.broadcast_to(part.arrays()[name], part.shape)[:_EFFECT_SAMPLES].reshape(-1)
                    for part in parts
                ]
            )
        stacked = replace(parts[0], **arrays, evidence={})  # type: ignore[arg-type]
        edges = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.intp)
        return cls(stacked, edges, {})

    def means(self, changes: Mapping[str, Any]) -> Array:
        """Returns the mean score of each candidate with some fields changed, ``(C,)``."""
        key = tuple(sorted(changes.items()))
        if key not in self.known:
            changed = replace(self.inputs, **changes)
            final: NDArray[np.uint8] = (
                score_rula(changed).final
                if isinstance(changed, RulaInputs)
                else score_reba(changed).final
            )
            self.known[key] = self._by_candidate(final)
        return self.known[key]

    def bounds(self, parts: Set[str]) -> tuple[Array, Array]:
        """Returns each candidate's mean score with some parts at their least and greatest."""
        free = replace(self.inputs, unmeasured=self.inputs.unmeasured | parts)
        ends = (
            score_rula_interval(free) if isinstance(free, RulaInputs) else score_reba_interval(free)
        )
        return self._by_candidate(ends.low.final), self._by_candidate(ends.high.final)

    def _by_candidate(self, final: NDArray[np.uint8]) -> Array:
        ends = np.append(self.edges[1:], len(final))
        return np.asarray(
            np.add.reduceat(final.astype(np.float64), self.edges) / (ends - self.edges)
        )
