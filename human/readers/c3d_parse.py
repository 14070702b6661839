"""Parses one C3D file and leaves the content in an npz file; run as a process of its own.

The parser is native code, and a file whose parameters contradict each other can end its process.
So it is another process than the caller's. This file is run by path and imports nothing of ours.
"""

import json
import sys
from typing import Any

import ezc3d
import numpy as np

_GROUPS = ("POINT", "EVENT", "FORCE_PLATFORM")


def parse(path: str) -> dict[str, Any]:
    """Returns arrays by name, and under ``meta`` the rest as JSON.

    The plates are left out, with the reason in ``meta``, where the parser cannot make sense of
    them.
    """
    refused = ""
    try:
        parsed = ezc3d.c3d(path, extract_forceplat_data=True)
    except Exception as problem:
        refused = str(problem)[:200] or type(problem).__name__
        parsed = ezc3d.c3d(path)
    data, header = parsed["data"], parsed["header"]
    plates = [] if refused else data["platform"]
    meta = {
        "point_rate": float(header["points"]["frame_rate"]),
        "first_point": int(header["points"]["first_frame"]),
        "analog_rate": float(header["analogs"]["frame_rate"]),
        "first_analog": int(header["analogs"]["first_frame"]),
        "analogs": int(data["analogs"].shape[1]),
        "plates_refused": refused,
        "plate_units": [[p["unit_force"], p["unit_moment"], p["unit_position"]] for p in plates],
        "parameters": {
            group: {
                name: np.asarray(parameter["value"]).tolist()
                for name, parameter in parsed["parameters"][group].items()
                if name != "__METADATA__"
            }
            for group in _GROUPS
            if group in parsed["parameters"]
        },
    }
    arrays = {"points": data["points"][:3], "residuals": data["meta_points"]["residuals"][0]}
    for key in ("force", "moment", "corners"):
        arrays[key] = np.array([np.asarray(p[key]) for p in plates], dtype=np.float64)
    return {**arrays, "meta": np.array(json.dumps(meta))}


if __name__ == "__main__":
    np.savez(sys.argv[2], **parse(sys.argv[1]))
