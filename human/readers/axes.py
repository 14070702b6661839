"""Units and axes from the evidence in a skeleton: resolved when clear, asked for when not."""

import numpy as np
from numpy.typing import NDArray

from human.readers.errors import AmbiguousRecordingError, MalformedRecordingError

Array = NDArray[np.float64]

#: Metres per file unit. ``cmu`` is the CMU data base's: bone lengths there are inches times 0.45.
UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "cmu": 0.0254 / 0.45}
#: Statures taken for a person's. No two units of the table put the same skeleton inside.
STATURE_M = (1.2, 2.3)
_AXIS_NAMES = ("x", "y", "z")
_CLEAR_COSINE = 0.9
_STANDING_COSINE = 0.5


def axis_name(axis: Array) -> str:
    """``+y`` for ``(0, 1, 0)``."""
    k = int(np.argmax(np.abs(axis)))
    return ("+" if axis[k] > 0 else "-") + _AXIS_NAMES[k]


def nearest_axis(direction: Array, at_least: float = _CLEAR_COSINE) -> Array | None:
    """Returns the signed coordinate axis along a direction ``(3,)``, None when it is oblique."""
    norm = float(np.linalg.norm(direction))
    if norm == 0.0:
        return None
    k = int(np.argmax(np.abs(direction)))
    if abs(direction[k]) < at_least * norm:
        return None
    axis = np.zeros(3)
    axis[k] = np.sign(direction[k])
    return axis


def body_axes(head: Array, feet: Array, left: Array, place: str) -> Array:
    """Returns the matrix that maps the rest skeleton's file axes to x forward, y left, z up.

    Args:
        head: ``(3,)`` head in the rest skeleton.
        feet: ``(3,)`` middle of the feet.
        left: ``(3,)`` from the right side of the body to the left.
        place: for messages.

    Raises:
        MalformedRecordingError: the rest skeleton does not stand upright along axes of the file.
    """
    up = nearest_axis(head - feet)
    side = nearest_axis(left)
    if up is None or side is None or abs(float(up @ side)) > 0.5:
        raise MalformedRecordingError(
            place, "a rest skeleton standing along the file's axes, arms and hips to the sides",
            f"head minus feet {np.round(head - feet, 3).tolist()}, "
            f"right to left {np.round(left, 3).tolist()}",
            "Export with a T-pose or N-pose as rest pose.",
        )  # fmt: skip
    return np.stack([np.cross(side, up), side, up])


def world_axes(
    trunk_directions: Array, body: Array, forward: Array, requested_up: str | None, place: str
) -> tuple[Array, str]:
    """Returns the matrix that maps the file's world to z up, and the sentence that says why.

    The heading is not touched: the map is a signed permutation of axes. The file's forward axis of
    the rest skeleton becomes x; where the recorded person stands along another axis than the rest
    skeleton, the horizontal axis nearest to the pelvis's first heading does.

    Args:
        trunk_directions: ``(frames, 3)`` unit vectors from feet to head, file world axes.
        body: ``(3, 3)`` result of `body_axes`.
        forward: ``(3,)`` forward direction of the pelvis in the first frame, file world axes.
        requested_up: ``x``, ``-y`` … from the caller, or None.
        place: for messages.

    Raises:
        AmbiguousRecordingError: the frames do not tell which way is up.
    """
    rest_up = body[2]
    agreement = float(np.median(trunk_directions @ rest_up))
    if requested_up is not None:
        up = _parse_axis(requested_up)
        why = f"up is {axis_name(up)} as requested"
    elif agreement >= _STANDING_COSINE:
        up = rest_up
        why = (
            f"up is {axis_name(up)}: rest skeleton and recorded frames agree "
            f"(median cosine {agreement:.2f})"
        )
    else:
        other = nearest_axis(np.median(trunk_directions, axis=0), 0.8)
        if other is None or abs(float(other @ rest_up)) > 0.5:
            raise AmbiguousRecordingError(
                place, "frames that show which way is up",
                f"a rest skeleton along {axis_name(rest_up)} and frames at a median cosine of "
                f"{agreement:.2f} to it", "up", "Pass up='y' or up='z'.",
            )  # fmt: skip
        up = other
        why = (
            f"up is {axis_name(up)}: so stand the recorded frames; "
            f"the rest skeleton stands along {axis_name(rest_up)}"
        )
    if abs(float(up @ rest_up)) > 0.5:
        ahead = body[0]
    else:
        level = forward - up * float(forward @ up)
        k = int(np.argmax(np.abs(level)))
        ahead = np.zeros(3)
        ahead[k] = np.sign(level[k])
    return np.stack([ahead, np.cross(up, ahead), up]), why


def _parse_axis(name: str) -> Array:
    axis = np.zeros(3)
    letter = name.strip().lower().lstrip("+-")
    if letter not in _AXIS_NAMES:
        raise AmbiguousRecordingError(
            "argument up", "x, y or z, with a sign if negative", repr(name), "up", "Pass up='y'."
        )
    axis[_AXIS_NAMES.index(letter)] = -1.0 if name.strip().startswith("-") else 1.0
    return axis


def metres_per_unit(height: float, units: str | None, style: str, place: str) -> tuple[float, str]:
    """Returns the length of a file unit in metres, and the sentence that says why.

    Args:
        height: stature of the skeleton in file units.
        units: a key of `UNITS_M` from the caller, or None to decide by stature.
        style: spelling of the skeleton; the CMU unit is considered for CMU skeletons alone.
        place: for messages.

    Raises:
        AmbiguousRecordingError: no unit, or an unknown one, makes the skeleton a person.
    """
    if units is not None:
        if units not in UNITS_M:
            raise AmbiguousRecordingError(
                "argument units",
                f"one of {', '.join(UNITS_M)}",
                repr(units),
                "units",
                "Pass units='cm'.",
            )
        return UNITS_M[
            units
        ], f"lengths in {units} as requested: skeleton {height * UNITS_M[units]:.3f} m tall"
    fits = [
        unit
        for unit, metres in UNITS_M.items()
        if STATURE_M[0] <= height * metres <= STATURE_M[1]
        and (unit != "cmu" or "mocap.cs.cmu" in style)
    ]
    if len(fits) != 1:
        tried = ", ".join(f"{unit}: {height * metres:.3g} m" for unit, metres in UNITS_M.items())
        raise AmbiguousRecordingError(
            place, f"a skeleton {STATURE_M[0]}-{STATURE_M[1]} m tall in one unit",
            f"one {height:.4g} units tall ({tried})", "units",
            "Pass units='cm' or another of these.",
        )  # fmt: skip
    metres = UNITS_M[fits[0]]
    return metres, f"lengths from {fits[0]} to m: the skeleton is then {height * metres:.3f} m tall"
