"""Joint angles as an assessor would read them, from where the segments point.

Angles are taken between directions of bones and body axes, never from Euler components of a
joint: those flip near 90 degrees, which is where work with raised arms takes place.

Frames: world z up. Segment frames are aligned with the world in the T-pose: x forward, y left,
z up; the right arm lies along -y with the palm down, so in the N-pose the palms face the thighs
and the forearm is in the middle of its twist.

Derived here, after the definitions of RULA and REBA; each choice is documented at its field.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from .errors import PostureError
from .geometry import (
    angle_between,
    arcsine,
    heading_axes,
    in_frame,
    length,
    relative,
    twist,
)
from .neutral import Poses, calibration

Floats = NDArray[np.float64]
Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")

#: Frames handled at a time: the gathered segments of one run stay in the second-level cache.
_RUN = 1024
_ARM_SEGMENTS = ("Shoulder", "UpperArm", "ForeArm", "Hand")
_MIDDLE_SEGMENTS = ("Pelvis", "T8", "Head")
_LEG_SEGMENTS = ("UpperLeg", "LowerLeg", "Foot")
#: Backward lean of the upper arm from which an elevation can be an extension.
_EXTENSION_SINE = float(np.sin(np.deg2rad(10.0)))
#: Trunk within this sine of lying sideways: its forward angle has no meaning there.
_SIDEWAYS_SINE = float(np.sin(np.deg2rad(10.0)))
#: Upper arm within this sine of straight sideways: its sagittal angle has no meaning there.
_SAGITTAL_SINE = float(np.sin(np.deg2rad(1.0)))
#: Near overhead the turn of the upper arm about itself cannot be told from its swing.
_ROTATION_LIMIT_DEG = 135.0


class SegmentNames(Protocol):
    """A model as far as the angles need it: the order of its segments."""

    @property
    def segment_names(self) -> Sequence[str]:
        """Names along the segment axis of its poses."""


@dataclass(frozen=True, slots=True)
class ArmAngles:
    """Angles of one arm, ``(...)`` each; degrees where the name says so.

    Attributes:
        upper_arm_deg: Elevation of the upper arm from hanging along the trunk, 0 to 180;
            negative for extension: at most 90, and leaning back more than 10 degrees and more
            than it leans sideways.
        upper_arm_sagittal_deg: The same seen from the side, -180 to 180: a sideways raise counts
            as zero. Zero, too, within a degree of straight sideways, where it is undefined.
        abduction_deg: Angle of the upper arm out of the sagittal plane, + away from the body.
        rotation_deg: Turn of the upper arm about itself, + inward; zero when the arm is raised
            above 135 degrees, where it is undefined.
        shoulder_raise_deg: Elevation of the shoulder girdle over neutral.
        elbow_deg: Angle between upper arm and forearm, 0 straight.
        midline_crossing_m: How far the wrist is past the trunk's midline, + across.
        out_to_side_m: How far the wrist is outside the shoulder, + outside.
        wrist_flexion_deg: + towards the palm.
        wrist_deviation_deg: + towards the thumb.
        pronation_deg: Twist of the forearm, wrist's share included, + thumb inward and down,
            0 as in a handshake.
    """

    upper_arm_deg: Floats
    upper_arm_sagittal_deg: Floats
    abduction_deg: Floats
    rotation_deg: Floats
    shoulder_raise_deg: Floats
    elbow_deg: Floats
    midline_crossing_m: Floats
    out_to_side_m: Floats
    wrist_flexion_deg: Floats
    wrist_deviation_deg: Floats
    pronation_deg: Floats


@dataclass(frozen=True, slots=True)
class PostureAngles:
    """Angles of the whole body, ``(...)`` each, degrees.

    Attributes:
        arms: By side.
        neck_flexion_deg: Head against the upper trunk, + forward.
        neck_twist_deg: + towards the left.
        neck_bend_deg: + towards the left.
        trunk_flexion_deg: Forward inclination of the upper trunk to the vertical, in the
            heading of the pelvis: a hip hinge with a straight back counts in full.
        trunk_inclination_deg: The same in any direction, 0 to 180.
        trunk_twist_deg: Upper trunk against pelvis, + towards the left.
        trunk_bend_deg: Likewise, + towards the left.
        knee_deg: Flexion by side, 0 straight.
        unmeasured: Segments whose pose is a placeholder.
    """

    arms: Mapping[Side, ArmAngles]
    neck_flexion_deg: Floats
    neck_twist_deg: Floats
    neck_bend_deg: Floats
    trunk_flexion_deg: Floats
    trunk_inclination_deg: Floats
    trunk_twist_deg: Floats
    trunk_bend_deg: Floats
    knee_deg: Mapping[Side, Floats]
    unmeasured: frozenset[str]


def posture_angles(
    model: SegmentNames,
    poses: Poses,
    *,
    sides: Collection[Side] = SIDES,
    neutral_reference: Poses | None = None,
    unmeasured: Collection[str] = (),
) -> PostureAngles:
    """Measures the angles that RULA and REBA ask for.

    Args:
        model: Anything with the ``segment_names`` of the poses.
        poses: Segment rotations ``(..., segments, 3, 3)`` and origins ``(..., segments, 3)`` in
            the world, metres.
        sides: Arms to measure; one alone saves a third of the time.
        neutral_reference: Poses of the person standing in N-pose, if recorded: they become the
            zero of trunk, neck, shoulder girdle and wrist. The model's N-pose if None.
        unmeasured: Segments that the recording did not see; kept in the result.

    Raises:
        PostureError: If shapes are wrong, a value is not finite, a segment is missing, or a limb
            has no length.
    """
    names = list(model.segment_names)
    needed = _needed(sides)
    for name in (*needed, *unmeasured):
        if name not in names:
            raise PostureError("model.segment_names", f"{name!r} is missing")
    rotation, position = _checked(poses, len(names))
    shape = rotation.shape[:-3]
    # Component first: each slice below is then one copy, none where FK already stores it so.
    rotation = np.moveaxis(rotation.reshape(-1, len(names), 3, 3), 0, -1)
    position = np.moveaxis(position.reshape(-1, len(names), 3), 0, -1)
    turns = calibration(names, neutral_reference) if neutral_reference is not None else {}
    where = {name: names.index(name) for name in needed}
    total = rotation.shape[-1]
    out: dict[str, Floats] = {}
    for start in range(0, total, _RUN):
        run = slice(start, min(start + _RUN, total))
        frame = {
            name: np.ascontiguousarray(rotation[where[name], ..., run])
            for name in needed
            if not name.endswith(_LEG_SEGMENTS)
        }
        point = {name: position[where[name], :, run] for name in needed}
        for name in turns.keys() & frame.keys():
            frame[name] = np.einsum("ijn,jk->ikn", frame[name], turns[name])
        for name, value in _measure(frame, point, sides).items():
            if name not in out:
                out[name] = np.empty(total)
            out[name][run] = value
    if not total:
        raise PostureError("poses", "expected at least one frame")
    field = {name: value.reshape(shape) for name, value in out.items()}
    for value in field.values():
        value.setflags(write=False)
    return PostureAngles(
        arms={
            side: ArmAngles(
                **{
                    name.removeprefix(f"{side}."): value
                    for name, value in field.items()
                    if name.startswith(f"{side}.") and not name.endswith(".knee_deg")
                }
            )
            for side in sides
        },
        knee_deg={side: field[f"{side}.knee_deg"] for side in SIDES},
        unmeasured=frozenset(unmeasured),
        **{name: value for name, value in field.items() if "." not in name},
    )


def _needed(sides: Collection[Side]) -> list[str]:
    arms = [f"{s.capitalize()}{part}" for s in sides for part in _ARM_SEGMENTS]
    legs = [f"{s.capitalize()}{part}" for s in SIDES for part in _LEG_SEGMENTS]
    return [*_MIDDLE_SEGMENTS, *arms, *legs]


def _checked(poses: Poses, segments: int) -> tuple[Floats, Floats]:
    rotation = np.asarray(poses.rotation, dtype=np.float64)
    position = np.asarray(poses.position, dtype=np.float64)
    if rotation.ndim < 3 or rotation.shape[-3:] != (segments, 3, 3):
        raise PostureError(
            "poses.rotation", f"expected (..., {segments}, 3, 3), got {rotation.shape}"
        )
    if position.shape != rotation.shape[:-1]:
        raise PostureError(
            "poses.position", f"expected {rotation.shape[:-1]}, got {position.shape}"
        )
    for name, array in (("poses.rotation", rotation), ("poses.position", position)):
        # A sum is finite only if every term is, and needs no array of flags.
        if not np.isfinite(array.sum()):
            bad = np.argwhere(~np.isfinite(array))
            if len(bad):
                raise PostureError(name, "expected a finite value", tuple(map(int, bad[0])))
    return rotation, position


def _measure(
    frame: Mapping[str, Floats], point: Mapping[str, Floats], sides: Collection[Side]
) -> dict[str, Floats]:
    pelvis, t8 = frame["Pelvis"], frame["T8"]
    out = _trunk(pelvis, t8)
    head = relative(t8, frame["Head"])
    out["neck_flexion_deg"] = np.rad2deg(np.arctan2(head[0, 2], head[2, 2]))
    out["neck_bend_deg"] = np.rad2deg(arcsine(head[1, 2]))
    out["neck_twist_deg"] = np.rad2deg(twist(head, 2))
    for side in SIDES:
        upper, lower, foot = (point[f"{side.capitalize()}{part}"] for part in _LEG_SEGMENTS)
        thigh, shank = _bone(upper, lower, f"{side} thigh"), _bone(lower, foot, f"{side} shank")
        out[f"{side}.knee_deg"] = np.rad2deg(angle_between(thigh, shank))
    for side in sides:
        arm = _arm(side, t8, frame, point)
        out |= {f"{side}.{name}": value for name, value in arm.items()}
    return out


def _trunk(pelvis: Floats, t8: Floats) -> dict[str, Floats]:
    forward_x, forward_y = heading_axes(pelvis)
    up = t8[:, 2]
    ahead = up[0] * forward_x + up[1] * forward_y
    inclination = np.arctan2(np.hypot(up[0], up[1]), up[2])
    flexion = np.arctan2(ahead, up[2])
    # Lying sideways the forward angle is the angle of nothing; the whole inclination, the larger
    # of the two, is scored instead.
    sideways = np.hypot(ahead, up[2]) < _SIDEWAYS_SINE
    flexion = np.where(sideways, np.copysign(inclination, ahead), flexion)
    spine = relative(pelvis, t8)
    return {
        "trunk_flexion_deg": np.rad2deg(flexion),
        "trunk_inclination_deg": np.rad2deg(inclination),
        "trunk_twist_deg": np.rad2deg(twist(spine, 2)),
        "trunk_bend_deg": np.rad2deg(arcsine(spine[1, 2])),
    }


def _arm(
    side: Side, t8: Floats, frame: Mapping[str, Floats], point: Mapping[str, Floats]
) -> dict[str, Floats]:
    # Outward is -y for the right arm, +y for the left; everything else mirrors with it.
    outward = -1.0 if side == "right" else 1.0
    name = side.capitalize()
    shoulder, elbow, wrist = (point[f"{name}{part}"] for part in _ARM_SEGMENTS[1:])
    humerus = _bone(shoulder, elbow, f"{side} upper arm")
    forearm = _bone(elbow, wrist, f"{side} forearm")
    ahead, left, up = in_frame(t8, humerus) / length(humerus)
    elevation = np.arctan2(np.hypot(ahead, left), -up)
    backward = (ahead < -_EXTENSION_SINE) & (np.abs(ahead) >= np.abs(left)) & (up <= 0.0)
    girdle = relative(t8, frame[f"{name}Shoulder"])
    spot = in_frame(t8, wrist - point["T8"])
    from_shoulder = in_frame(t8, wrist - shoulder)
    elevation_deg = np.rad2deg(elevation)
    return {
        "upper_arm_deg": np.where(backward, -elevation_deg, elevation_deg),
        "upper_arm_sagittal_deg": np.where(
            np.hypot(ahead, up) > _SAGITTAL_SINE, np.rad2deg(np.arctan2(ahead, -up)), 0.0
        ),
        "abduction_deg": np.rad2deg(arcsine(outward * left)),
        "rotation_deg": np.where(
            elevation_deg <= _ROTATION_LIMIT_DEG,
            _inward_rotation(relative(t8, frame[f"{name}UpperArm"]), outward),
            0.0,
        ),
        "shoulder_raise_deg": np.rad2deg(arcsine(outward * girdle[2, 1])),
        "elbow_deg": np.rad2deg(angle_between(humerus, forearm)),
        "midline_crossing_m": -outward * spot[1],
        "out_to_side_m": outward * from_shoulder[1],
        **_wrist(name, outward, frame),
    }


def _inward_rotation(upper_arm: Floats, outward: float) -> Floats:
    # Axes of the arm as it would hang: turned back by the quarter turn from T-pose to N-pose.
    hanging = np.stack(
        [upper_arm[:, 0], outward * upper_arm[:, 2], -outward * upper_arm[:, 1]], axis=1
    )
    return -outward * np.rad2deg(twist(hanging, 2))


def _wrist(name: str, outward: float, frame: Mapping[str, Floats]) -> dict[str, Floats]:
    elbow = relative(frame[f"{name}UpperArm"], frame[f"{name}ForeArm"])
    hand = relative(frame[f"{name}ForeArm"], frame[f"{name}Hand"])
    # The wrist cannot twist: a turn of the hand about the forearm is pronation that the
    # recording put there. Flexion and deviation are read in axes that turn with it.
    carried = twist(hand, 1)
    sine, cosine = np.sin(carried), np.cos(carried)
    x, y, z = outward * hand[:, 1]
    thumbward = cosine * x - sine * z
    palmward = -(sine * x + cosine * z)
    return {
        "wrist_flexion_deg": np.rad2deg(np.arctan2(palmward, outward * y)),
        "wrist_deviation_deg": np.rad2deg(arcsine(thumbward)),
        "pronation_deg": np.rad2deg(twist(elbow, 1) + carried),
    }


def _bone(start: Floats, end: Floats, name: str) -> Floats:
    bone: Floats = end - start
    if not length(bone).min() > 1e-6:
        raise PostureError("poses.position", f"the {name} has no length: its two joints coincide")
    return bone
