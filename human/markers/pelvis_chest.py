"""Pelvis and chest from their bony points: axes, hips, lumbar and cervical joint centres."""

from dataclasses import dataclass

import numpy as np

from human.markers.landmarks import (
    SIDES,
    Landmarks,
    axes_along,
    from_axes,
    in_axes,
    median,
    unit,
)
from human.markers.marker_set import PELVIS_DIP_DEG
from human.model import Array, Sex, Subject

#: Angle by which the plane of the iliac spines dips forward in a standing person, and by which the
#: line from C7 to the upper end of the breastbone does; the second chosen here, after standing
#: people whose chest has all four points.
_PELVIS_DIP_RAD = np.deg2rad(PELVIS_DIP_DEG)
_CHEST_DIP_RAD = np.deg2rad(26.0)
#: Distance from C7 to the breastbone's upper end over stature, where one of them is not seen: the
#: mean of the same people's.
_CHEST_DEPTH = 0.085
#: Harrington et al. 2007: hip centre in the plane of the iliac spines from the middle of the front
#: ones: forward per pelvis depth, up and outward per pelvis width, and a constant (m).
_HARRINGTON = {"x": (-0.24, -0.0099), "z": (-0.30, -0.0109), "y": (0.33, 0.0073)}
#: Dumas and Wojtusch 2018: lumbar joint centre from the middle of the front spines, per pelvis
#: width: forward, up.
_LUMBAR = {"female": (-0.340, 0.049), "male": (-0.335, -0.032)}
#: Reed et al. 1999, as in Dumas et al. 2007: cervical joint centre from C7, per distance to the
#: breastbone's upper end; angle above that line.
_CERVICAL = {"female": (0.53, np.deg2rad(14.0)), "male": (0.55, np.deg2rad(8.0))}


@dataclass(frozen=True, slots=True, eq=False)
class Pelvis:
    """The pelvis over time, ``n`` frames.

    Attributes:
        axes: ``(n, 3, 3)`` of the model's pelvis segment: upright when the person stands.
        origin: ``(n, 3)`` middle between the hips: the segment's origin.
        hip: side -> ``(n, 3)``.
        hip_local: side -> ``(3,)`` from the origin, pelvis axes.
        lumbar_local: ``(3,)`` L5S1 from the origin, pelvis axes.
        width_m: between the front spines.
        notes: where the hips are from.
    """

    axes: Array
    origin: Array
    hip: dict[str, Array]
    hip_local: dict[str, Array]
    lumbar_local: Array
    width_m: float
    notes: tuple[str, ...]


def measure_pelvis(landmarks: Landmarks, sex: Sex, dip_deg: float = PELVIS_DIP_DEG) -> Pelvis:
    """Measures the pelvis.

    Args:
        landmarks: with both front spines and the back ones or their middle.
        dip_deg: see `MarkerSet`.
        sex: for the lumbar joint; the mean of both where unknown.

    Source: axes after Wu et al. 2002 (ISB), turned back by the dip of a standing pelvis; hips as
    the recording has them, else Harrington et al. 2007; L5S1 Dumas and Wojtusch 2018.
    """
    front = landmarks.middle("right_asis", "left_asis")
    back, _ = landmarks.first(("right_psis", "left_psis"), "sacrum")
    across = landmarks.of("left_asis") - landmarks.of("right_asis")
    plane = axes_along(across, 1, front - back, 0) @ _about_y(_PELVIS_DIP_RAD - np.deg2rad(dip_deg))
    width = float(median(np.linalg.norm(across, axis=-1)))
    depth = float(median(np.linalg.norm(front - back, axis=-1)))
    hip_in_plane, regression = {}, []
    for side in SIDES:
        role = f"{side.lower()}_hip_center"
        seen = median(in_axes(plane, landmarks.of(role) - front))
        if not np.all(np.isfinite(seen)):
            seen = harrington_hip(width, depth, side)
            regression.append(side.lower())
        hip_in_plane[side] = seen
    forward, up = _of_sex(_LUMBAR, sex)
    lumbar = np.array([forward * width, 0.0, up * width])
    middle = 0.5 * (hip_in_plane["Right"] + hip_in_plane["Left"])
    dip = _about_y(-_PELVIS_DIP_RAD)
    axes = plane @ dip
    origin = front + from_axes(plane, middle)
    local = {side: dip.T @ (hip_in_plane[side] - middle) for side in SIDES}
    notes = (
        f"Hip centres by regression from the iliac spines ({' and '.join(regression)})."
        if regression
        else "Hip centres as the recording has them, at their median place in the pelvis.",
    )
    return Pelvis(
        axes=axes,
        origin=origin,
        hip={side: origin + from_axes(axes, local[side]) for side in SIDES},
        hip_local=local,
        lumbar_local=dip.T @ (lumbar - middle),
        width_m=width,
        notes=notes,
    )


def harrington_hip(width_m: float, depth_m: float, side: str) -> Array:
    """Returns the hip centre ``(3,)`` from the middle of the front spines.

    Args:
        width_m: between the front spines.
        depth_m: between the middles of front and back spines.
        side: ``Right`` or ``Left``.

    Returns:
        m; x forward in the plane of the spines, y left, z up from that plane.

    Source: Harrington et al., J. Biomechanics 40(3):595-602, 2007, regression without leg length.
    """
    (kx, cx), (ky, cy), (kz, cz) = (_HARRINGTON[axis] for axis in "xyz")
    outward = ky * width_m + cy
    return np.array(
        [kx * depth_m + cx, -outward if side == "Right" else outward, kz * width_m + cz]
    )


@dataclass(frozen=True, slots=True, eq=False)
class Chest:
    """The chest over time, ``n`` frames.

    Attributes:
        axes: ``(n, 3, 3)`` of the model's T8 segment: upright when the person stands.
        cervical: ``(n, 3)`` centre of the joint between C7 and T1.
        lean: ``(n, 3)`` unit, from C7 to the breastbone's upper end.
        over: ``(n, 3)`` unit, at right angles to it, upward.
        depth_m: from C7 to the breastbone's upper end.
        notes: what was assumed.
    """

    axes: Array
    cervical: Array
    lean: Array
    over: Array
    depth_m: float
    notes: tuple[str, ...] = ()


def measure_chest(landmarks: Landmarks, pelvis: Pelvis, subject: Subject) -> Chest | None:
    """Measures the chest; None if neither C7 and the breastbone nor both shoulders are seen.

    Source: axes after Wu et al. 2005 (ISB) where the lower points are seen; else from the line C7
    to breastbone, its usual dip and the line of the shoulders; C7/T1 Reed et al. 1999. Derived
    here: without that line, the chest stands on L5S1 and has the shoulders in its middle.
    """
    notch = landmarks.first("jugular_notch", ("right_sternal", "left_sternal"))[0]
    c7 = landmarks.of("c7")
    shoulders = landmarks.of("left_acromion") - landmarks.of("right_acromion")
    depth = _CHEST_DEPTH * subject.height_m
    notes: tuple[str, ...] = ()
    if np.any(np.isfinite(notch - c7)):
        ahead = notch - c7
        depth = float(median(np.linalg.norm(ahead, axis=-1)))
        if landmarks.has("c7", "t8", "xiphoid"):
            rise = 0.5 * (notch + c7) - landmarks.middle("t8", "xiphoid")
            # All four points lie in the middle plane, whatever the arms do.
            axes = axes_along(rise, 2, ahead, 0)
        else:
            hips = landmarks.of("left_asis") - landmarks.of("right_asis")
            across = shoulders if np.any(np.isfinite(shoulders)) else hips
            axes = axes_along(ahead, 0, across, 1) @ _about_y(-_CHEST_DIP_RAD)
    elif np.any(np.isfinite(shoulders)):
        middle = landmarks.middle("right_acromion", "left_acromion")
        lumbar = pelvis.origin + from_axes(pelvis.axes, pelvis.lumbar_local)
        axes = axes_along(middle - lumbar, 2, shoulders, 1)
        ahead = depth * (axes @ _about_y(_CHEST_DIP_RAD))[..., 0]
        if np.any(np.isfinite(notch)):
            c7 = notch - ahead
        elif not np.any(np.isfinite(c7)):
            c7 = middle - 0.5 * ahead
        notes = (
            "The chest's lean is that of the line from L5S1 to the shoulders: C7 and the "
            "breastbone are not both seen.",
        )
    else:
        return None
    ratio, angle = _of_sex(_CERVICAL, subject.sex)
    lean = unit(ahead)
    over = axes_along(lean, 0, axes[..., 2], 2)[..., 2]
    cervical = c7 + ratio * depth * (np.cos(angle) * lean + np.sin(angle) * over)
    return Chest(axes, cervical, lean, over, depth, notes)


def _of_sex(table: dict[str, tuple[float, float]], sex: Sex) -> tuple[float, float]:
    if sex == "unknown":
        first, second = table["female"], table["male"]
        return 0.5 * (first[0] + second[0]), 0.5 * (first[1] + second[1])
    return table[sex]


def _about_y(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
