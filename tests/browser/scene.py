"""A made-up assessment and recording in the service's own schema, for the page alone.

The numbers are simple functions of time, chosen so that a test can say what the page must show:
a clear winner, a tie, an unfamiliar candidate and a faulty one. Only the body is real: the
service's own model, so that the page's kinematics are held against the service's.
"""

import functools
import math
from typing import Any

import numpy as np

from human import (
    DOF_NAMES,
    SEGMENTS,
    HumanModel,
    Subject,
    forward_kinematics,
    generate_model,
    to_urdf,
)

FRAMES = 41
DURATION_S = 2.0
SAMPLES = 4
#: Joints whose effort is given, from the hand to the low back.
CHAIN = (
    "jRightWrist",
    "jRightElbow",
    "jRightShoulder",
    "jRightC7Shoulder",
    "jT9T8",
    "jL1T12",
    "jL4L3",
    "jL5S1",
)

PELVIS_HEIGHT_M = 0.97

#: id, trunk lean (rad), arm raise (rad), load of the low back (N m), mean RULA, rank, p_best, ties.
CANDIDATES: tuple[tuple[str, float, float, float, float, int | None, float | None], ...] = (
    ("overhead-far", 0.15, 1.9, 96.0, 5.8, 3, 0.04),
    ("chest-high", 0.12, 0.9, 41.0, 3.2, 1, 0.78),
    ("low-side", 1.0, 0.5, 121.0, 5.1, 4, 0.0),
    ("close-in", 0.3, 0.8, 58.0, 3.6, 2, 0.18),
    ("behind-the-post", 0.0, 0.0, 0.0, 0.0, None, None),
)


@functools.cache
def model() -> HumanModel:
    """Returns the person, as the service would generate her."""
    subject = MODEL["subject"]
    return generate_model(Subject(subject["height_m"], subject["mass_kg"], subject["sex"]))


def urdf() -> str:
    """Returns the person as URDF."""
    return to_urdf(model())


def _times() -> np.ndarray:
    return np.linspace(0.0, DURATION_S, FRAMES)


def _bell() -> np.ndarray:
    """Rises from 0 to 1 at half time and falls again."""
    return np.sin(np.pi * _times() / DURATION_S) ** 2


def joint_positions(lean: float, lift: float, wobble: float = 0.0) -> np.ndarray:
    """Returns angles, ``(FRAMES, 66)`` in rad, of a person who leans and lifts the right arm."""
    bell = _bell() * (1.0 + wobble)
    at = {name: index for index, name in enumerate(DOF_NAMES)}
    q = np.zeros((FRAMES, len(DOF_NAMES)))
    for joint in ("jL5S1", "jL4L3", "jL1T12"):
        q[:, at[f"{joint}_roty"]] = lean * bell / 3.0
    q[:, at["jRightShoulder_rotx"]] = 1.35 - lift * bell
    q[:, at["jRightShoulder_rotz"]] = 0.25 + 0.9 * bell + wobble
    q[:, at["jRightElbow_rotz"]] = 1.3 - 0.5 * bell
    q[:, at["jLeftShoulder_rotx"]] = -1.35
    q[:, at["jLeftElbow_rotz"]] = -0.3
    for side in ("Right", "Left"):
        q[:, at[f"j{side}Hip_roty"]] = -0.12
        q[:, at[f"j{side}Knee_roty"]] = 0.2
        q[:, at[f"j{side}Ankle_roty"]] = -0.08
    return q


def hand_path(joint_position: np.ndarray) -> np.ndarray:
    """Returns the right wrist's place in the world, ``(FRAMES, 3)`` in m."""
    base = np.tile([0.0, 0.0, PELVIS_HEIGHT_M, 0.0, 0.0, 0.0, 1.0], (FRAMES, 1))
    poses = forward_kinematics(model(), np.hstack([base, joint_position]))
    return poses.position[:, SEGMENTS.index("RightHand")]


def efforts(low_back_nm: float) -> dict[str, np.ndarray]:
    """Returns the median effort of each joint over time, in N m: smaller towards the hand."""
    share = {joint: 0.05 + 0.95 * (index / 7) ** 1.4 for index, joint in enumerate(CHAIN)}
    return {joint: low_back_nm * share[joint] * (0.25 + 0.75 * _bell()) for joint in CHAIN}


def _pmf(expected: np.ndarray, scores: int, spread: float) -> np.ndarray:
    grid = np.arange(1, scores + 1)
    weights = np.exp(-0.5 * ((grid - expected[:, None]) / spread) ** 2)
    return weights / weights.sum(axis=1, keepdims=True)


def _course(expected: np.ndarray, scores: int, spread: float) -> dict[str, Any]:
    pmf = _pmf(expected, scores, spread)
    cumulative = np.cumsum(pmf, axis=1)
    grid = np.arange(1, scores + 1)
    return {
        "time_s": _times().tolist(),
        "pmf": pmf.tolist(),
        "expected": (pmf @ grid).tolist(),
        "p05": (1.0 + (cumulative < 0.05).sum(axis=1)).tolist(),
        "p95": (1.0 + (cumulative < 0.95).sum(axis=1)).tolist(),
        "p_ge_5": pmf[:, 4:].sum(axis=1).tolist(),
    }


def _band(middle: np.ndarray, share: float = 0.12) -> dict[str, Any]:
    return {
        "p05": (middle * (1 - share)).tolist(),
        "p50": middle.tolist(),
        "p95": (middle * (1 + share)).tolist(),
    }


def _moment(score: float, time_s: float, part: str, angle: float) -> dict[str, Any]:
    return {
        "time_s": time_s,
        "side": "right",
        "body_part": part,
        "reason": f"RULA {score:.0f} (look into it): {part} bent {math.degrees(angle):.0f} deg",
        "score": score,
    }


def _candidate(row: tuple[Any, ...]) -> dict[str, Any]:
    name, lean, lift, low_back, mean_rula, rank, p_best = row
    if rank is None:
        empty = dict.fromkeys(
            (
                *("rank", "p_best", "cost", "rula", "reba", "back_angle_deg", "effort_nm"),
                *("worst", "out_of_distribution", "baseline"),
            )
        )
        return {
            "id": name,
            **empty,
            "tied_with": [],
            "moments": [],
            "assumed": [],
            "problem": {
                "type": "/problems/unreachable",
                "title": "Out of reach",
                "status": 422,
                "detail": "At 1.20 s the hand would have to be 0.31 m beyond the arm's reach.",
                "errors": [],
            },
        }
    bell = _bell()
    rula = _course(mean_rula - 0.8 + 1.6 * bell, 7, 0.7)
    reba = _course(2.0 + 1.3 * mean_rula * (0.4 + 0.6 * bell), 15, 1.0)
    effort = efforts(low_back)
    parts = [
        ("rula_mean", mean_rula, "score", 0.6 / 6.0, 1.0, "mean"),
        ("back_angle_mean", math.degrees(lean) * 0.5, "deg", 0.1 / 60.0, 0.0, "mean"),
        ("effort_mean", low_back / 200.0, "share of reference", 0.3, 0.0, "mean"),
    ]
    total = sum(weight * (value - zero) for _, value, _, weight, zero, _ in parts)
    return {
        "id": name,
        "rank": rank,
        "p_best": p_best,
        "tied_with": {"overhead-far": ["low-side"], "low-side": ["overhead-far"]}.get(name, []),
        "cost": {
            "total": total,
            "parts": [
                {
                    "name": part,
                    "value": value,
                    "unit": unit,
                    "weight": weight,
                    "contribution": weight * (value - zero),
                    "aggregation": how,
                    "direction": "lower is better",
                }
                for part, value, unit, weight, zero, how in parts
            ],
        },
        "rula": rula,
        "reba": reba,
        "back_angle_deg": {"time_s": rula["time_s"], **_band(math.degrees(lean) * bell + 3.0)},
        "effort_nm": {joint: _band(values) for joint, values in effort.items()},
        "worst": {
            **_moment(mean_rula + 0.8, 1.0, "right upper arm", lift),
            "rula": mean_rula + 0.8,
        },
        "moments": [
            _moment(mean_rula + 0.8, 1.0, "right upper arm", lift),
            _moment(mean_rula + 0.3, 0.75, "trunk", 0.7 * lean),
            _moment(mean_rula, 1.6, "right wrist", 0.37),
        ],
        "assumed": [
            {
                "what": "wrist_twist",
                "value": "mid range",
                "range": ["mid range", "end of range"],
                "effect": "RULA up to 1 higher",
            },
            {
                "what": "left arm",
                "value": "stays at the start posture",
                "range": "whatever it does",
                "effect": "not in the effort; RULA of the right side only",
            },
            {
                "what": "legs",
                "value": "both feet loaded",
                "range": ["both feet loaded", "one foot loaded"],
                "effect": "RULA 1 higher, REBA 1 higher",
            },
        ],
        "out_of_distribution": {
            "flag": name == "overhead-far",
            "familiarity_min": 0.04 if name == "overhead-far" else 0.71,
            "time_s": 1.0,
        },
        "baseline": {
            "cov-ik": {"rula_expected_mean": mean_rula + 0.3, "cost_total": total * 1.06},
            "minimum-norm": {
                "rula_expected_mean": mean_rula + 0.9,
                "cost_total": 0.2 if name == "close-in" else total * 1.3,
            },
        },
        "problem": None,
    }


def assessment() -> dict[str, Any]:
    """Returns the assessment."""
    return {
        "id": "a-demo",
        "name": "Handing over a 6 kg box",
        "model_id": "m-demo",
        "created": "2026-11-21T23:10:00Z",
        "seed": 7,
        "samples": 64,
        "methods": ["mi-nsgp", "cov-ik", "minimum-norm"],
        "cost_definition": {},
        "assumed": [],
        "candidates": [_candidate(row) for row in CANDIDATES],
    }


def posture(candidate: str) -> dict[str, Any]:
    """Returns the posture of a candidate for play-back."""
    row = next(row for row in CANDIDATES if row[0] == candidate)
    q = joint_positions(row[1], row[2])
    scale = max(row[3] for row in CANDIDATES)
    return {
        "time_s": _times().tolist(),
        "joint_names": list(DOF_NAMES),
        "joint_position": q.tolist(),
        "samples": [
            joint_positions(row[1], row[2], wobble).tolist()
            for wobble in np.linspace(-0.25, 0.25, SAMPLES)
        ],
        "base": {
            "position_m": [[0.0, 0.0, PELVIS_HEIGHT_M]] * FRAMES,
            "orientation_xyzw": [[0.0, 0.0, 0.0, 1.0]] * FRAMES,
        },
        "effort_p50_nm": {joint: values.tolist() for joint, values in efforts(row[3]).items()},
        "effort_scale_nm": {joint: float(values.max()) for joint, values in efforts(scale).items()},
        "target": {"position_m": hand_path(q).tolist()},
    }


MODEL: dict[str, Any] = {
    "id": "m-demo",
    "name": "Demo operator",
    "subject": {"height_m": 1.76, "mass_kg": 74.0, "sex": "female"},
    "hand": "right",
    "method": "mi-nsgp",
    "created": "2026-11-21T23:00:00Z",
    "metrics": {
        "scores": [
            {"method": "mi-nsgp", "rollout_rmse_deg": 1.64, "coverage90_rollout": 0.89},
            {"method": "minimum-norm", "rollout_rmse_deg": 4.02, "coverage90_rollout": 0.97},
        ]
    },
}
RECORDING: dict[str, Any] = {
    "id": "r-demo",
    "name": "lifting.bvh",
    "format": "BVH",
    "inspection": {},
}


def score(request: dict[str, Any]) -> dict[str, Any]:
    """Returns the score of the recording; a load in the hand raises it by one."""
    bell = _bell()
    extra = 1 if request.get("hand_load_kg", 0) > 2 else 0
    right = np.minimum(7, np.round(2 + 4 * bell).astype(int) + extra)
    left = np.full(FRAMES, 3)
    worst = np.maximum(left, right)
    reba = np.round(2 + 7 * bell).astype(int)
    step = DURATION_S / (FRAMES - 1)
    body = posture("low-side")
    return {
        "id": "s-demo",
        "recording_id": request["recording_id"],
        "time_s": _times().tolist(),
        "sides": {
            "left": {"rula": left.tolist(), "reba": reba.tolist()},
            "right": {"rula": right.tolist(), "reba": reba.tolist()},
        },
        "rula": worst.tolist(),
        "reba": reba.tolist(),
        "back_angle_deg": (57.0 * bell).tolist(),
        "summary": {
            score: {
                "median": float(np.median(values)),
                "p90": float(np.percentile(values, 90)),
                "max": int(values.max()),
                "time_at_or_above": {
                    str(level): float(step * (values >= level).sum()) for level in (3, 5, 7)
                },
                "time_of_max_s": 1.0,
            }
            for score, values in (("rula", worst), ("reba", reba))
        },
        "worst": [
            {
                "time_s": 1.0,
                "side": "right",
                "score": int(worst.max()),
                "reasons": ["trunk bent 57°", "upper arm raised"],
            },
            {"time_s": 0.5, "side": "right", "score": 4, "reasons": ["trunk bent 28°"]},
        ],
        "assumed": [
            {
                "what": "hand_load_kg",
                "value": request.get("hand_load_kg", 0),
                "range": [0, 10],
                "effect": "RULA up to 2 higher",
            }
        ],
        "model_urdf_url": "/v1/models/m-demo/urdf",
        "posture": {key: body[key] for key in ("time_s", "joint_names", "joint_position", "base")},
    }
