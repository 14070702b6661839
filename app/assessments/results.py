"""Writes scored candidates as the answer that a planner gets."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from app.assessments.effort import arm_joints
from app.assessments.evaluate import Evaluated, led_side
from app.assessments.poses import Array
from app.assessments.posture import PostureRecord
from app.assessments.predict import Predicted, spread
from app.assessments.schemas import AssessmentRequest, Assumption
from app.plain import rounded
from app.scoring import SIDES, worst_of_both
from ergonomics import (
    ScoreDistribution,
    WorstMoment,
    effort_share,
    score_distribution,
)

#: Below this familiarity the model is asked about postures it has hardly seen.
FAMILIAR = 0.3
#: A hand taken to hold a tool from further away than this is worth a word, m.
FAR_GRASP_M = 0.35
#: Most moments told per candidate, and the least time between two of them, s.
MOMENTS = 5
MOMENTS_APART_S = 0.5
#: Sampled bodies kept for playing back.
_SHOWN_SAMPLES = 5


def rejected_slot(identifier: str, problem: dict[str, Any]) -> dict[str, Any]:
    """Returns the answer of a candidate that was not assessed."""
    empty = dict.fromkeys(
        ("rank", "p_best", "cost", "rula", "reba", "back_angle_deg", "effort_nm", "worst")
    )
    return {
        "id": identifier,
        **empty,
        "tied_with": [],
        "moments": [],
        "assumed": [],
        "out_of_distribution": None,
        "baseline": None,
        "problem": problem,
    }


def slot_result(
    predicted: Predicted,
    evaluated: Evaluated,
    baseline: dict[str, Any],
    assumed: Sequence[Assumption],
    request: AssessmentRequest,
) -> dict[str, Any]:
    """Returns the answer of one candidate, its place among the others left open."""
    time_s = predicted.slot.path.time_s
    scores = evaluated.scores
    moments = worst_of_both(
        scores, time_s, count=MOMENTS, apart_s=MOMENTS_APART_S, prefer=led_side(request) or "right"
    )
    rula = score_distribution(scores.worst_rula, "rula")
    return {
        "id": predicted.slot.id,
        "rank": None,
        "p_best": None,
        "tied_with": [],
        "cost": _cost(evaluated),
        "rula": {**_course(time_s, rula), "p_ge_5": rounded(rula.at_least(5))},
        "reba": _course(time_s, score_distribution(scores.worst_reba, "reba")),
        "back_angle_deg": {"time_s": rounded(time_s), **_band(evaluated.back_deg, 3)},
        "effort_nm": {
            name: _band(evaluated.efforts.moment_norm[..., k], 3)
            for k, name in enumerate(evaluated.efforts.joint_names)
        },
        "worst": _worst(moments[0], evaluated, request),
        "moments": [_moment(one) for one in moments],
        "assumed": [one.model_dump() for one in (*assumed, *_own(predicted, evaluated, request))],
        "out_of_distribution": _familiarity(predicted),
        "baseline": baseline,
        "problem": None,
    }


def baseline_results(evaluated: Evaluated) -> list[dict[str, float]]:
    """Returns what a baseline's central postures cost, candidate by candidate."""
    means, totals = evaluated.cost.values["rula_mean"], evaluated.cost.total
    return [
        {"rula_expected_mean": rounded(mean), "cost_total": rounded(total)}
        for mean, total in zip(means, totals, strict=True)
    ]


def posture_record(
    predicted: Predicted, evaluated: Evaluated, joint_names: tuple[str, ...]
) -> PostureRecord:
    """Returns what is needed to play a candidate back, its colours scaled to itself."""
    effort = np.median(evaluated.efforts.moment_norm, axis=0)
    chosen = spread(predicted.q, _SHOWN_SAMPLES + 1)
    medoid = predicted.q[chosen[0]]
    return PostureRecord(
        time_s=predicted.slot.path.time_s,
        joint_names=np.array(joint_names),
        # Copies: a view would keep every sample of the candidate alive.
        joint_position=medoid[:, 7:].copy(),
        samples=predicted.q[chosen[1:], :, 7:].copy(),
        base_position=medoid[:, :3].copy(),
        base_orientation_xyzw=medoid[:, 3:7].copy(),
        samples_base_position=predicted.q[chosen[1:], :, :3].copy(),
        samples_base_orientation_xyzw=predicted.q[chosen[1:], :, 3:7].copy(),
        effort_joint_names=np.array(evaluated.efforts.joint_names),
        effort_p50_nm=effort,
        effort_scale_nm=effort.max(axis=0),
        target_position=predicted.slot.path.middle(),
    )


def _cost(evaluated: Evaluated) -> dict[str, Any]:
    cost = evaluated.cost.to_dict()
    parts = [
        {**part, "value": rounded(part["value"]), "contribution": rounded(part["contribution"])}
        for part in cost["parts"]
    ]
    return {"total": rounded(cost["total"]), "parts": parts}


def _course(time_s: Array, distribution: ScoreDistribution) -> dict[str, Any]:
    return {
        "time_s": rounded(time_s),
        "pmf": rounded(distribution.pmf),
        "expected": rounded(distribution.expected),
        "p05": rounded(distribution.quantile(0.05)),
        "p95": rounded(distribution.quantile(0.95)),
    }


def _band(values: Array, digits: int) -> dict[str, Any]:
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95], axis=0)
    return {
        "p05": rounded(low, digits),
        "p50": rounded(middle, digits),
        "p95": rounded(high, digits),
    }


def _moment(moment: WorstMoment) -> dict[str, Any]:
    return {
        "time_s": rounded(moment.time_s),
        "side": moment.side,
        "body_part": moment.body_part,
        "reason": moment.reason,
        "score": rounded(moment.expected, 3),
    }


def _worst(moment: WorstMoment, evaluated: Evaluated, request: AssessmentRequest) -> dict[str, Any]:
    """Returns the worst moment, with the effort of the joint that works hardest then."""
    arm = arm_joints(request.hand)
    then = np.median(evaluated.efforts.moment_norm[:, moment.index, : len(arm)], axis=0)
    hardest = int(np.argmax(effort_share(then, arm)))
    return {
        "time_s": rounded(moment.time_s),
        "side": moment.side,
        "body_part": moment.body_part,
        "reason": moment.reason,
        "rula": rounded(moment.expected, 3),
        "effort_nm": rounded(then[hardest], 3),
        "effort_joint": arm[hardest],
    }


def _own(
    predicted: Predicted, evaluated: Evaluated, request: AssessmentRequest
) -> list[Assumption]:
    slot = predicted.slot
    found = [
        Assumption(
            what="side that is scored",
            value="the worse of both sides, instant by instant",
            range="both hands led"
            if request.hand == "both"
            else f"{request.hand} hand led; the other arm stays at the start posture",
            effect=_sides(evaluated),
        )
    ]
    if slot.resampled:
        step = float(np.diff(slot.path.time_s).mean())
        found.append(
            Assumption(
                what="time steps",
                value=f"resampled from {len(slot.sent_s)} to {len(slot.path.time_s)} points, "
                f"{step:.3f} s apart, straight between the ones sent",
                range="the robot may move otherwise between the points",
                effect="speeds and inertia between the points",
            )
        )
    if slot.path.held_m > FAR_GRASP_M:
        found.append(
            Assumption(
                what="a hand far from the tool",
                value=f"{slot.path.held_m:.2f} m from the trajectory's first point, as one body",
                range="a hand holds what it touches",
                effect="the whole way of the hand: check start, frames, units, or give the grasp",
            )
        )
    if slot.path.position_only:
        found.append(
            Assumption(
                what="orientation of the hand",
                value="free: no orientation was sent",
                range="free",
                effect="predicted with the posture",
            )
        )
    if predicted.strayed > 0.0:
        found.append(
            Assumption(
                what="postures beyond joint limits",
                value=f"{predicted.strayed:.1%} of the sampled postures could not follow; the "
                "central posture stands in for them",
                range="limits differ between people",
                effect="bands are too narrow there",
            )
        )
    return found


def _sides(evaluated: Evaluated) -> str:
    means = {side: float(evaluated.scores.rula[side].mean()) for side in SIDES}
    return ", ".join(f"RULA mean {means[side]:.1f} on the {side}" for side in SIDES)


def _familiarity(predicted: Predicted) -> dict[str, Any]:
    values = predicted.familiarity
    least = int(np.argmin(values))
    return {
        "flag": bool(values[least] < FAMILIAR),
        "familiarity_min": rounded(values[least]),
        "time_s": rounded(predicted.slot.path.time_s[least]),
    }
