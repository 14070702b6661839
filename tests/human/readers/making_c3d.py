"""Small C3D files with known content."""

from pathlib import Path
from typing import Any

import ezc3d
import numpy as np

RATE, ANALOG_RATE = 100.0, 400.0
FRAMES = 6
NAMES = ["RToe", "LToe", "RHip", "LHip", "Head"]
#: Someone standing, z up, mm.
STANDING = np.array(
    [[100, -100, 0], [100, 100, 0], [0, -150, 900], [0, 150, 900], [20, 0, 1700]], dtype=float
)
#: Corners of two plates, mm, and the wrench that enters at a point of each (N, m, N m).
CORNERS = (
    np.array([[600, 0, 0], [600, -500, 0], [0, -500, 0], [0, 0, 0]], dtype=float),
    np.array([[0, 0, 0], [0, 500, 0], [600, 500, 0], [600, 0, 0]], dtype=float),
)
FORCES = np.array([[10.0, -20.0, 400.0], [-5.0, 15.0, 300.0]])
POINTS = np.array([[0.2, -0.1, 0.0], [0.4, 0.3, 0.0]])
FREE = np.array([3.0, -2.0])


def wrench_in_plate_axes(k: int) -> tuple[np.ndarray, np.ndarray]:
    """What a plate of type 2 reports: force and moment (N mm) about its origin, its own axes.

    The format's axes of a plate: x along the first edge to the middle of corners 1 and 4, y to the
    middle of 1 and 2, z by the right hand, all from the plate's middle.
    """
    corners = CORNERS[k]
    middle = corners.mean(axis=0)
    x = (corners[0] + corners[3]) / 2 - middle
    y = (corners[0] + corners[1]) / 2 - middle
    axes = np.stack([x / np.linalg.norm(x), y / np.linalg.norm(y)])
    axes = np.vstack([axes, np.cross(*axes)])
    arm = 1000.0 * POINTS[k] - middle
    moment = np.add(np.cross(arm, FORCES[k]), [0.0, 0.0, 1000.0 * FREE[k]])
    return axes @ FORCES[k], axes @ moment


def write_c3d(
    path: Path,
    *,
    names: list[str] | None = None,
    position: np.ndarray | None = None,
    units: str = "mm",
    up: str | None = "+Z",
    plates: bool = True,
    plate_type: int = 2,
    events: bool = True,
) -> Path:
    """Writes a file of `FRAMES` frames; NaN in ``position`` marks what was not seen."""
    names = names or NAMES
    made: Any = ezc3d.c3d()
    if position is None:
        position = np.repeat(STANDING[:, None], FRAMES, axis=1)
    points = np.ones((4, *position.shape[:2]))
    points[:3] = np.moveaxis(position, -1, 0)
    made["data"]["points"] = points
    point = made["parameters"]["POINT"]
    point["RATE"]["value"] = [RATE]
    point["LABELS"]["value"] = names
    point["UNITS"]["value"] = [units]
    if up:
        made.add_parameter("POINT", "X_SCREEN", ["+X"])
        made.add_parameter("POINT", "Y_SCREEN", [up])
    if events:
        made.add_parameter("EVENT", "USED", [2])
        made.add_parameter("EVENT", "LABELS", ["Foot Off", "Foot Strike"])
        made.add_parameter("EVENT", "CONTEXTS", ["Left", "Right"])
        made.add_parameter("EVENT", "TIMES", np.array([[1.0, 0.0], [2.5, 0.02]]))
    if plates:
        samples = int(FRAMES * ANALOG_RATE / RATE)
        channels = np.concatenate([np.concatenate(wrench_in_plate_axes(k)) for k in range(2)])
        made["data"]["analogs"] = np.repeat(channels[None, :, None], samples, axis=2)
        analog = made["parameters"]["ANALOG"]
        analog["RATE"]["value"] = [ANALOG_RATE]
        analog["LABELS"]["value"] = [f"{q}{k}" for k in (1, 2) for q in
                                     ("Fx", "Fy", "Fz", "Mx", "My", "Mz")]  # fmt: skip
        analog["UNITS"]["value"] = ["N", "N", "N", "Nmm", "Nmm", "Nmm"] * 2
        plate = made["parameters"]["FORCE_PLATFORM"]
        plate["USED"]["value"] = [2]
        plate["TYPE"]["value"] = [plate_type, plate_type]
        plate["ZERO"]["value"] = [1, 0]
        plate["CORNERS"]["value"] = np.stack([c.T for c in CORNERS], axis=2)
        plate["ORIGIN"]["value"] = np.zeros((3, 2))
        plate["CHANNEL"]["value"] = np.arange(1, 13).reshape(2, 6).T
    made.write(str(path))
    return path
