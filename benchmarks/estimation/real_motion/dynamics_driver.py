"""Driver A, dynamics alone: our model moved as OpenSim's bodies move, under the same plates.

Lengths are the distances between OpenSim's joint centres in the standing trial, masses those of
our tables for the same body mass, orientations those of OpenSim's bodies; its trunk is one body, so
all of our spine above L5S1 is straight. What is left to differ is masses, inertias and dynamics.
"""

import numpy as np

from benchmarks.estimation.real_motion.opensim_reference import (
    bodies,
    joint_centres,
    plate_wrenches,
)
from benchmarks.estimation.real_motion.reference import LEGS, LOW_BACK, Array, Estimated
from human import (
    SEGMENTS,
    HumanModel,
    Motion,
    Subject,
    Wrench,
    forward_kinematics,
    generate_model,
    joint_loads,
    motion_from_configurations,
    scale_model,
)
from human.names import JOINT_OF_SEGMENT, PARENT_SEGMENT
from human.rotations import matrix_to_quaternion, matrix_to_xyz, quaternion_continuous

#: The filtered angles are differentiated over this; they hold nothing above 6 Hz any more.
_WINDOW_S = 0.06
_SPINE = ("L5", "L3", "T12", "T8", "Neck", "Head", "RightShoulder", "LeftShoulder")
_LEG = {"UpperLeg": "femur", "LowerLeg": "tibia", "Foot": "calcn", "Toe": "toes"}
_ARM = {"UpperArm": "humerus", "ForeArm": "radius", "Hand": "hand"}


def dynamics_alone(
    arrays: dict[str, Array], standing: dict[str, Array], height_m: float
) -> Estimated:
    """Returns our moments for OpenSim's motion.

    Args:
        arrays: what `opensim_run` left of the trial.
        standing: the same of the standing trial, for the lengths.
        height_m: stature, for what has no joint centre (head, hands).
    """
    subject = Subject(height_m, float(arrays["mass"].sum()))
    model = scale_model(subject, _offsets(subject, standing))
    motion = _motion(model, arrays)
    pose = forward_kinematics(model, motion.q)
    wrenches = []
    plates = plate_wrenches(arrays)
    for k, foot in enumerate(("RightFoot", "LeftFoot")):
        at = pose.position[:, model.segment_index(foot)]
        force = plates[:, k, :3]
        wrenches.append(Wrench(foot, force, plates[:, k, 3:] - np.cross(at, force)))
    joints = (*LEGS, LOW_BACK)
    loads = joint_loads(model, motion.q, motion.v, motion.a, wrenches, joints=joints)
    moment = {name: loads.moment[:, k] for k, name in enumerate(loads.joint_names)}
    return Estimated(
        driver="A, dynamics alone", time_s=motion.time_s, moment=moment,
        known={name: np.ones(len(motion), dtype=np.bool_) for name in moment},
        notes=(f"{subject.mass_kg:.1f} kg, masses of the tables",),
    )  # fmt: skip


def _offsets(subject: Subject, standing: dict[str, Array]) -> dict[str, Array]:
    """Joint offsets from the median distances between OpenSim's joint centres."""
    turn, place = bodies(standing)
    centres = joint_centres(standing)
    generated = generate_model(subject)
    offset = dict(zip(generated.joint_names, generated.offsets, strict=True))

    def seen(frame: str, point: Array, origin: Array) -> Array:
        """A point from another, in a body's axes."""
        return np.median(np.einsum("tji,tj->ti", turn[frame], point - origin), axis=0)

    middle = 0.5 * (centres["jRightHip"] + centres["jLeftHip"])
    out = {LOW_BACK: seen("pelvis", centres[LOW_BACK], middle)}
    # The spine keeps its proportions; its height is that of the shoulders above L5S1.
    spine = ("jL4L3", "jL1T12", "jT9T8")
    shoulders = 0.5 * (place["humerus_r"] + place["humerus_l"])
    rise = seen("torso", shoulders, centres[LOW_BACK])
    girdle = offset["jRightC7Shoulder"][2]
    ratio = (rise[2]) / (sum(offset[name][2] for name in spine) + girdle)
    for name in spine:
        out[name] = ratio * offset[name]
    top = np.array([0.0, 0.0, ratio * (rise[2] / ratio - girdle)])
    for side, letter in (("Right", "r"), ("Left", "l")):
        thigh, shank = f"femur_{letter}", f"tibia_{letter}"
        hip, knee, ankle = (centres[f"j{side}{part}"] for part in ("Hip", "Knee", "Ankle"))
        out[f"j{side}Hip"] = seen("pelvis", hip, middle)
        out[f"j{side}Knee"] = seen(thigh, knee, hip)
        out[f"j{side}Ankle"] = seen(shank, ankle, knee)
        shoulder = seen("torso", place[f"humerus_{letter}"], centres[LOW_BACK])
        inner = ratio * offset[f"j{side}C7Shoulder"]
        out[f"j{side}C7Shoulder"] = inner
        out[f"j{side}Shoulder"] = shoulder - top - inner
        sign = -1.0 if side == "Right" else 1.0
        for joint, far, near in (("Elbow", "ulna", "humerus"), ("Wrist", "hand", "radius")):
            there, here = place[f"{far}_{letter}"], place[f"{near}_{letter}"]
            length = float(np.median(np.linalg.norm(there - here, axis=1)))
            out[f"j{side}{joint}"] = np.array([0.0, sign * length, 0.0])
    return out


def _motion(model: HumanModel, arrays: dict[str, Array]) -> Motion:
    turn, _ = bodies(arrays)
    centres = joint_centres(arrays)
    frames = {"Pelvis": turn["pelvis"], **dict.fromkeys(_SPINE, turn["torso"])}
    for side, letter, angle in (("Right", "r", 1.0), ("Left", "l", -1.0)):
        frames |= {side + part: turn[f"{body}_{letter}"] for part, body in _LEG.items()}
        # OpenSim's arms hang in its neutral pose, ours point sideways.
        hang = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -angle], [0.0, angle, 0.0]])
        frames |= {side + part: turn[f"{body}_{letter}"] @ hang for part, body in _ARM.items()}
    q = np.empty((len(arrays["time"]), model.nq))
    q[:, :3] = 0.5 * (centres["jRightHip"] + centres["jLeftHip"])
    q[:, 3:7] = quaternion_continuous(matrix_to_quaternion(frames["Pelvis"]))
    for segment in SEGMENTS[1:]:
        joint = model.joint_names.index(JOINT_OF_SEGMENT[segment])
        between = np.swapaxes(frames[PARENT_SEGMENT[segment]], -1, -2) @ frames[segment]
        q[:, 7 + 3 * joint : 10 + 3 * joint] = matrix_to_xyz(between)
    return motion_from_configurations(model.dof_names, arrays["time"], q, window_s=_WINDOW_S)
