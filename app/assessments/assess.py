"""One assessment from request to answer: check, predict, score, rank, explain."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.assessments.body import Standing, stand
from app.assessments.candidates import CandidateRejected, hand_path, parse_candidate, slot_id
from app.assessments.evaluate import Evaluated, evaluate, task_assumptions
from app.assessments.posture import PostureRecord
from app.assessments.predict import Predicted, Slot, predict
from app.assessments.results import (
    baseline_results,
    posture_record,
    rejected_slot,
    slot_result,
)
from app.assessments.schemas import AssessmentRequest, Assumption
from app.assessments.timing import prediction_grid, resample
from app.models.operator import Operator
from app.problems import Fault, InvalidRequest, pointer
from ergonomics import DEFAULT_COST, rank_candidates
from human.threads import single_threaded
from prediction import BASELINES

#: Told how many candidates are done, of how many.
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Outcome:
    """An answer, and the postures behind it.

    Attributes:
        result: The answer, ready for JSON, but for id and time of creation.
        postures: Per candidate, for playing back; None where it was rejected.
    """

    result: dict[str, Any]
    postures: list[PostureRecord | None]


@single_threaded
def assess(
    request: AssessmentRequest, operator: Operator, progress: Progress | None = None
) -> Outcome:
    """Ranks the candidates of a request.

    The answer depends on the request and the model alone; each candidate's numbers do not depend on
    the others, but for rank, ties and probability of being best.

    Args:
        request: What to assess.
        operator: The person.
        progress: Told after each candidate; may raise to stop.

    Raises:
        InvalidRequest: The shared part of the request does not fit the model.
    """
    standing = stand(request, operator)
    identifiers = _identifiers(request)
    total = len(identifiers)
    outcomes: list[Slot | CandidateRejected] = [
        _slot(value, index, standing) for index, value in enumerate(request.candidates)
    ]
    slots = [slot for slot in outcomes if isinstance(slot, Slot)]
    predictions = predict(slots, standing, operator, request.samples, request.seed, request.sigma_x)
    predicted: dict[int, Predicted] = {}
    evaluated: dict[int, Evaluated] = {}
    problems = {i: slot for i, slot in enumerate(outcomes) if isinstance(slot, CandidateRejected)}
    for slot, prediction in zip(slots, predictions, strict=True):
        if isinstance(prediction, CandidateRejected):
            problems[slot.index] = prediction
        else:
            predicted[slot.index] = prediction
            path = slot.path
            evaluated[slot.index] = evaluate(
                prediction.q, path.time_s, path.pose.position, request, operator
            )
        if progress is not None:
            progress(len(problems) + len(evaluated), total)
    baselines = {
        method: _baseline(method, slots, standing, operator, request)
        for method in BASELINES
        if method in operator.content.method_names
    }
    return _answer(
        request, operator, standing, identifiers, predicted, evaluated, baselines, problems
    )


def _identifiers(request: AssessmentRequest) -> list[str]:
    identifiers = [slot_id(value, index) for index, value in enumerate(request.candidates)]
    seen: dict[str, int] = {}
    for index, identifier in enumerate(identifiers):
        if identifier in seen:
            raise InvalidRequest(
                "Two candidates have the same id.",
                [
                    Fault(
                        pointer("candidates", index, "id"),
                        "an id of its own",
                        repr(identifier),
                        f"candidate {seen[identifier]} has it already",
                    )
                ],
            )
        seen[identifier] = index
    return identifiers


def _slot(value: Any, index: int, standing: Standing) -> Slot | CandidateRejected:
    try:
        tool = parse_candidate(value, index)
        path = hand_path(tool, standing.frames, standing.grasp, standing.hand)
    except CandidateRejected as problem:
        return problem
    grid = prediction_grid(path.time_s)
    return Slot(tool.id, index, tool.time_s, resample(path, grid), grid.resampled)


def _baseline(
    method: str,
    slots: list[Slot],
    standing: Standing,
    operator: Operator,
    request: AssessmentRequest,
) -> dict[int, dict[str, float]]:
    """Returns what a method says without spread, by candidate; none where it cannot follow.

    Candidates that share their times are scored together.
    """
    central = predict(slots, standing, operator, 0, request.seed, request.sigma_x, method)
    groups: dict[bytes, list[Predicted]] = {}
    for prediction in central:
        if isinstance(prediction, Predicted):
            groups.setdefault(prediction.slot.path.time_s.tobytes(), []).append(prediction)
    out: dict[int, dict[str, float]] = {}
    for group in groups.values():
        scored = evaluate(
            np.stack([one.central for one in group]),
            group[0].slot.path.time_s,
            np.stack([one.slot.path.pose.position for one in group]),
            request,
            operator,
        )
        results = baseline_results(scored)
        out |= {one.slot.index: result for one, result in zip(group, results, strict=True)}
    return out


def _answer(
    request: AssessmentRequest,
    operator: Operator,
    standing: Standing,
    identifiers: list[str],
    predicted: dict[int, Predicted],
    evaluated: dict[int, Evaluated],
    baselines: dict[str, dict[int, dict[str, float]]],
    problems: dict[int, CandidateRejected],
) -> Outcome:
    order = sorted(evaluated)
    ranking = {}
    assumed: dict[int, list[Assumption]] = {}
    scale = np.zeros(0)
    if order:
        costs = np.stack([evaluated[i].cost.total for i in order])
        ranked = rank_candidates([identifiers[i] for i in order], costs)
        ranking = dict(zip(order, ranked, strict=True))
        assumed = dict(
            zip(order, task_assumptions([evaluated[i] for i in order], request), strict=True)
        )
        medians = [np.median(evaluated[i].efforts.moment_norm, axis=0) for i in order]
        scale = np.max([median.max(axis=0) for median in medians], axis=0)
    candidates: list[dict[str, Any]] = []
    postures: list[PostureRecord | None] = []
    for index, identifier in enumerate(identifiers):
        if index in problems:
            place = pointer("candidates", index)
            candidates.append(rejected_slot(identifier, problems[index].body(place)))
            postures.append(None)
            continue
        one = evaluated[index]
        beside = {method: results.get(index) for method, results in baselines.items()}
        answer = slot_result(
            predicted[index],
            one,
            ranking[index],
            beside,
            (*standing.assumed, *assumed[index]),
            request,
        )
        record = posture_record(predicted[index], one, operator.model.dof_names, scale)
        if request.include_posture:
            answer["posture"] = record.to_dict()
        candidates.append(answer)
        postures.append(record)
    result = {
        "name": request.name,
        "model_id": request.model_id,
        "seed": request.seed,
        "samples": request.samples,
        "methods": list(operator.content.method_names),
        "cost_definition": DEFAULT_COST.to_dict(),
        "candidates": candidates,
    }
    return Outcome(result, postures)
