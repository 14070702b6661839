"""Files for the readers, made from a known motion: MVNX of both versions, BVH of other makes."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from human.differentiate import motion_from_configurations
from human.generate import generate_model
from human.kinematics import forward_kinematics
from human.model import HumanModel, Subject
from human.motion import Motion
from human.names import JOINT_OF_SEGMENT, JOINTS, PARENT_SEGMENT, SEGMENTS

PERSON = Subject(1.75, 70.0, "male")

#: Degrees about x, y, z of the right side's and midline's joints: standing, knees and elbows bent.
_POSTURE = {
    "jRightShoulder": (60.0, 10.0, 20.0),
    "jRightElbow": (2.0, 20.0, 60.0),
    "jRightHip": (-5.0, -40.0, 5.0),
    "jRightKnee": (0.0, 50.0, 0.0),
    "jRightAnkle": (0.0, -10.0, 0.0),
    "jT9T8": (3.0, 8.0, 4.0),
}


def walker(frames: int = 40, rate_hz: float = 60.0, seed: int = 0) -> tuple[HumanModel, Motion]:
    """A person with bent knees and elbows swaying smoothly, all joints well inside their limits."""
    rng = np.random.default_rng(seed)
    model = generate_model(PERSON)
    time = np.arange(frames) / rate_hz
    angles = np.zeros((frames, len(JOINTS), 3))
    for k, joint in enumerate(JOINTS):
        mirror = np.array([-1.0, 1.0, -1.0]) if "Left" in joint else 1.0
        middle = np.deg2rad(_POSTURE.get(joint.replace("Left", "Right"), (0.0, 0.0, 0.0))) * mirror
        phase = rng.uniform(0.0, 2.0 * np.pi, 3)
        angles[:, k] = middle + np.deg2rad(3.0) * np.sin(2.0 * np.pi * time[:, None] + phase)
    turn = Rotation.from_euler("ZYX", np.stack([0.5 + time, 0.1 * time, 0.05 * time], axis=-1))
    place = np.stack([0.3 * time, 0.1 * time, 0.95 + 0.01 * np.sin(time)], axis=-1)
    q = np.concatenate([place, turn.as_quat(), angles.reshape(frames, -1)], axis=1)
    return model, motion_from_configurations(model.dof_names, time, q)


def write_mvnx(
    path: Path,
    model: HumanModel,
    motion: Motion,
    *,
    version: int = 4,
    sensors: tuple[str, ...] = SEGMENTS,
    labels: Mapping[str, str] | None = None,
    index: tuple[int, ...] | None = None,
    digits: int = 6,
) -> str:
    """Writes the motion as MVN exports it and returns the text; ``labels`` renames segments."""
    rename = dict(labels or {})
    poses = forward_kinematics(model, motion.q)
    quat = Rotation.from_matrix(poses.rotation.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    quat = quat.reshape(len(motion.time_s), len(SEGMENTS), 4)
    if version == 3:  # arms in axes that hang with them, palms to the thighs
        for side, sign in (("Right", -1.0), ("Left", 1.0)):
            first = Rotation.from_euler("x", sign * 90, degrees=True)
            for part in ("UpperArm", "ForeArm", "Hand"):
                turn = (
                    first
                    if part == "UpperArm"
                    else first * Rotation.from_euler("z", -90 * sign, degrees=True)
                )
                k = SEGMENTS.index(side + part)
                turned = Rotation.from_quat(quat[:, k], scalar_first=True) * turn
                quat[:, k] = turned.as_quat(scalar_first=True)
    position_tag = "pos_b" if version == 4 else "pos_s"

    def name(segment: str) -> str:
        return rename.get(segment, segment)

    def alias(joint: str) -> str:
        return joint.replace("C7Shoulder", "T4Shoulder") if version == 4 else joint

    rate = 1.0 / np.median(np.diff(motion.time_s))
    out = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<mvnx xmlns="http://www.xsens.com/mvn/mvnx" version="{version}">',
        '<mvn version="2019.0.0"/><comment></comment>',
        f'<subject label="Made" frameRate="{rate:g}" segmentCount="23">',
        "<segments>",
    ]
    children: dict[str, list[str]] = {s: [] for s in SEGMENTS}
    for segment in SEGMENTS[1:]:
        children[PARENT_SEGMENT[segment]].append(segment)
    for k, segment in enumerate(SEGMENTS):
        points = (
            {"pOrigin": np.zeros(3)} if k == 0 else {alias(JOINT_OF_SEGMENT[segment]): np.zeros(3)}
        )
        for child in children[segment]:
            points[alias(JOINT_OF_SEGMENT[child])] = model.offsets[SEGMENTS.index(child) - 1]
        if segment == "Head":
            points["pTopOfHead"] = np.array([0.0, 0.0, 0.17])
        marks = "".join(
            f'<point label="{label}"><{position_tag}>{numbers(p, digits)}</{position_tag}></point>'
            for label, p in points.items()
        )
        out.append(
            f'<segment label="{name(segment)}" id="{k + 1}"><points>{marks}</points></segment>'
        )
    out.append("</segments><sensors>")
    out += [f'<sensor label="{s}"/>' for s in sensors]
    out.append("</sensors><joints>")
    for segment in SEGMENTS[1:]:
        joint = alias(JOINT_OF_SEGMENT[segment])
        out.append(
            f'<joint label="{joint}">'
            f"<connector1>{name(PARENT_SEGMENT[segment])}/{joint}</connector1>"
            f"<connector2>{name(segment)}/{joint}</connector2></joint>"
        )
    out.append('</joints><frames segmentCount="23" sensorCount="17" jointCount="22">')
    still = numbers(np.tile([1.0, 0.0, 0.0, 0.0], 23), digits)
    for kind in ("identity", "tpose") if version == 4 else ("npose", "tpose"):
        out.append(
            f'<frame time="0" ms="0" type="{kind}"><orientation>{still}</orientation>'
            f"<position>{numbers(np.zeros(69), digits)}</position></frame>"
        )
    for k in range(len(motion.time_s)):
        number = index[k] if index else k
        out.append(
            f'<frame time="{round(1000 * motion.time_s[k])}" index="{number}" type="normal">'
            f"<orientation>{numbers(quat[k], digits)}</orientation>"
            f"<position>{numbers(poses.position[k], digits)}</position></frame>"
        )
    out.append("</frames></subject></mvnx>")
    text = "\n".join(out) + "\n"
    path.write_text(text)
    return text


def numbers(values: np.ndarray, digits: int = 6) -> str:
    return " ".join(f"{v:.{digits}f}" for v in np.ravel(values))


CMU_NAMES = {"Pelvis": "Hips", "L5": "LowerBack", "T12": "Spine", "T8": "Spine1", "Neck": "Neck",
             "Head": "Head"} | {
    side + house: side + cmu
    for side in ("Right", "Left")
    for house, cmu in (("Shoulder", "Shoulder"), ("UpperArm", "Arm"), ("ForeArm", "ForeArm"),
                       ("Hand", "Hand"), ("UpperLeg", "UpLeg"), ("LowerLeg", "Leg"),
                       ("Foot", "Foot"), ("Toe", "ToeBase"))
}  # fmt: skip
#: File axes (rows) in house axes: y up and z forward; z up and x forward; x up and y forward.
Y_UP = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
Z_UP = np.eye(3)
X_UP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def write_other_bvh(
    path: Path,
    model: HumanModel,
    motion: Motion,
    *,
    names: Mapping[str, str] = CMU_NAMES,
    unit_m: float = 0.0254 / 0.45,
    axes: np.ndarray = Y_UP,
    rest_axes: np.ndarray | None = None,
    order: str = "ZYX",
    rest: Mapping[str, Rotation] | None = None,
    dummies: bool = True,
    frame_time: str = "0.0166667",
) -> None:
    """Writes BVH of another make.

    Args:
        names: house segment to joint name; segments left out are missing from the skeleton.
        unit_m: metres per unit of the file.
        axes: file axes in house axes, for the world.
        rest_axes: for the skeleton, where that lies otherwise.
        order: of rotation channels.
        rest: turn of a segment in the rest pose from the T-pose.
        dummies: CMU's joints of no length at the hips.
    """
    body = axes if rest_axes is None else rest_axes
    turns = {segment: Rotation.identity() for segment in names} | dict(rest or {})
    poses = forward_kinematics(model, motion.q)
    world = {
        s: axes @ poses.rotation[:, SEGMENTS.index(s)] @ turns[s].inv().as_matrix() @ body.T
        for s in names
    }
    lines = ["HIERARCHY"]
    columns = [poses.position[:, 0] @ axes.T / unit_m]
    zero = np.zeros((len(motion.time_s), 3))

    def parent_of(segment: str) -> str:
        parent = PARENT_SEGMENT[segment]
        return parent if parent in names else parent_of(parent)

    def offset_of(segment: str) -> np.ndarray:
        """From the nearest segment in the file, in the T-pose, then turned into its rest pose."""
        total, at = np.zeros(3), segment
        while at != parent_of(segment):
            total = total + model.offsets[SEGMENTS.index(at) - 1]
            at = PARENT_SEGMENT[at]
        return turns[parent_of(segment)].apply(total)

    def triple(v: np.ndarray) -> str:
        return numbers(body @ v / unit_m, 7)

    def block(segment: str, depth: int) -> None:
        pad = "\t" * depth
        root = segment == "Pelvis"
        offset = np.zeros(3) if root else offset_of(segment)
        closing = ["}"]
        if dummies and segment.endswith("UpperLeg"):
            lines.extend([f"{pad}JOINT {'R' if 'Right' in segment else 'L'}HipJoint", pad + "{",
                          pad + "OFFSET 0 0 0", f"{pad}CHANNELS 3 {channels}"])  # fmt: skip
            columns.append(zero)
            closing.append("}")
        lines.append(f"{pad}{'ROOT' if root else 'JOINT'} {names[segment]}")
        lines.append(pad + "{")
        lines.append(f"{pad}OFFSET {triple(offset)}")
        lines.append(
            f"{pad}CHANNELS {'6 Xposition Yposition Zposition' if root else '3'} {channels}"
        )
        local = (
            world[segment]
            if root
            else np.swapaxes(world[parent_of(segment)], 1, 2) @ world[segment]
        )
        columns.append(Rotation.from_matrix(local).as_euler(order, degrees=True))
        below = [s for s in names if s != "Pelvis" and parent_of(s) == segment]
        for child in below:
            block(child, depth + 1)
        if not below:
            tip = {"Head": (0, 0, 0.17), "Hand": (0, -0.17 if "Right" in segment else 0.17, 0)}
            end = np.array(
                tip.get(segment.removeprefix("Right").removeprefix("Left"), (0.06, 0, 0))
            )
            lines.extend(
                [
                    pad + "End Site",
                    pad + "{",
                    f"{pad}OFFSET {triple(turns[segment].apply(end))}",
                    pad + "}",
                ]
            )
        lines.extend(pad + brace for brace in closing)

    channels = " ".join(f"{axis}rotation" for axis in order)
    block("Pelvis", 0)
    rows = np.concatenate(columns, axis=1)
    lines += ["MOTION", f"Frames: {len(rows)}", f"Frame Time: {frame_time}"]
    lines += [numbers(row) for row in rows]
    path.write_text("\n".join(lines) + "\n")
