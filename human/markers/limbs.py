"""Legs and arms from their bony points: joint centres and segment axes, side by side.

A joint centre is the middle of the two points beside it; where only the outer one is there, the
centre is half a joint's breadth further in, at right angles to the limb.
"""

from dataclasses import dataclass

import numpy as np

from human.markers.landmarks import (
    OUTWARD,
    Landmarks,
    axes_along,
    mean_turn,
    unit,
)
from human.markers.pelvis_chest import Chest, Pelvis
from human.model import Array, IntArray

#: Distance between the centres of a joint's outer and inner marker over stature: chosen here, the
#: mean over people of three laboratories who wore both.
_BREADTH = {"knee": 0.066, "ankle": 0.050, "elbow": 0.043}
#: How an ankle's axis lies: turned outward from the knee's, and steeper than at right angles to the
#: shank (82.7 degrees, Inman 1976); the first chosen here, from the same people.
_ANKLE_TURN_RAD = np.deg2rad(15.0)
_ANKLE_TILT_RAD = np.deg2rad(7.3)
#: Least bend (sine) at which the plane of a limb shows the axis it bends about.
_LEAST_BEND = np.sin(np.deg2rad(20.0))
#: Rounds of finding the plane of a bent leg and the joint centres in it.
_PASSES = 4
#: A foot is flat where heel and toe are this near their lowest, m.
_FLAT_M = 0.015
#: Shoulder centre below the acromion: distance per depth of the chest, angle from the line C7 to
#: breastbone.
_SHOULDER = (0.42, np.deg2rad(-67.0))


@dataclass(frozen=True, slots=True, eq=False)
class Limb:
    """One limb over time, ``n`` frames; NaN where its points are not seen.

    Attributes:
        centers: joint name without side (``Knee``) -> ``(n, 3)`` world, m.
        axes: segment name without side -> ``(n, 3, 3)``.
        notes: what was assumed.
    """

    centers: dict[str, Array]
    axes: dict[str, Array]
    notes: tuple[str, ...]


def measure_leg(landmarks: Landmarks, pelvis: Pelvis, side: str, height_m: float) -> Limb:
    """Measures a leg from the hip down.

    The thigh's y axis is the line between the condyles, or where the inner one is not seen the axis
    the knee bends about, or with a straight knee the pelvis's. The shank's follows the thigh's: no
    turn about the shank is the turn of the recording. The foot is level where it stands flat.
    """
    low, out = side.lower(), OUTWARD[side]
    hip, across = pelvis.hip[side], pelvis.axes[..., 1]
    outer = landmarks.first(f"{low}_knee_lateral", f"{low}_knee_center")[0]
    foot = landmarks.first(f"{low}_ankle_lateral", f"{low}_ankle_center")[0]
    center, end = outer, foot
    # The plane of the bent leg is that of the centres, which it in turn helps to find.
    for _ in range(_PASSES):
        bend = np.cross(unit(center - hip), unit(end - center))
        shown = np.linalg.norm(bend, axis=-1) > _LEAST_BEND
        shown &= np.sum(bend * across, axis=-1) > 0.0
        hint = np.where(shown[:, None], bend, across)
        knee = _hinge(landmarks, f"{low}_knee", hip - outer, -out * hint, height_m)
        thigh = axes_along(hip - knee.center, 2, _prefer(-out * knee.inward, hint), 1)
        forward, left = thigh[..., 0], thigh[..., 1]
        inward = np.cos(_ANKLE_TURN_RAD) * -out * left + np.sin(_ANKLE_TURN_RAD) * forward
        ankle = _hinge(
            landmarks, f"{low}_ankle", knee.center - foot, inward, height_m, _ANKLE_TILT_RAD
        )
        center, end = knee.center, ankle.center
    shank = axes_along(knee.center - ankle.center, 2, thigh[..., 1], 1)
    return Limb(
        {"Hip": hip, "Knee": knee.center, "Ankle": ankle.center},
        {"UpperLeg": thigh, "LowerLeg": shank, "Foot": _foot_axes(landmarks, low, ankle.center)},
        (*knee.notes, *ankle.notes),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Hinge:
    """A joint between two points: its centre and the direction inward ``(n, 3)``, or NaN."""

    center: Array
    inward: Array
    notes: tuple[str, ...] = ()


def _hinge(
    landmarks: Landmarks,
    joint: str,
    to_upper: Array,
    inward: Array,
    height_m: float,
    tilt_rad: float = 0.0,
) -> _Hinge:
    """Finds a joint's centre.

    Args:
        landmarks: the points.
        joint: side and joint, such as ``right_knee``.
        to_upper: ``(n, 3)`` m, from the outer point to the joint above.
        inward: ``(n, 3)`` from the outer point to the inner one, as far as can be told without it.
        height_m: stature.
        tilt_rad: angle by which the joint's axis rises inward.

    Source: where the inner point is not seen, the right angle at the centre between the outer point
    and the joint above is that of Davis et al. 1991 (chord); with a tilted axis it is wider.
    """
    outer, inner = landmarks.of(f"{joint}_lateral"), landmarks.of(f"{joint}_medial")
    if landmarks.has(f"{joint}_lateral", f"{joint}_medial"):
        return _Hinge(0.5 * (outer + inner), inner - outer)
    if landmarks.has(f"{joint}_center"):
        center = landmarks.of(f"{joint}_center")
        note = f"The centre of the {joint.replace('_', ' ')} is taken as the recording has it."
        return _Hinge(center, center - outer, (note,))
    half = 0.5 * _BREADTH[joint.partition("_")[2]] * height_m
    reach = np.linalg.norm(to_upper, axis=-1, keepdims=True)
    # Triangle of outer marker, centre and joint above: its angle at the centre is known.
    wide = 0.5 * np.pi + tilt_rad
    angle = np.pi - wide - np.arcsin(np.minimum(half * np.sin(wide) / np.maximum(reach, half), 1.0))
    axes = axes_along(to_upper, 2, inward, 1)
    way = np.cos(angle) * axes[..., 2] + np.sin(angle) * axes[..., 1]
    note = (
        f"The centre of the {joint.replace('_', ' ')} is taken {1e3 * half:.0f} mm inside its "
        "outer marker: no inner one is seen."
    )
    notes = (note,) if landmarks.has(f"{joint}_lateral") else ()
    return _Hinge(outer + half * way, np.full_like(outer, np.nan), notes)


def _prefer(first: Array, second: Array) -> Array:
    """Returns the first vectors, and the second where those are NaN."""
    return np.where(np.isfinite(first), first, second)


def toe_point(landmarks: Landmarks, low: str) -> Array:
    """Returns the ball of the foot ``(n, 3)``: second head, or the middle of the others."""
    first, second, fifth = (f"{low}_toe_{n}" for n in ("first", "second", "fifth"))
    return landmarks.first(second, (first, fifth), first, fifth)[0]


def _foot_axes(landmarks: Landmarks, low: str, ankle: Array) -> Array:
    heel, toe = landmarks.of(f"{low}_heel"), toe_point(landmarks, low)
    raw = axes_along(toe - heel, 0, ankle - heel, 2)
    up = np.broadcast_to([0.0, 0.0, 1.0], raw.shape[:-1])
    level = axes_along(up, 2, toe - heel, 0)
    return raw @ mean_turn(raw, level, _flat(heel, toe))


def _flat(heel: Array, toe: Array) -> IntArray:
    """Returns the frames in which the foot is flat: heel and toe near their lowest."""
    seen = np.flatnonzero(np.isfinite(heel[:, 2]) & np.isfinite(toe[:, 2]))
    if not seen.size:
        return seen
    low = [np.percentile(point[seen, 2], 5) for point in (heel, toe)]
    flat = (heel[seen, 2] < low[0] + _FLAT_M) & (toe[seen, 2] < low[1] + _FLAT_M)
    return np.asarray(seen[flat])


def measure_arm(landmarks: Landmarks, chest: Chest, side: str, height_m: float) -> Limb:
    """Measures an arm from the shoulder down.

    The shoulder's centre lies below the acromion. The upper arm's z axis points from the inner to
    the outer condyle, or along the axis the elbow bends about, or else the arm's x axis is the
    chest's. The forearm's x axis points to the thumb's side, as the knuckles show it, or the wrist.

    Source: shoulder centre, Reed et al. 1999, as quoted by Dumas et al. 2007.
    """
    low, out = side.lower(), OUTWARD[side]
    shoulder = landmarks.of(f"{low}_shoulder_center")
    if not landmarks.has(f"{low}_shoulder_center"):
        ratio, angle = _SHOULDER
        down = np.cos(angle) * chest.lean + np.sin(angle) * chest.over
        shoulder = landmarks.of(f"{low}_acromion") + ratio * chest.depth_m * down
    outer = landmarks.first(f"{low}_elbow_lateral", f"{low}_elbow_center")[0]
    radial, ulnar = landmarks.of(f"{low}_wrist_radial"), landmarks.of(f"{low}_wrist_ulnar")
    wrist = landmarks.first(
        (f"{low}_wrist_radial", f"{low}_wrist_ulnar"), f"{low}_wrist_center",
        f"{low}_wrist_radial", f"{low}_wrist_ulnar",
    )[0]  # fmt: skip
    # From the T-pose the forearm bends forward: about z on the right, about -z on the left.
    bend = -out * np.cross(unit(outer - shoulder), unit(wrist - outer))
    shown = np.linalg.norm(bend, axis=-1) > _LEAST_BEND
    straight = axes_along(out * (outer - shoulder), 1, chest.axes[..., 0], 0)[..., 2]
    hint = np.where(shown[:, None], bend, straight)
    elbow = _hinge(landmarks, f"{low}_elbow", shoulder - outer, -hint, height_m)
    upper = axes_along(out * (elbow.center - shoulder), 1, _prefer(-elbow.inward, hint), 2)
    second, fifth = landmarks.of(f"{low}_hand_second"), landmarks.of(f"{low}_hand_fifth")
    # The wrist does not turn about the forearm, and the knuckles show the palm better than the
    # two heads at the wrist, of which one lies further back.
    thumbward = _prefer(second - fifth, _prefer(radial - ulnar, upper[..., 0]))
    fore = axes_along(out * (wrist - elbow.center), 1, thumbward, 0)
    palm = landmarks.first((f"{low}_hand_second", f"{low}_hand_fifth"), f"{low}_hand_second")[0]
    hand = axes_along(out * (palm - wrist), 1, _prefer(second - fifth, fore[..., 0]), 0)
    return Limb(
        {"Shoulder": shoulder, "Elbow": elbow.center, "Wrist": wrist},
        {"UpperArm": upper, "ForeArm": fore, "Hand": hand},
        elbow.notes,
    )
