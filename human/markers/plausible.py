"""Whether measured markers are those of a person standing up in metres, sides where they belong."""

from collections.abc import Mapping

import numpy as np

from human.markers.landmarks import OUTWARD, SIDES, Landmarks, median
from human.markers.skeleton import Skeleton
from human.model import Array
from human.recording import Finding

#: Distance between the front iliac spines of an adult, m.
_PELVIS_WIDTH_M = (0.14, 0.42)
#: A measured length over the one that goes with the stature: beyond the first pair it is noted,
#: beyond the second it is not that person's.
_USUAL = (0.85, 1.18)
_POSSIBLE = (0.6, 1.6)
_LEG = (0.75, 1.3)
#: Least cosine between a standing person's long axis and the vertical.
_UPRIGHT = 0.5
#: Difference between stated mass and what plates carry that is noted.
_MASS_SHARE = 0.03
#: Joints whose length has no counterpart in stature, or that are told by another finding.
_FREE = ("jL5S1", "jRightC7Shoulder", "jLeftC7Shoulder", "jRightHip", "jLeftHip")


def unit_findings(landmarks: Landmarks, source: str) -> list[Finding]:
    """Finds lengths that are not in metres, by the width of the pelvis."""
    across = landmarks.of("left_asis") - landmarks.of("right_asis")
    width = float(median(np.linalg.norm(across, axis=-1)))
    low, high = _PELVIS_WIDTH_M
    if low <= width <= high:
        return []
    for factor, unit in ((1e-3, "millimetres"), (1e-2, "centimetres"), (1e3, "kilometres")):
        if low <= width * factor <= high:
            hint = f"as if {unit} were taken for metres: state the units when reading."
            break
    else:
        hint = "check the markers of the front iliac spines."
    text = f"The pelvis is {width:.3g} m wide, {hint}"
    return [Finding("units", "error", f"{source}, pelvis", text)]


def posture_findings(landmarks: Landmarks, skeleton: Skeleton, source: str) -> list[Finding]:
    """Finds a wrong vertical axis and exchanged sides."""
    up = _long_axis(landmarks, skeleton)
    if up is None:
        return []
    z = float(median(up)[2])
    if z < _UPRIGHT:
        axis = "xyz"[int(np.argmax(np.abs(median(up))))]
        text = (
            f"The person's long axis is along {axis}, not upright along z: another axis is up, or "
            "they do not stand in this trial. State the vertical when reading, or take another "
            "trial as the static one."
        )
        return [Finding("up", "error", source, text)]
    pelvis_up = skeleton.axes["Pelvis"][..., 2]
    if float(median(np.sum(pelvis_up * up, axis=-1))) < 0.0:
        text = (
            "The pelvis is upside down: the markers of its right and left, or of its front and "
            "back, are exchanged."
        )
        return [Finding("sides", "error", f"{source}, pelvis", text)]
    left = skeleton.axes["Pelvis"][..., 1]
    crossed = []
    for part in ("knee_lateral", "ankle_lateral", "heel", "acromion", "elbow_lateral"):
        apart = landmarks.of(f"left_{part}") - landmarks.of(f"right_{part}")
        reach = float(median(np.sum(apart * left, axis=-1)))
        if np.isfinite(reach) and reach < 0.0:
            crossed.append(part.partition("_")[0])
    found = []
    if crossed:
        text = f"The right and left {', '.join(crossed)} are exchanged, as seen from the pelvis."
        found.append(Finding("sides", "error", source, text))
    for joint in ("knee", "ankle"):
        for side in SIDES:
            low = side.lower()
            across = landmarks.of(f"{low}_{joint}_lateral") - landmarks.of(f"{low}_{joint}_medial")
            reach = OUTWARD[side] * float(median(np.sum(across * left, axis=-1)))
            if np.isfinite(reach) and reach < 0.0:
                text = f"The inner and outer markers of the {low} {joint} are exchanged."
                found.append(Finding("sides", "error", f"{source}, {low} {joint}", text))
    return found


def _long_axis(landmarks: Landmarks, skeleton: Skeleton) -> Array | None:
    """Returns unit vectors ``(n, 3)`` from the feet, or the knees, up to the chest, or the hips."""
    below = landmarks.first(
        ("right_ankle_lateral", "left_ankle_lateral"), ("right_heel", "left_heel"),
        ("right_knee_lateral", "left_knee_lateral"), ("right_asis", "left_asis"),
    )[0]  # fmt: skip
    above = landmarks.first("c7", ("right_acromion", "left_acromion"))[0]
    if not np.any(np.isfinite(above)):
        above = skeleton.origin["Pelvis"]
    axis = above - below
    norm = np.linalg.norm(axis, axis=-1, keepdims=True)
    axis = axis / np.where(norm > 0.0, norm, np.nan)
    return axis if np.any(norm > _PELVIS_WIDTH_M[0]) else None


def length_findings(skeleton: Skeleton, height_m: float, source: str) -> list[Finding]:
    """Finds lengths that are not those of a person of that stature."""
    ratio = {
        joint: float(np.linalg.norm(value) / np.linalg.norm(skeleton.generic[joint]))
        for joint, value in skeleton.offsets.items()
        if joint not in _FREE
    }
    leg = _mean(ratio, ("jRightKnee", "jLeftKnee", "jRightAnkle", "jLeftAnkle"))
    if leg is not None and not _LEG[0] <= leg <= _LEG[1]:
        text = (
            f"The legs are {leg:.2f} times as long as those of a person {height_m:.2f} m tall: "
            "check the height and the units."
        )
        return [Finding("height", "error", f"{source}, legs", text)]
    found = []
    for joint, value in ratio.items():
        low, high = _POSSIBLE
        if not low <= value <= high:
            text = (
                f"The offset of {joint} is {value:.2f} times that of a person {height_m:.2f} m "
                "tall: check the markers about it."
            )
            found.append(Finding("length", "error", f"{source}, {joint}", text))
        elif not _USUAL[0] <= value <= _USUAL[1] and "BallFoot" not in joint:
            text = f"The offset of {joint} is {value:.2f} times that usual at this stature."
            found.append(Finding("length", "note", f"{source}, {joint}", text))
    for right, left in ((j, j.replace("Right", "Left")) for j in ratio if "Right" in j):
        if left in ratio and abs(ratio[right] / ratio[left] - 1.0) > 0.1:
            text = f"{right} and {left} differ by {abs(ratio[right] / ratio[left] - 1.0):.0%}."
            found.append(Finding("symmetry", "note", source, text))
    return found


def mass_findings(mass_kg: float, supported_kg: float | None, source: str) -> list[Finding]:
    """Notes a stated mass that the plates do not carry."""
    if supported_kg is None or abs(supported_kg / mass_kg - 1.0) <= _MASS_SHARE:
        return []
    text = (
        f"The plates carry {supported_kg:.1f} kg, the stated mass is {mass_kg:.1f} kg: the "
        "difference will look like a load in the hands."
    )
    return [Finding("mass", "note", source, text)]


def _mean(ratio: Mapping[str, float], joints: tuple[str, ...]) -> float | None:
    values = [ratio[joint] for joint in joints if joint in ratio]
    return float(np.mean(values)) if values else None
