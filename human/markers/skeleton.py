"""A person's skeleton from bony points: joint offsets for the model, and where each segment is.

Every joint offset is a median over frames, so that a moving trial may stand in for a still one.
Parts that no marker shows keep the model's own proportions; of a limb seen on one side only, the
other takes the mirrored lengths.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from human.generate import generate_model
from human.markers.landmarks import (
    OUTWARD,
    SIDES,
    Landmarks,
    axes_along,
    from_axes,
    in_axes,
    mean_turn,
    median,
    share_turn,
)
from human.markers.limbs import Limb, measure_arm, measure_leg, toe_point
from human.markers.marker_set import PELVIS_DIP_DEG
from human.markers.pelvis_chest import Chest, Pelvis, measure_chest, measure_pelvis
from human.model import Array, Subject
from human.names import mirrored

#: Segments from the lumbar joint to C7/T1 with the joint at each one's upper end.
_SPINE = (("L5", "jL4L3"), ("L3", "jL1T12"), ("T12", "jT9T8"), ("T8", "jT1C7"))


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """What was measured; ``n`` frames.

    Attributes:
        offsets: joint -> ``(3,)`` m in the parent's axes, of the joints that were measured.
        generic: joint -> the same by stature alone, of all joints.
        axes: segment -> ``(n, 3, 3)`` in world, of the segments whose axes the points show.
        origin: segment -> ``(n, 3)`` its proximal joint, world.
        pelvis_width_m: between the front iliac spines.
        notes: what was assumed.
    """

    offsets: Mapping[str, Array]
    generic: Mapping[str, Array]
    axes: Mapping[str, Array]
    origin: Mapping[str, Array]
    pelvis_width_m: float
    notes: tuple[str, ...]


def measure_skeleton(
    landmarks: Landmarks, subject: Subject, pelvis_dip_deg: float = PELVIS_DIP_DEG
) -> Skeleton:
    """Measures the joints of a person.

    Args:
        landmarks: their bony points; the pelvis's must be seen in every frame.
        subject: stature and sex, for what the points do not show.
        pelvis_dip_deg: see `MarkerSet`.
    """
    model = generate_model(subject)
    generic = dict(zip(model.joint_names, model.offsets, strict=True))
    offsets: dict[str, Array] = {}
    pelvis = measure_pelvis(landmarks, subject.sex, pelvis_dip_deg)
    axes, origin = {"Pelvis": pelvis.axes}, {"Pelvis": pelvis.origin}
    notes = list(pelvis.notes)
    offsets["jL5S1"] = pelvis.lumbar_local
    for side in SIDES:
        offsets[f"j{side}Hip"] = pelvis.hip_local[side]
        leg = measure_leg(landmarks, pelvis, side, subject.height_m)
        _take_limb(leg, side, ("UpperLeg", "Hip"), ("LowerLeg", "Knee"), axes, origin)
        _take_limb(leg, side, ("Foot", "Ankle"), None, axes, origin)
        _length(leg, "Hip", "Knee", f"j{side}Knee", np.array([0.0, 0.0, -1.0]), offsets)
        _length(leg, "Knee", "Ankle", f"j{side}Ankle", np.array([0.0, 0.0, -1.0]), offsets)
        ball = median(
            in_axes(leg.axes["Foot"], toe_point(landmarks, side.lower()) - leg.centers["Ankle"])
        )
        ball[2] = generic[f"j{side}BallFoot"][2]
        offsets[f"j{side}BallFoot"] = ball
        # The toes are taken as straight, on the whole.
        axes[f"{side}Toe"] = leg.axes["Foot"]
        origin[f"{side}Toe"] = leg.centers["Ankle"] + from_axes(leg.axes["Foot"], ball)
        notes += leg.notes
    chest = measure_chest(landmarks, pelvis, subject)
    if chest is not None:
        notes += chest.notes
        _measure_spine(pelvis, chest, generic, offsets, axes, origin)
        for side in SIDES:
            arm = measure_arm(landmarks, chest, side, subject.height_m)
            _measure_girdle(arm, side, generic, offsets, axes, origin)
            _take_limb(arm, side, ("UpperArm", "Shoulder"), ("ForeArm", "Elbow"), axes, origin)
            _take_limb(arm, side, ("Hand", "Wrist"), None, axes, origin)
            outward = np.array([0.0, OUTWARD[side], 0.0])
            _length(arm, "Shoulder", "Elbow", f"j{side}Elbow", outward, offsets)
            _length(arm, "Elbow", "Wrist", f"j{side}Wrist", outward, offsets)
            notes += arm.notes
        _measure_head(landmarks, chest, generic["jC1Head"], axes, origin)
    measured = {name: value for name, value in offsets.items() if np.all(np.isfinite(value))}
    for joint in generic.keys() - measured.keys():
        if mirrored(joint) in measured:
            measured[joint] = measured[mirrored(joint)] * [1.0, -1.0, 1.0]
    return Skeleton(
        offsets=measured,
        generic=generic,
        axes={name: value for name, value in axes.items() if _seen(value)},
        origin=origin,
        pelvis_width_m=pelvis.width_m,
        notes=tuple(notes),
    )


def _take_limb(
    limb: Limb,
    side: str,
    first: tuple[str, str],
    second: tuple[str, str] | None,
    axes: dict[str, Array],
    origin: dict[str, Array],
) -> None:
    for segment, joint in (first, *((second,) if second else ())):
        axes[f"{side}{segment}"] = limb.axes[segment]
        origin[f"{side}{segment}"] = limb.centers[joint]


def _length(
    limb: Limb, start: str, end: str, joint: str, way: Array, offsets: dict[str, Array]
) -> None:
    span = np.linalg.norm(limb.centers[end] - limb.centers[start], axis=-1)
    offsets[joint] = way * float(median(span))


def _measure_spine(
    pelvis: Pelvis,
    chest: Chest,
    generic: Mapping[str, Array],
    offsets: dict[str, Array],
    axes: dict[str, Array],
    origin: dict[str, Array],
) -> None:
    """Stretches the spine to reach from L5S1 to C7/T1, its four joints sharing the turn equally."""
    turned = [share_turn(pelvis.axes, chest.axes, part / 4.0) for part in (1, 2, 3)]
    steps = [
        from_axes(rotation, generic[joint])
        for rotation, (_, joint) in zip((*turned, chest.axes), _SPINE, strict=True)
    ]
    base = pelvis.origin + from_axes(pelvis.axes, pelvis.lumbar_local)
    reach = np.linalg.norm(chest.cervical - base, axis=-1)
    stretch = float(median(reach / np.linalg.norm(np.sum(steps, axis=0), axis=-1)))
    for (segment, joint), rotation, step in zip(_SPINE, (*turned, chest.axes), steps, strict=True):
        offsets[joint] = stretch * generic[joint]
        axes[segment], origin[segment] = rotation, base
        base = base + stretch * step
    origin["T8"] = chest.cervical - from_axes(chest.axes, offsets["jT1C7"])


def _measure_girdle(
    arm: Limb,
    side: str,
    generic: Mapping[str, Array],
    offsets: dict[str, Array],
    axes: dict[str, Array],
    origin: dict[str, Array],
) -> None:
    """Puts the girdle's inner end at the height of the shoulder; it points to the shoulder."""
    chest_axes, chest_origin = axes["T8"], origin["T8"]
    shoulder = median(in_axes(chest_axes, arm.centers["Shoulder"] - chest_origin))
    if not np.all(np.isfinite(shoulder)):
        return
    inner = np.array([0.0, generic[f"j{side}C7Shoulder"][1], shoulder[2]])
    offsets[f"j{side}C7Shoulder"] = inner
    offsets[f"j{side}Shoulder"] = shoulder - inner
    name = f"{side}Shoulder"
    origin[name] = chest_origin + from_axes(chest_axes, inner)
    # The least turn from the chest's axes that points the girdle at the shoulder of each frame.
    rest = from_axes(chest_axes, shoulder - inner)
    now = arm.centers["Shoulder"] - origin[name]
    across = chest_axes[..., 0]
    axes[name] = (
        axes_along(now, 1, across, 0)
        @ np.swapaxes(axes_along(rest, 1, across, 0), 1, 2)
        @ chest_axes
    )


def _measure_head(
    landmarks: Landmarks,
    chest: Chest,
    neck: Array,
    axes: dict[str, Array],
    origin: dict[str, Array],
) -> None:
    """Takes the head as level, on the whole, with the chest: no marker shows its own level."""
    front = landmarks.middle("right_head_front", "left_head_front")
    back = landmarks.middle("right_head_back", "left_head_back")
    left = landmarks.middle("left_head_front", "left_head_back")
    right = landmarks.middle("right_head_front", "right_head_back")
    raw = axes_along(left - right, 1, front - back, 0)
    if not _seen(raw):
        across = landmarks.of("left_head_side") - landmarks.of("right_head_side")
        top = landmarks.of("head_top") - landmarks.middle("right_head_side", "left_head_side")
        raw = axes_along(across, 1, top, 2)
    turn = mean_turn(raw, chest.axes, np.arange(len(raw)))
    # Only the nod is taken from the chest; the other two directions are the markers' own.
    nod = np.arctan2(turn[0, 2], turn[2, 2])
    cosine, sine = np.cos(nod), np.sin(nod)
    head = raw @ np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    axes["Head"], axes["Neck"] = head, share_turn(chest.axes, head, 0.5)
    origin["Neck"] = chest.cervical
    origin["Head"] = chest.cervical + from_axes(axes["Neck"], neck)


def _seen(axes: Array) -> bool:
    return bool(np.any(np.all(np.isfinite(axes), axis=(1, 2))))
