"""One assessment from request to answer: check, predict, score, rank, explain."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.assessments.balance import balance_assumed, overhang
from app.assessments.body import Standing, stand
from app.assessments.candidates import (
    CandidateRejected,
    check_size,
    hand_path,
    parse_candidate,
    slot_id,
)
from app.assessments.evaluate import borne_kg, evaluate, task_assumptions
from app.assessments.poses import Array
from app.assessments.posture import PostureRecord
from app.assessments.predict import Predicted, Slot, predict
from app.assessments.results import (
    baseline_results,
    posture_record,
    rejected_slot,
    slot_result,
)
from app.assessments.schemas import AssessmentRequest, Assumption
from app.assessments.timing import grid_size, prediction_grid, resample
from app.models.operator import Operator
from app.plain import rounded
from app.problems import Fault, InvalidRequest, pointer
from ergonomics import DEFAULT_COST, rank_candidates
from human.threads import single_threaded
from prediction import BASELINES

#: Sampled postures held at once, some 600 bytes each several times over.
POSTURES_AT_ONCE = 60_000

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
        progress: Told after every few candidates; may raise to stop.

    Raises:
        InvalidRequest: The shared part of the request does not fit the model.
    """
    standing = stand(request, operator)
    identifiers = _identifiers(request)
    board = _Board(request, operator, standing, identifiers)
    slots = []
    for index, value in enumerate(request.candidates):
        slot = _slot(value, index, standing, request.samples)
        if isinstance(slot, Slot):
            slots.append(slot)
        else:
            board.problems[index] = slot
    for part in _parts(slots, request.samples):
        board.add(part)
        if progress is not None:
            progress(board.done, len(identifiers))
    return board.outcome()


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


def _slot(value: Any, index: int, standing: Standing, samples: int) -> Slot | CandidateRejected:
    try:
        tool = parse_candidate(value, index)
        path = hand_path(tool, standing.frames, standing.grasps, standing.hands)
        check_size(index, grid_size(path.time_s), samples)
    except CandidateRejected as problem:
        return problem
    grid = prediction_grid(path.time_s)
    return Slot(tool.id, index, tool.time_s, resample(path, grid), grid.resampled)


def _parts(slots: list[Slot], samples: int) -> Iterator[list[Slot]]:
    """Yields candidates in parts whose postures fit in memory; a cancel is noticed between them."""
    part: list[Slot] = []
    postures = 0
    for slot in slots:
        part.append(slot)
        postures += len(slot.path.time_s) * (samples + 1)
        if postures >= POSTURES_AT_ONCE:
            yield part
            part, postures = [], 0
    if part:
        yield part


class _Board:
    """Collects answers part by part; keeps of each candidate only what ranking still needs."""

    def __init__(
        self,
        request: AssessmentRequest,
        operator: Operator,
        standing: Standing,
        identifiers: list[str],
    ) -> None:
        self._request, self._operator, self._standing = request, operator, standing
        self._identifiers = identifiers
        self.problems: dict[int, CandidateRejected] = {}
        self._answers: dict[int, dict[str, Any]] = {}
        self._costs: dict[int, Array] = {}
        self._postures: dict[int, PostureRecord] = {}

    @property
    def done(self) -> int:
        """Candidates that have an answer or a problem."""
        return len(self._answers) + len(self.problems)

    def add(self, part: list[Slot]) -> None:
        """Predicts and scores some candidates."""
        request, operator = self._request, self._operator
        predicted: list[Predicted] = []
        for slot, prediction in zip(part, self._predict(part, request.samples), strict=True):
            if isinstance(prediction, CandidateRejected):
                self.problems[slot.index] = prediction
            else:
                predicted.append(prediction)
        if not predicted:
            return
        evaluated = [
            evaluate(
                one.q,
                one.slot.path.time_s,
                one.slot.path.middle(),
                request,
                operator,
                self._standing.footing,
                one.central,
            )
            for one in predicted
        ]
        baselines = {
            method: self._baseline([one.slot for one in predicted], method)
            for method in BASELINES
            if method in operator.content.method_names
        }
        assumed = task_assumptions(evaluated, request, self._standing.taken)
        for prediction, scored, taken in zip(predicted, evaluated, assumed, strict=True):
            index = prediction.slot.index
            taken = [*taken, *self._balance(prediction)]
            beside = {method: results.get(index) for method, results in baselines.items()}
            self._answers[index] = slot_result(prediction, scored, beside, taken, request)
            self._costs[index] = scored.cost.total
            self._postures[index] = posture_record(prediction, scored, operator.model.dof_names)

    def _balance(self, prediction: Predicted) -> list[Assumption]:
        """Returns whether standing feet can hold the person; nothing where the pelvis is held."""
        if self._operator.base != "feet":
            return []
        path = prediction.slot.path
        outside = overhang(
            self._operator.model,
            prediction.central,
            path.middle(),
            borne_kg(self._request),
            self._request.hand_force(),
        )
        return [] if outside is None else [balance_assumed(outside, path.time_s)]

    def _predict(
        self, part: list[Slot], samples: int, method: str | None = None
    ) -> list[Predicted | CandidateRejected]:
        request = self._request
        return predict(
            part, self._standing, self._operator, samples, request.seed, request.sigma_x, method
        )

    def _baseline(self, part: list[Slot], method: str) -> dict[int, dict[str, float]]:
        """Returns what a method says without spread, by candidate; none where it cannot follow.

        Candidates that share their times are scored together.
        """
        groups: dict[bytes, list[Predicted]] = {}
        for prediction in self._predict(part, 0, method):
            if isinstance(prediction, Predicted):
                groups.setdefault(prediction.slot.path.time_s.tobytes(), []).append(prediction)
        out: dict[int, dict[str, float]] = {}
        for group in groups.values():
            scored = evaluate(
                np.stack([one.central for one in group]),
                group[0].slot.path.time_s,
                np.stack([one.slot.path.middle() for one in group]),
                self._request,
                self._operator,
                self._standing.footing,
            )
            results = baseline_results(scored)
            out |= {one.slot.index: result for one, result in zip(group, results, strict=True)}
        return out

    def outcome(self) -> Outcome:
        """Returns the answer, ranked."""
        self._rank()
        request = self._request
        candidates: list[dict[str, Any]] = []
        postures: list[PostureRecord | None] = []
        for index, identifier in enumerate(self._identifiers):
            if index in self.problems:
                problem = self.problems[index].body(pointer("candidates", index))
                candidates.append(rejected_slot(identifier, problem))
                postures.append(None)
                continue
            answer, record = self._answers[index], self._postures[index]
            if request.include_posture:
                answer["posture"] = record.to_dict()
            candidates.append(answer)
            postures.append(record)
        result = {
            "name": request.name,
            "model_id": request.model_id,
            "seed": request.seed,
            "samples": request.samples,
            "methods": list(self._operator.content.method_names),
            "cost_definition": DEFAULT_COST.to_dict(),
            "candidates": candidates,
        }
        return Outcome(result, postures)

    def _rank(self) -> None:
        """Fills in what only all candidates together can tell."""
        order = sorted(self._answers)
        if not order:
            return
        costs = np.stack([self._costs[i] for i in order])
        ranked = rank_candidates([self._identifiers[i] for i in order], costs)
        scale = np.max([self._postures[i].effort_p50_nm.max(axis=0) for i in order], axis=0)
        for index, place in zip(order, ranked, strict=True):
            self._answers[index] |= {
                "rank": place.rank,
                "p_best": rounded(place.p_best),
                "tied_with": list(place.tied_with),
            }
            self._postures[index] = replace(self._postures[index], effort_scale_nm=scale)
