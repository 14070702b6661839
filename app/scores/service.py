"""Scores recordings and keeps each answer by its content."""

import hashlib
import json
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.assessments.schemas import Assumption
from app.estimates.service import Estimates
from app.files import check_id, dump_json, write_bytes
from app.fitting import body_in_motion
from app.plain import plain, rounded
from app.problems import Fault, InvalidRequest, NotFound, pointer
from app.recordings.service import Recordings
from app.scores.schemas import ScoreRequest
from app.scoring import SIDES, BodyScores, score_body, tasks_of, worst_of_both
from app.takes import Take
from app.version import VERSION
from ergonomics import (
    ScoringRules,
    Side,
    WorstMoment,
    back_angle,
    summarise,
    time_share,
    with_effects,
)
from human import HumanModel, Motion, Subject, SubjectError, forward_kinematics, to_urdf
from human.marker_recording import MarkerRecording
from human.recording import Recording

#: Changes whenever the same request would be answered otherwise than before.
_REVISION = 2
#: Most entries of the time series in an answer, and of the postures to play back.
_SERIES = 6000
_PLAYED = 1500
#: Body mass index of a person whose mass is not given, kg/m^2; scores do not depend on it.
_ASSUMED_BMI = 23.0
_MOMENTS = 5
_LEVELS = (3, 5, 7)

Array = NDArray[np.float64]


class Scores:
    """One folder per answer: the scores and the person's URDF."""

    def __init__(self, folder: Path, recordings: Recordings, estimates: Estimates) -> None:
        """Keeps answers under ``folder``."""
        self._folder = folder
        self._recordings = recordings
        self._estimates = estimates
        self._storing = threading.Lock()

    def answer(self, request: ScoreRequest) -> bytes:
        """Returns the scores of a recording, or of the one that an estimate is of.

        Raises:
            NotFound: There is no such recording or estimate.
            InvalidRequest: The person cannot be, or the recording was refused.
        """
        estimate: dict[str, Any] | None = None
        if request.estimate_id is not None:
            estimate = json.loads(self._estimates.content(request.estimate_id))
        recording_id = str((estimate or request.model_dump())["recording_id"])
        take = self._recordings.take(recording_id)
        added = [f"{role} {part.path.name}" for role, part in take.parts().items()]
        key = "\n".join([VERSION, str(_REVISION), request.model_dump_json(), *added])
        identifier = f"scr_{hashlib.sha256(key.encode()).hexdigest()}"
        path = self._folder / identifier / "score.json"
        if path.is_file():
            return path.read_bytes()
        if estimate is None:
            result, model = score_take(take, request)
        else:
            known, assumed = with_estimate(request, estimate)
            result, model = score_take(take, known)
            result["assumed"] = [*assumed, *result["assumed"]]
            result["articular_stress"] = estimate["efforts"]
        answer = {
            "id": identifier,
            "recording_id": recording_id,
            "estimate_id": request.estimate_id,
            **result,
            "model_urdf_url": f"/v1/scores/{identifier}/urdf",
        }
        content = dump_json(answer)
        with self._storing:
            write_bytes(path.parent / "body.urdf", to_urdf(model).encode())
            write_bytes(path, content)
        return content

    def content(self, identifier: str) -> bytes:
        """Returns stored scores.

        Raises:
            NotFound: There are none by that id.
        """
        return self._read(identifier, "score.json")

    def urdf(self, identifier: str) -> bytes:
        """Returns the recorded person's body as URDF.

        Raises:
            NotFound: There are no scores by that id.
        """
        return self._read(identifier, "body.urdf")

    def _read(self, identifier: str, name: str) -> bytes:
        path = self._folder / check_id(identifier, "score") / name
        if not path.is_file():
            raise NotFound(f"There is no score {identifier!r}.")
        return path.read_bytes()


def with_estimate(
    request: ScoreRequest, estimate: Mapping[str, Any]
) -> tuple[ScoreRequest, list[dict[str, Any]]]:
    """Fills in what an estimate knows: the person, and the load where the request has none.

    Args:
        request: As it came.
        estimate: The summary.

    Returns:
        The request with those, and what is assumed about the load.
    """
    person = estimate["person"]
    known: dict[str, Any] = {
        key: person[key] for key in ("height_m", "mass_kg", "sex") if getattr(request, key) is None
    }
    assumed = []
    if request.hand_load_kg is None and estimate["holds"]:
        loaded = [hold["mass_kg"] for hold in estimate["holds"] if hold["state"] == "loaded"]
        most = max(loaded, key=lambda mass: mass["p50"], default=None)
        known["hand_load_kg"] = 0.0 if most is None else max(0.0, most["p50"])
        span = ""
        if most is not None and most["p05"] is not None:
            span = f"{most['p05']:.1f} to {most['p95']:.1f} kg"
        assumed.append(
            Assumption(
                what="load in the hands",
                value=f"{known['hand_load_kg']:.1f} kg at every instant, the most that the "
                "estimate found held",
                range=span,
                effect="points for the load",
            ).model_dump()
        )
    return request.model_copy(update=known), assumed


def score_take(take: Take, request: ScoreRequest) -> tuple[dict[str, Any], HumanModel]:
    """Reads, fits and scores a recording.

    Args:
        take: The motion and what goes with it.
        request: The person, the load and the conventions.

    Returns:
        The answer, but for its id and addresses, and the person's model.

    Raises:
        InvalidRequest: The person cannot be.
        Unreadable: The recording cannot be read, or was refused.
        HumanError: It cannot be fitted.
    """
    assumed: list[Assumption] = []

    def who(recording: Recording | MarkerRecording) -> Subject:
        subject, said = _subject(recording, request)
        assumed.extend(said)
        return subject

    body = body_in_motion(take, who, accept=request.accept)
    model, motion = body.model, body.whole()
    rules = ScoringRules(request.profile, request.ties, request.neutral_tolerance_deg)
    unmeasured = body.unobserved
    poses = forward_kinematics(model, motion.q)
    scores = score_body(
        model, poses, tasks_of(None, request.hand_load_kg), rules, unmeasured=unmeasured
    )
    back = back_angle(model, poses).chain_sum_deg
    time_s = np.asarray(motion.time_s)
    stride = -(-len(time_s) // _SERIES)
    kept = slice(None, None, stride)
    worst = worst_of_both(scores, time_s, count=_MOMENTS, apart_s=1.0, rules=rules)
    result = {
        "time_s": rounded(time_s[kept]),
        "every_frames": stride,
        "sides": {
            side: {
                "rula": scores.rula[side][kept].tolist(),
                "reba": scores.reba[side][kept].tolist(),
            }
            for side in SIDES
        },
        "rula": scores.worst_rula[kept].tolist(),
        "reba": scores.worst_reba[kept].tolist(),
        "rula_least": _least(scores.rula_least)[kept].tolist(),
        "reba_least": _least(scores.reba_least)[kept].tolist(),
        "unmeasured": sorted(unmeasured),
        "back_angle_deg": rounded(back[kept], 3),
        "summary": {
            "rula": _summary(scores.worst_rula, time_s),
            "reba": _summary(scores.worst_reba, time_s),
        },
        "worst": [_moment(one) for one in worst],
        "assumed": [
            one.model_dump() for one in (*assumed, *_assumed(scores, unmeasured, request, rules))
        ],
        "rules": {
            "profile": request.profile,
            "ties": request.ties,
            "neutral_tolerance_deg": request.neutral_tolerance_deg,
            "side": "the worse of both, instant by instant",
        },
        "fit": plain({**body.fit, "notes": body.notes}),
        "posture": _posture(motion),
    }
    return result, model


def _subject(
    recording: Recording | MarkerRecording, request: ScoreRequest
) -> tuple[Subject, list[Assumption]]:
    assumed = []
    height = request.height_m
    if height is None:
        if isinstance(recording, MarkerRecording):
            fault = Fault(
                pointer("height_m"), "stature in m", "nothing", "markers do not tell how tall"
            )
            raise InvalidRequest("The person's height is needed to fit them to markers.", [fault])
        stated = recording.subject.stated_height_m
        height = stated if stated is not None else recording.subject.skeleton_height_m
        where = "as the file states it" if stated is not None else "that of the file's skeleton"
        assumed.append(
            Assumption(
                what="stature",
                value=f"{height:.2f} m, {where}",
                range="give height_m",
                effect="none on the scores: lengths come from the recording",
            )
        )
    mass = request.mass_kg
    if mass is None:
        mass = float(np.clip(_ASSUMED_BMI * height**2, 30.0, 250.0))
        assumed.append(
            Assumption(
                what="body mass",
                value=f"{mass:.0f} kg (body mass index {_ASSUMED_BMI:g})",
                range="give mass_kg",
                effect="none on the scores",
            )
        )
    try:
        return Subject(height, mass, request.sex or "unknown"), assumed
    except SubjectError as error:
        field = "height_m" if error.quantity.startswith("height") else "mass_kg"
        fault = Fault(pointer(field), error.accepted, repr(error.value), "of no adult")
        raise InvalidRequest(str(error), [fault]) from error


def _least(by_side: Mapping[Side, NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Returns the worse side of the least scores."""
    return np.maximum(by_side["left"], by_side["right"])


def _summary(finals: NDArray[np.uint8], time_s: Array) -> dict[str, Any]:
    values = finals.astype(float)
    summary = summarise(values, time_s, levels=_LEVELS)
    duration = float(time_s[-1] - time_s[0])
    return {
        "median": summary.median,
        "p90": summary.p90,
        "max": int(summary.max),
        "time_at_or_above": {
            str(level): rounded(float(time_share(values >= level, time_s)) * duration)
            for level in _LEVELS
        },
        "time_of_max_s": rounded(summary.time_of_max_s),
    }


def _moment(moment: WorstMoment) -> dict[str, Any]:
    return {
        "time_s": rounded(moment.time_s),
        "side": moment.side,
        "body_part": moment.body_part,
        "score": moment.score,
        "reasons": [moment.reason, *_points(moment.reasons)],
    }


def _points(reasons: Mapping[str, str]) -> list[str]:
    """Returns the reasons of single body parts, in words, those with points first."""
    parts = ("upper_arm", "lower_arm", "wrist", "wrist_twist", "neck", "trunk", "legs")
    said = [f"{part.replace('_', ' ')} {reasons[part]}" for part in parts if part in reasons]
    return sorted(said, key=lambda text: ": " in text and " 1: " in text)


def _assumed(
    scores: BodyScores, unmeasured: frozenset[str], request: ScoreRequest, rules: ScoringRules
) -> Sequence[Assumption]:
    side: Side = "right"
    task = tasks_of(None, request.hand_load_kg)[side]
    found = [
        Assumption(what=one.what, value=one.value, range=one.range, effect=one.effect)
        for one in with_effects(
            task.assumptions(), scores.rula_inputs[side], scores.reba_inputs[side], rules
        )
    ]
    if request.hand_load_kg is not None:
        found.append(
            Assumption(
                what="share of the load by each hand",
                value="half each",
                range="0 to 1",
                effect="points for the load on one arm",
            )
        )
    if unmeasured:
        low = _least(scores.rula_least)
        found.append(
            Assumption(
                what="segments that were not measured",
                value=f"{', '.join(sorted(unmeasured))}: scored at their worst",
                range="at their best to at their worst",
                effect=f"RULA mean {low.mean():.1f} to {scores.worst_rula.mean():.1f}",
            )
        )
    return found


def _posture(motion: Motion) -> dict[str, Any]:
    kept = slice(None, None, -(-len(motion) // _PLAYED))
    q = motion.q[kept]
    return {
        "time_s": rounded(motion.time_s[kept]),
        "joint_names": list(motion.model_dof_names),
        "joint_position": rounded(q[:, 7:], 5),
        "samples": [],
        "base": {
            "position_m": rounded(q[:, :3], 5),
            "orientation_xyzw": rounded(q[:, 3:7]),
        },
        "effort_p50_nm": {},
        "effort_scale_nm": {},
        "target": {"position_m": []},
    }
