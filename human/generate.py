"""Makes the 66-DoF model of a person: from height, mass and sex, or from measured joint offsets."""

import math
from collections.abc import Mapping

import numpy as np

from human.anthropometry import TRUNK, BodyPlan, anthropometry_table, body_plan
from human.errors import ModelError
from human.joint_limits import joint_limits
from human.model import Array, Frame, HumanModel, Subject
from human.names import DOF_NAMES, JOINT_OF_SEGMENT, JOINTS, PARENT_SEGMENT, SEGMENTS
from human.shapes import Box, Cylinder, Shape, Sphere

#: Joint offsets shorter than this (m) cannot carry a segment; a recording that has one is broken.
_SHORTEST_M = 1e-3
#: Spine offsets carry a block standing on their z axis: the least part of them that must be
#: vertical.
_LEAST_SPINE_RISE = 0.5
_SPINE = ("jL5S1", "jL4L3", "jL1T12", "jT9T8", "jT1C7", "jC1Head")


def generate_model(subject: Subject) -> HumanModel:
    """Makes a person's model from published anthropometry.

    Segment masses sum to ``subject.mass_kg`` exactly; every inertia is that of a homogeneous solid
    whose length is the segment's and whose cross-section follows from mass and published density.

    Args:
        subject: the person; for sex ``unknown`` both sexes' tables are averaged.

    Returns:
        The 23-segment, 66-DoF model with limits, shapes and the frames ``RightHandCOM``,
        ``LeftHandCOM``.

    Source: Latella et al. 2019, section 2.3 (method); `human.anthropometry`, `human.joint_limits`
    (numbers).
    """
    plan = body_plan(subject)
    return _assemble(subject, plan, _offsets(plan), "generated")


def scale_model(subject: Subject, offsets: Mapping[str, Array]) -> HumanModel:
    """Makes a person's model with measured joint offsets.

    Use it when a recording holds its own skeleton; `generate_model` when it does not. Masses stay
    those of the tables and sum exactly; the solids follow the measured lengths, so inertias change
    with them.

    Args:
        subject: the person.
        offsets: joint name -> ``(3,)`` m, joint centre in the parent segment's axes from the
            parent's joint, at the T-pose. Joints not named keep the generated offset.

    Raises:
        ModelError: an offset is unknown, not finite, or too short or long for its joint.
    """
    plan = body_plan(subject)
    merged = _offsets(plan)
    for joint, offset in offsets.items():
        if joint not in merged:
            raise ModelError(f"offset of {joint!r}: expected one of {', '.join(JOINTS)}")
        value = np.asarray(offset, dtype=np.float64)
        if value.shape != (3,) or not np.all(np.isfinite(value)):
            raise ModelError(f"offset of {joint}: expected three finite metres, got {offset!r}")
        if not _SHORTEST_M <= np.linalg.norm(value) <= 0.5 * subject.height_m:
            raise ModelError(
                f"offset of {joint}: expected a length from {_SHORTEST_M:g} m to half the stature "
                f"({0.5 * subject.height_m:.2f} m), got {np.linalg.norm(value):.4g} m; "
                "are the units metres?"
            )
        if joint in _SPINE and value[2] < _LEAST_SPINE_RISE * np.linalg.norm(value):
            raise ModelError(
                f"offset of {joint}: expected to point up (z) at the T-pose, got {value}"
            )
        merged[joint] = value
    return _assemble(subject, plan, merged, "generated, joint offsets measured")


def _offsets(plan: BodyPlan) -> dict[str, Array]:
    """Joint centres in the parent's axes at the T-pose; the spine is straight above the hips."""
    m = plan.length_m
    rise = np.diff([m["hip_height"], *(m[f"{joint}_height"] for joint in _SPINE)])
    ball = _ball_from_ankle(plan)
    out = {j: np.array([0.0, 0.0, height]) for j, height in zip(_SPINE, rise, strict=True)}
    shoulder_rise = m["shoulder_height"] - m["jT9T8_height"]
    for side, left in (("Right", -1.0), ("Left", 1.0)):
        inner, outer = m["clavicle_half_breadth"], m["shoulder_half_breadth"]
        out[f"j{side}C7Shoulder"] = np.array([0.0, left * inner, shoulder_rise])
        out[f"j{side}Shoulder"] = np.array([0.0, left * (outer - inner), 0.0])
        out[f"j{side}Elbow"] = np.array([0.0, left * m["upper_arm"], 0.0])
        out[f"j{side}Wrist"] = np.array([0.0, left * m["forearm"], 0.0])
        out[f"j{side}Hip"] = np.array([0.0, left * m["hip_half_breadth"], 0.0])
        out[f"j{side}Knee"] = np.array([0.0, 0.0, -m["thigh"]])
        out[f"j{side}Ankle"] = np.array([0.0, 0.0, -m["shank"]])
        out[f"j{side}BallFoot"] = np.array([ball, 0.0, _toe_half_height(plan) - m["foot_height"]])
    return out


def _ball_from_ankle(plan: BodyPlan) -> float:
    foot = anthropometry_table()["foot"]
    return float((foot["ball_from_heel"] - foot["ankle_from_heel"]) * plan.length_m["foot_length"])


def _toe_half_height(plan: BodyPlan) -> float:
    """Half the height of the block that stands for the toes, from its mass and density."""
    table = anthropometry_table()
    length = (1.0 - table["foot"]["ball_from_heel"]) * plan.length_m["foot_length"]
    area = length * plan.length_m["foot_breadth"]
    return float(0.5 * plan.mass_kg["RightToe"] / (table["density_kg_m3"]["foot"] * area))


def _assemble(
    subject: Subject, plan: BodyPlan, offsets: Mapping[str, Array], origin: str
) -> HumanModel:
    masses = np.array([plan.mass_kg[name] for name in SEGMENTS])
    _sum_exactly(masses, subject.mass_kg)
    shapes, centers = {}, {}
    for name, mass in zip(SEGMENTS, masses, strict=True):
        shapes[name], centers[name] = _segment_solid(name, float(mass), plan, offsets)
    lower, upper = joint_limits(DOF_NAMES)
    knuckle = plan.length_m["wrist_to_knuckle"]
    provenance = {
        "model": origin,
        "masses": "de Leva 1996; trunk cut at the model's joints",
        "inertias": "homogeneous solids of published density",
        "limits": "Boone and Azen 1979, AAOS 1965, White and Panjabi 1990, Inman et al. 1944",
    }
    if subject.sex == "unknown":
        provenance["sex"] = "assumed: the mean of the female and male tables"
    return HumanModel(
        name="ergocast_human",
        segment_names=SEGMENTS,
        parents=(-1, *(SEGMENTS.index(PARENT_SEGMENT[name]) for name in SEGMENTS[1:])),
        joint_names=JOINTS,
        offsets=np.stack([offsets[joint] for joint in JOINTS]),
        dof_names=DOF_NAMES,
        dof_joints=np.repeat(np.arange(len(JOINTS)), 3),
        dof_axes=np.tile(np.arange(3), len(JOINTS)),
        lower=lower,
        upper=upper,
        masses=masses,
        centers_of_mass=np.stack([centers[name] for name in SEGMENTS]),
        inertias=np.stack(
            [shapes[n].inertia(float(m)) for n, m in zip(SEGMENTS, masses, strict=True)]
        ),
        frames={
            "RightHandCOM": Frame("RightHand", np.array([0.0, -knuckle, 0.0])),
            "LeftHandCOM": Frame("LeftHand", np.array([0.0, knuckle, 0.0])),
        },
        shapes=shapes,
        subject=subject,
        provenance=provenance,
    )


def _sum_exactly(masses: Array, total: float) -> None:
    """Gives what rounding left over to the heaviest segment, until the exact sum is the total."""
    heaviest = int(np.argmax(masses))
    for _ in range(4):
        masses[heaviest] += total - math.fsum(masses)


def _segment_solid(
    name: str, mass: float, plan: BodyPlan, offsets: Mapping[str, Array]
) -> tuple[Shape, Array]:
    """Returns the solid of a segment and its centre of mass, both in segment axes."""
    table = anthropometry_table()
    part = name.removeprefix("Right").removeprefix("Left")
    side = -1.0 if name.startswith("Right") else 1.0
    m = plan.length_m
    if name in TRUNK:
        top = {"Pelvis": "jL5S1", "L5": "jL4L3", "L3": "jL1T12", "T12": "jT9T8", "T8": "jT1C7"}
        return _trunk_block(name, mass, offsets[top[name]])
    if part == "Neck":
        return _limb(mass, offsets["jC1Head"], "head_neck", 0.5)
    if part == "Head":
        radius = (3.0 * mass / (4.0 * np.pi * table["density_kg_m3"]["head_neck"])) ** (1.0 / 3.0)
        # The crown is at the stature, whatever the neck is.
        center = m["stature"] - m["jC1Head_height"] - radius
        return Sphere(radius, (0.0, 0.0, center)), np.array([0.0, 0.0, center])
    if part == "Shoulder":
        return _limb(mass, offsets[f"j{name}"], "trunk", 0.5)
    distal = {"UpperArm": "Elbow", "ForeArm": "Wrist", "UpperLeg": "Knee", "LowerLeg": "Ankle"}
    if part in distal:
        prefix = name.removesuffix(part)
        published = {"UpperArm": "upper_arm", "ForeArm": "forearm", "UpperLeg": "thigh"}
        key = published.get(part, "shank")
        return _limb(mass, offsets[f"j{prefix}{distal[part]}"], key, plan.com_fraction[key])
    if part == "Hand":
        length, breadth = m["hand"], m["hand_breadth"]
        thickness = mass / (table["density_kg_m3"]["hand"] * length * breadth)
        center = (0.0, side * 0.5 * length, 0.0)
        com = np.array([0.0, side * plan.com_fraction["hand"] * length, 0.0])
        return Box((breadth, length, thickness), center), com
    return _foot_block(
        part, mass, plan, offsets[JOINT_OF_SEGMENT[f"{'Right' if side < 0 else 'Left'}Toe"]]
    )


def _trunk_block(name: str, mass: float, upper: Array) -> tuple[Box, Array]:
    """A block between two spine joints, its cross-section from mass and density."""
    table = anthropometry_table()
    height = float(upper[2])
    area = mass / (table["density_kg_m3"]["trunk"] * height)
    ratio = table["trunk_width_to_depth"][name]
    depth = (area / ratio) ** 0.5
    center = (0.5 * float(upper[0]), 0.5 * float(upper[1]), 0.5 * height)
    return Box((depth, ratio * depth, height), center), np.array(center)


def _limb(mass: float, distal: Array, density: str, com: float) -> tuple[Cylinder, Array]:
    """A cylinder from a joint to the next one along the axis it mostly follows."""
    axis = int(np.argmax(np.abs(distal)))
    length = float(np.linalg.norm(distal))
    radius = (mass / (anthropometry_table()["density_kg_m3"][density] * np.pi * length)) ** 0.5
    x, y, z = (float(value) for value in 0.5 * distal)
    return Cylinder(radius, length, axis, (x, y, z)), com * distal


def _foot_block(part: str, mass: float, plan: BodyPlan, ball: Array) -> tuple[Box, Array]:
    """The foot from heel to ball, or the toes from ball to tip, as blocks standing on the sole."""
    table = anthropometry_table()
    foot = table["foot"]
    length, breadth = plan.length_m["foot_length"], plan.length_m["foot_breadth"]
    if part == "Foot":
        heel = -foot["ankle_from_heel"] * length
        span = float(ball[0]) - heel
        height = mass / (table["density_kg_m3"]["foot"] * span * breadth)
        center = (
            heel + 0.5 * span,
            0.5 * float(ball[1]),
            0.5 * height - plan.length_m["foot_height"],
        )
    else:
        span = (1.0 - foot["ball_from_heel"]) * length
        height = mass / (table["density_kg_m3"]["foot"] * span * breadth)
        center = (0.5 * span, 0.0, 0.0)
    return Box((span, breadth, height), center), np.array(center)
