"""Which way is up in a file of markers: as asked, as stated, or as a standing person shows."""

import numpy as np
from numpy.typing import NDArray

from human.readers.axes import axis_name
from human.readers.errors import AmbiguousRecordingError
from human.recording import Finding

Array = NDArray[np.float64]

_LETTERS = "xyz"
#: A standing person is this much taller than wide or deep.
_TALLER = 1.5
#: The lowest marker of a person on the floor is this near the origin's height, m.
_FLOOR_M = (-0.15, 0.35)


def up_axis(name: str, place: str) -> Array:
    """Returns the unit vector of an axis by its name: ``x``, ``-y``, ``+Z``.

    Raises:
        AmbiguousRecordingError: the name is of no axis.
    """
    letter = name.strip().lower().lstrip("+-")
    if len(letter) != 1 or letter not in _LETTERS:
        raise AmbiguousRecordingError(
            place, "x, y or z, with a sign if negative", repr(name), "up", "Pass up='z'."
        )
    axis = np.zeros(3)
    axis[_LETTERS.index(letter)] = -1.0 if name.strip().startswith("-") else 1.0
    return axis


def z_up(up: Array) -> Array:
    """Returns the matrix ``(3, 3)`` from file axes to z up; x stays forward where it is level.

    z up is left as it is; y up (x forward, z to the right) becomes ``(x, -z, y)``.
    """
    ahead = np.array([0.0, 1.0, 0.0]) if abs(up[0]) > 0.5 else np.array([1.0, 0.0, 0.0])
    return np.stack([ahead, np.cross(up, ahead), up])


def resolve_up(
    position: Array,
    valid: NDArray[np.bool_],
    *,
    requested: str | None,
    stated: str | None,
    convention: str | None,
    place: str,
) -> tuple[Array, str, list[Finding]]:
    """Returns the map to z-up axes and why.

    Args:
        position: ``(frames, markers, 3)`` file axes, m.
        valid: ``(frames, markers)``.
        requested: axis named by the caller; wins.
        stated: axis named in the file; next.
        convention: axis usual for the format, taken with a warning when nothing else tells.
        place: for messages.

    Returns:
        Matrix ``(3, 3)``, the sentence that says why, and findings.

    Raises:
        AmbiguousRecordingError: nothing tells.
    """
    if requested is not None:
        return z_up(up_axis(requested, "argument up")), f"up is {requested} as requested", []
    shown = _standing(position, valid)
    if stated is not None:
        up = up_axis(stated, place)
        findings = []
        if shown is not None and float(shown @ up) < 0.5:
            findings.append(
                Finding(
                    "up", "warning", place,
                    f"The file states that up is {axis_name(up)}, but the markers stand along "
                    f"{axis_name(shown)}.",
                )
            )  # fmt: skip
        return z_up(up), f"up is {axis_name(up)} as the file states", findings
    if shown is not None:
        return z_up(shown), f"up is {axis_name(shown)}: along it the markers stand", []
    if convention is not None:
        said = Finding(
            "up", "warning", place,
            f"The markers do not show which way is up; {convention} was taken, as usual for the "
            "format.",
        )  # fmt: skip
        return z_up(up_axis(convention, place)), f"up is {convention} by convention", [said]
    raise AmbiguousRecordingError(
        place, "a stated vertical axis, or markers of a standing person", "neither", "up",
        "Pass up='z' or up='y'.",
    )  # fmt: skip


def _standing(position: Array, valid: NDArray[np.bool_]) -> Array | None:
    """Returns the axis along which the markers are tallest, feet near height zero."""
    full = np.flatnonzero(np.sum(valid, axis=1) >= max(4, int(0.7 * valid.shape[1])))
    if not full.size:
        return None
    seen = np.where(valid[full, :, None], position[full], np.nan)
    low, high = np.nanmin(seen, axis=1), np.nanmax(seen, axis=1)
    extent = np.median(high - low, axis=0)
    k = int(np.argmax(extent))
    if extent[k] < 0.5 or extent[k] < _TALLER * np.sort(extent)[-2]:
        return None
    for sign, floor in ((1.0, np.median(low[:, k])), (-1.0, -np.median(high[:, k]))):
        if _FLOOR_M[0] <= floor <= _FLOOR_M[1]:
            axis = np.zeros(3)
            axis[k] = sign
            return axis
    return None
