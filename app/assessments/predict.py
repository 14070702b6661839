"""From checked hand paths to sampled whole-body postures."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.assessments.body import Standing
from app.assessments.candidates import CandidateRejected, HandPath
from app.assessments.poses import Array
from app.assessments.schemas import SigmaX
from app.models.operator import Operator
from app.problems import Fault, pointer
from prediction import HandNoise, Rollout, Task, TrajectoryError, UnreachableTrajectoryError
from prediction import HandPath as LedPath

_HAND_WORDS = {"right": "hand", "left": "hand", "both": "hands"}
_BASE_WORDS = {"pelvis": "pelvis where it is", "feet": "feet where they are"}


@dataclass(frozen=True, slots=True)
class Slot:
    """One candidate that is well formed, at the times of the prediction.

    Attributes:
        id: The client's name for it.
        index: Its place in the request.
        sent_s: The times that were sent, ``(K,)`` s.
        path: The hand's way in the world, at the times of the prediction.
        resampled: Whether those differ from the ones sent.
    """

    id: str
    index: int
    sent_s: Array
    path: HandPath
    resampled: bool


@dataclass(frozen=True, slots=True)
class Predicted:
    """Postures along one candidate.

    Attributes:
        slot: The candidate.
        q: Sampled configurations, ``(S, T, nq)``.
        central: Configurations without deviation, ``(T, nq)``.
        familiarity: How well the demonstrations cover the central postures, ``(T,)`` in [0, 1].
        strayed: Share of sampled postures that could not follow within the joint limits; the
            central posture stands in for them.
    """

    slot: Slot
    q: Array
    central: Array
    familiarity: Array
    strayed: float


def predict(
    slots: Sequence[Slot],
    standing: Standing,
    operator: Operator,
    samples: int,
    seed: int,
    sigma: SigmaX,
    method: str | None = None,
) -> list[Predicted | CandidateRejected]:
    """Rolls every candidate out.

    Args:
        slots: The candidates.
        standing: The person at the start.
        operator: Who is predicted.
        samples: Sampled postures; 0 gives the central ones alone.
        seed: The same for all, so that candidates share their random numbers.
        sigma: The robot's repeatability.
        method: A method of the model; its own choice if None.

    Returns:
        In the order of the slots, the postures or why there are none.
    """
    out: list[Predicted | CandidateRejected | None] = [None] * len(slots)
    for task in ("pose", "position"):
        chosen = [
            k for k, slot in enumerate(slots) if slot.path.position_only == (task == "position")
        ]
        if chosen:
            group = [slots[k] for k in chosen]
            results = _predict_task(group, standing, operator, samples, seed, sigma, method, task)
            for k, result in zip(chosen, results, strict=True):
                out[k] = result
    return [result for result in out if result is not None]


def _predict_task(
    slots: Sequence[Slot],
    standing: Standing,
    operator: Operator,
    samples: int,
    seed: int,
    sigma: SigmaX,
    method: str | None,
    task: Task,
) -> list[Predicted | CandidateRejected]:
    if task not in operator.content.tasks:
        return [
            _rejected(
                slot,
                Fault(
                    pointer("candidates", slot.index, "orientation_xyzw"),
                    "orientations",
                    "none",
                    "the model was not trained for positions alone.",
                ),
            )
            for slot in slots
        ]
    follower = operator.content.follower(method, task)
    q0 = None if standing.hands is None else standing.q[7:][operator.chain.dof_indices]
    paths: list[LedPath] = []
    faults: dict[int, CandidateRejected] = {}
    for k, slot in enumerate(slots):
        try:
            paths.append(_seen_from_base(slot.path, standing))
        except TrajectoryError as error:
            faults[k] = _explain(slot, error, operator)
    outcomes = iter(
        follower.rollouts(
            paths,
            q0,
            samples,
            np.random.default_rng(seed),
            hand_noise=HandNoise(sigma.position_m, sigma.orientation_rad),
        )
    )
    results: list[Predicted | CandidateRejected] = []
    for k, slot in enumerate(slots):
        if k in faults:
            results.append(faults[k])
            continue
        outcome = next(outcomes)
        if isinstance(outcome, TrajectoryError):
            results.append(_explain(slot, outcome, operator))
        else:
            results.append(_whole_body(slot, standing, operator, outcome))
    return results


def _seen_from_base(path: HandPath, standing: Standing) -> LedPath:
    """Returns the way in the axes of what stays in place, as the predictors know it."""
    seen = standing.footing.pose.inverse() @ path.hands()
    position, rotation = seen.position, seen.rotation
    if len(path.grasps) == 1:
        position, rotation = position[:, 0], rotation[:, 0]
    return LedPath.checked(path.time_s, position, None if path.position_only else rotation)


def _whole_body(slot: Slot, standing: Standing, operator: Operator, rollout: Rollout) -> Predicted:
    places = 7 + operator.chain.dof_indices
    central = np.tile(standing.q, (len(rollout.time_s), 1))
    central[:, places] = rollout.central
    q = np.tile(standing.q, (len(rollout.q), len(rollout.time_s), 1))
    q[..., places] = np.where(rollout.followed[..., None], rollout.q, rollout.central)
    standing.footing.stand(central)
    standing.footing.stand(q)
    strayed = float(np.mean(~rollout.followed)) if rollout.followed.size else 0.0
    return Predicted(slot, q, central, rollout.familiarity, strayed)


def _explain(slot: Slot, error: TrajectoryError, operator: Operator) -> CandidateRejected:
    if isinstance(error, UnreachableTrajectoryError):
        # The point of the prediction's grid, told as the nearest one that was sent.
        when = slot.path.time_s[error.index]
        sent = int(np.argmin(np.abs(slot.sent_s - when)))
        return _rejected(
            slot,
            Fault(
                pointer("candidates", slot.index, "position_m", sent),
                f"a point the {_HAND_WORDS[operator.hand]} can reach with the "
                f"{_BASE_WORDS[operator.base]}",
                f"{error.distance:.3f} m and {error.angle_deg:.1f} deg out of reach",
                f"{_who(error.tip)} cannot get to the point at {when:g} s.",
            ),
        )
    place = pointer("candidates", slot.index)
    return _rejected(slot, Fault(place, "a path a hand can be led along", str(error), str(error)))


def _who(tip: str | None) -> str:
    """Names what is furthest from where it must be: a hand, or a foot that would have to move."""
    if tip is None:
        return "the hand"
    side = "right" if tip.startswith("Right") else "left"
    if "Foot" in tip:
        return f"the {side} foot would have to leave its place, and the hand otherwise"
    return f"the {side} hand"


def _rejected(slot: Slot, fault: Fault) -> CandidateRejected:
    return CandidateRejected(f"Candidate {slot.index}: {fault.detail}", [fault])


def medoid(q: Array) -> int:
    """Returns the sample nearest, in joint angles over time, to all others: a posture that can be.

    Args:
        q: ``(S, T, nq)``.
    """
    angles = q[..., 7:].reshape(len(q), -1)
    gram = angles @ angles.T
    norms = np.diagonal(gram)
    distance = np.sqrt(np.maximum(norms[:, None] + norms - 2 * gram, 0.0))
    return int(np.argmin(distance.sum(axis=1)))


def spread(q: Array, count: int) -> NDArray[np.intp]:
    """Returns a few samples far apart from each other, the medoid first.

    Args:
        q: ``(S, T, nq)``.
        count: How many at most.
    """
    angles = q[..., 7:].reshape(len(q), -1)
    chosen = [medoid(q)]
    nearest = np.linalg.norm(angles - angles[chosen[0]], axis=1)
    while len(chosen) < min(count, len(q)):
        chosen.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, np.linalg.norm(angles - angles[chosen[-1]], axis=1))
    return np.array(chosen, dtype=np.intp)
