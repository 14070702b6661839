"""What an estimate comes to, read from its time series column by column."""

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.estimates.feet import FeetOfTake
from app.estimates.series import Series
from app.fitting import BodyInMotion
from app.plain import plain
from estimation import HandState, PayloadHold, RunSummary

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_DIGITS = 3
#: Texts that differ in their times alone, at most.
_MOST_ALIKE = 6


def summarised(path: Path, run: RunSummary, body: BodyInMotion, feet: FeetOfTake) -> dict[str, Any]:
    """Returns the summary of an estimate, ready for JSON.

    Args:
        path: The time series.
        run: What the run came to.
        body: The person and how well they meet the recording.
        feet: Plates and feet.
    """
    series = Series(path)
    time_s = series["time_s"]
    balance = series.words("balance")
    # The greatest of all is no place for frames that were carried over a gap.
    firm = series["doubtful"] == 0.0
    summary = {
        "duration_s": _round(time_s[-1] - time_s[0]),
        "frames": run.frames,
        "rate_hz": body.rate_hz,
        "left_out": dict(run.left_out),
        "bands": run.bands,
        "payload": _payload(series, time_s, firm, run),
        "holds": [_hold(hold) for hold in run.holds],
        "hands": _stretches(
            time_s,
            {
                "right": series.words("right_hand_state"),
                "left": series.words("left_hand_state"),
                "together": series.words("hands_state"),
            },
        ),
        "balance": {
            "share": {
                str(state): _round(np.mean(balance == state)) for state in np.unique(balance)
            },
            "stretches": _stretches(time_s, {"state": balance}),
        },
        "efforts": _efforts(series, time_s, firm, run),
        "low_back": _low_back(series, time_s, firm),
        "feet": feet.record(),
        "fit": plain(body.fit),
        "assumed": _gathered([*body.notes, *feet.assumed, *run.assumed]),
        "findings": _gathered([*body.findings, *feet.findings, *run.findings]),
        "columns": list(series.names),
    }
    return summary


def _payload(series: Series, time_s: Array, firm: Mask, run: RunSummary) -> dict[str, Any]:
    found: dict[str, Any] = {
        "definition": run.definition,
        "free_hands": list(run.free_hands),
        "known_share": 0.0,
        "max_kg": None,
        "plates_minus_model_kg": None
        if run.plates_minus_model_kg is None
        else _band(*run.plates_minus_model_kg),
    }
    middle = series["payload_p50_kg"]
    known = np.isfinite(middle)
    found["known_share"] = _round(np.mean(known))
    if np.any(known):
        k = _greatest(middle, firm)
        low, high = (series[f"payload_{q}_kg"][k] for q in ("p05", "p95"))
        found["max_kg"] = {**_band(low, middle[k], high), "at_s": _round(time_s[k])}
    return found


def _hold(hold: PayloadHold) -> dict[str, Any]:
    by_definition = {
        mass.definition: _band(*mass.quantiles_kg)
        if mass.quantiles_kg is not None
        else {"p05": None, "p50": _round(mass.mass_kg), "p95": None}
        for mass in hold.masses
    }
    split = hold.split_kg
    return {
        "start_s": _round(hold.start_s),
        "end_s": _round(hold.end_s),
        "state": HandState(hold.state).name.lower(),
        "hands": list(hold.hands),
        "mass_kg": by_definition[hold.masses[0].definition],
        "by_definition_kg": by_definition,
        "split_kg": None
        if split is None
        else {hand: _round(part) for hand, part in zip(hold.hands, split, strict=True)},
    }


def _efforts(series: Series, time_s: Array, firm: Mask, run: RunSummary) -> list[dict[str, Any]]:
    found = []
    for joint in run.joint_names:
        middle = series[f"{joint}_effort_p50_nm"]
        known = np.isfinite(middle)
        if not np.any(known):
            continue
        k = _greatest(middle, firm)
        low, high = (series[f"{joint}_effort_{q}_nm"][k] for q in ("p05", "p95"))
        found.append(
            {
                "joint": joint,
                "peak_nm": _band(low, middle[k], high),
                "at_s": _round(time_s[k]),
                "median_nm": _round(np.median(middle[known])),
                "p90_nm": _round(np.percentile(middle[known], 90)),
                "known_share": _round(run.joint_known_share.get(joint, np.mean(known))),
            }
        )
    return sorted(found, key=lambda one: -one["peak_nm"]["p50"])


def _low_back(series: Series, time_s: Array, firm: Mask) -> dict[str, Any] | None:
    """Returns the greatest force and moment at L5S1; None where it was never known."""
    found: dict[str, Any] = {}
    for quantity, unit in (("force", "n"), ("moment", "nm")):
        vectors = series.vectors(f"l5s1_{quantity}", unit)
        size = np.linalg.norm(vectors, axis=-1)
        known = np.isfinite(size)
        if not np.any(known):
            return None
        k = _greatest(size, firm)
        sd = None
        if f"l5s1_{quantity}_sd_x_{unit}" in series.names:
            spread = series.vectors(f"l5s1_{quantity}_sd", unit)[k]
            # Along the vector itself, to first order and without the axes' covariances.
            sd = _round(np.linalg.norm(spread * vectors[k]) / max(size[k], 1e-9))
        found[f"peak_{quantity}_{unit}"] = _round(size[k])
        found[f"peak_{quantity}_sd_{unit}"] = sd
        found[f"peak_{quantity}_at_s"] = _round(time_s[k])
        found[f"median_{quantity}_{unit}"] = _round(np.median(size[known]))
    found["known_share"] = _round(np.mean(known))
    return found


def _greatest(values: Array, firm: Mask) -> int:
    """Returns where the greatest known value is, on firm frames where there are any."""
    sure = np.where(firm, values, np.nan)
    return int(np.nanargmax(sure if np.any(np.isfinite(sure)) else values))


def _stretches(time_s: Array, words: dict[str, NDArray[np.str_]]) -> list[dict[str, Any]]:
    """Returns the stretches in which no word changes, in order."""
    changes = np.zeros(len(time_s), dtype=np.bool_)
    changes[0] = True
    for column in words.values():
        changes[1:] |= column[1:] != column[:-1]
    starts = np.flatnonzero(changes)
    ends = np.append(starts[1:], len(time_s)) - 1
    return [
        {
            "start_s": _round(time_s[start]),
            "end_s": _round(time_s[end]),
            **{name: str(column[start]) for name, column in words.items()},
        }
        for start, end in zip(starts, ends, strict=True)
    ]


def _band(low: float, middle: float, high: float) -> dict[str, float]:
    return {"p05": _round(low), "p50": _round(middle), "p95": _round(high)}


def _round(value: Any) -> float:
    return round(float(value), _DIGITS) + 0.0


def _gathered(texts: list[str]) -> list[str]:
    """Returns each text once; of those that a long recording says window after window, the first.

    Texts that start alike, up to a colon and but for numbers, are told apart by times alone.
    """
    alike: dict[str, list[str]] = {}
    for text in dict.fromkeys(texts):
        alike.setdefault(re.sub(r"[\d.]+", "", text.partition(":")[0]), []).append(text)
    kept: list[str] = []
    for group in alike.values():
        kept += group[:_MOST_ALIKE]
        if len(group) > _MOST_ALIKE:
            kept.append(f"{len(group) - _MOST_ALIKE} more like this: {group[_MOST_ALIKE]}")
    return kept
