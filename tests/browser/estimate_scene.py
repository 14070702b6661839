"""A made-up estimate in the service's own schema, for the page alone.

Simple functions of time again: a box in both hands (only the sum can be told), then a tool in the
right hand alone, a stretch in which nothing can be told and one carried over a gap.
"""

from typing import Any

import numpy as np

from human import DOF_NAMES
from tests.browser import scene

RATE_HZ = 20.0
DURATION_S = 8.0
BOX_KG, TOOL_KG = 5.0, 2.0
BOX_S, TOOL_S = (1.0, 3.0), (4.0, 5.0)
#: When a foot stood where nothing measures, and when markers were missing.
UNKNOWN_S, DOUBTFUL_S = (6.0, 7.0), (3.2, 3.6)
#: Greatest effort of each joint, N m.
EFFORTS = {
    "jL5S1": 80.0,
    "jL4L3": 76.0,
    "jL1T12": 70.0,
    "jRightHip": 60.0,
    "jLeftKnee": 50.0,
    "jRightElbow": 12.0,
}
ASSUMED = [
    "body mass: the model's 72.00 kg; a kilogram too much there is one too little in the hands",
    "joint accelerations: derived from the motion, sd 0.5 rad/s^2",
]
FINDINGS = ["left foot stands where nothing measures: 20 frames (6.00 to 6.95 s)"]
PROBLEM: dict[str, Any] = {
    "type": "/problems/unreadable",
    "title": "The recording cannot be used",
    "status": 422,
    "detail": "squat_grf.mot: expected a column 'time', got 'zeit'; name it in the columns file.",
}
FILES = [
    {"role": "motion", "name": "lifting.bvh", "sha256": "00"},
    {"role": "grf", "name": "plates.mot", "sha256": "01"},
]


def times() -> np.ndarray:
    """Returns the frames' times, s."""
    return np.arange(0.0, DURATION_S + 1e-9, 1.0 / RATE_HZ)


def _within(span: tuple[float, float]) -> np.ndarray:
    return (times() >= span[0]) & (times() < span[1])


def _load() -> np.ndarray:
    return BOX_KG * _within(BOX_S) + TOOL_KG * _within(TOOL_S)


def series() -> dict[str, list[Any]]:
    """Returns every column; None where nothing can be told."""
    t, load = times(), _load()
    unknown = _within(UNKNOWN_S)
    columns: dict[str, np.ndarray] = {
        "payload_p05_kg": load - 0.5,
        "payload_p50_kg": load,
        "payload_p95_kg": load + 0.5,
    }
    size = 0.4 + 0.6 * load / BOX_KG
    for joint, most in EFFORTS.items():
        for quantile, share in (("p05", 0.8), ("p50", 1.0), ("p95", 1.2)):
            columns[f"{joint}_effort_{quantile}_nm"] = share * most * size
    for axis, share in zip("xyz", (0.6, 0.0, 0.8), strict=True):
        columns[f"l5s1_force_{axis}_n"] = 500.0 * share * size
        columns[f"l5s1_force_sd_{axis}_n"] = np.full(len(t), 10.0)
        columns[f"l5s1_moment_{axis}_nm"] = 80.0 * share * size
        columns[f"l5s1_moment_sd_{axis}_nm"] = np.full(len(t), 4.0)
    columns["left_foot_force_z_n"] = 350.0 + 5.0 * load
    told: dict[str, list[Any]] = {
        name: [
            None if hidden else float(value) for value, hidden in zip(each, unknown, strict=True)
        ]
        for name, each in columns.items()
    }
    for side, mass in (("right", TOOL_KG), ("left", 0.0)):
        one = _within(TOOL_S)
        told[f"{side}_hand_payload_kg"] = [mass if known else None for known in one]
    told["right_foot_force_z_n"] = (350.0 + 5.0 * load).tolist()
    told["doubtful"] = [bool(value) for value in _within(DOUBTFUL_S)]
    body = scene.joint_positions(0.6, 0.5)
    rows = np.linspace(0, scene.FRAMES - 1, len(t)).round().astype(int)
    base = (("position_z_m", scene.PELVIS_HEIGHT_M), ("orientation_w", 1.0))
    for name in ("position_x_m", "position_y_m", *(f"orientation_{axis}" for axis in "xyz")):
        told[f"pelvis_{name}"] = [0.0] * len(t)
    told |= {f"pelvis_{name}": [value] * len(t) for name, value in base}
    told |= {f"{dof}_angle_rad": body[rows, k].tolist() for k, dof in enumerate(DOF_NAMES)}
    return {"time_s": t.tolist(), **told}


def part(columns: list[str]) -> dict[str, Any]:
    """Returns some columns, as the service does."""
    every = series()
    chosen = {name: every[name] for name in ["time_s", *columns]}
    return {"columns": chosen, "units": dict.fromkeys(chosen, "")}


def _band(middle: float, half: float) -> dict[str, float]:
    return {"p05": middle - half, "p50": middle, "p95": middle + half}


def _hold(
    span: tuple[float, float], state: str, mass: float, split: dict[str, float] | None = None
) -> dict[str, Any]:
    band = _band(mass, 0.4)
    return {
        "start_s": span[0],
        "end_s": span[1],
        "state": state,
        "hands": ["right", "left"],
        "mass_kg": band,
        "by_definition_kg": {
            "inertial": band,
            "vertical": _band(mass - 0.1, 0.4),
            "norm": _band(mass + 0.1, 0.4),
        },
        "split_kg": split,
    }


def _hands(start: float, end: float, right: str, left: str, together: str) -> dict[str, Any]:
    return {"start_s": start, "end_s": end, "right": right, "left": left, "together": together}


def summary(request: dict[str, Any]) -> dict[str, Any]:
    """Returns the summary; the settings asked for stand in it."""
    options = {"tare_s": None, "hands": "auto", "sex": "unknown", "mass_kg": None, **request}
    recording = options.pop("recording_id", scene.RECORDING["id"])
    return {
        "id": "e-demo",
        "recording_id": recording,
        "source": scene.RECORDING["name"],
        "created": "2026-11-22T01:00:00Z",
        "options": options,
        "person": {
            "height_m": request.get("height_m", 1.76),
            "mass_kg": 72.0,
            "mass_from": "given",
            "sex": "unknown",
            "model_mass_kg": 72.0,
        },
        "duration_s": DURATION_S,
        "frames": len(times()),
        "rate_hz": RATE_HZ,
        "left_out": {},
        "bands": "noise_and_model",
        "payload": {
            "definition": "inertial",
            "free_hands": ["right", "left"],
            "known_share": 0.875,
            "max_kg": {**_band(BOX_KG, 0.5), "at_s": 1.5},
            "plates_minus_model_kg": _band(1.2, 1.5),
        },
        "holds": [
            _hold((0.0, 1.0), "free", 0.0),
            _hold(BOX_S, "loaded", BOX_KG),
            _hold(TOOL_S, "loaded", TOOL_KG, {"right": TOOL_KG, "left": 0.0}),
        ],
        "hands": [
            _hands(0.0, 0.95, "free", "free", "free"),
            _hands(1.0, 2.95, "unknown", "unknown", "loaded"),
            _hands(3.0, 3.95, "free", "free", "free"),
            _hands(4.0, 4.95, "loaded", "free", "loaded"),
            _hands(5.0, 5.95, "free", "free", "free"),
            _hands(6.0, 6.95, "unknown", "unknown", "unknown"),
            _hands(7.0, DURATION_S, "free", "free", "free"),
        ],
        "balance": {
            "share": {"known": 0.875, "unknown": 0.125},
            "stretches": [{"start_s": 0.0, "end_s": DURATION_S, "state": "known"}],
        },
        "efforts": [
            {
                "joint": joint,
                "peak_nm": _band(most, 0.2 * most),
                "at_s": 1.5,
                "median_nm": 0.5 * most,
                "p90_nm": 0.9 * most,
                "known_share": 0.875,
            }
            for joint, most in EFFORTS.items()
        ],
        "low_back": {
            "peak_force_n": 500.0,
            "peak_force_sd_n": 10.0,
            "peak_force_at_s": 1.5,
            "peak_moment_nm": 80.0,
            "peak_moment_sd_nm": 4.0,
            "peak_moment_at_s": 1.5,
            "known_share": 0.875,
        },
        "feet": {
            "plates_from": "plates.mot",
            "clock": {"offset_s": 0.0, "sd_s": None, "from": "one file, one clock"},
            "stances": [
                {"plate": "1", "foot": "right", "start_s": 0.0, "end_s": 8.0, "given": False},
                {"plate": "2", "foot": "left", "start_s": 0.0, "end_s": 6.0, "given": False},
            ],
        },
        "fit": {},
        "assumed": ASSUMED,
        "findings": FINDINGS,
        "files": FILES,
        "software": "ergocast",
        "columns": list(series()),
        "series_url": "/v1/estimates/e-demo/series",
        "model_urdf_url": "/v1/models/m-demo/urdf",
    }
