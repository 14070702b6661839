"""From a recording to the model's configurations: scaling and link-pairwise inverse kinematics.

Use this for recordings of segment orientations (inertial suits, BVH). Each joint's angles follow
from the orientations of the two segments it joins and from nothing else, so an error in one does
not spread.

Source: Latella et al. 2019, section 3.2, eq. (6); velocities by its Savitzky-Golay filter
(`human.differentiate`).
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from human.differentiate import WINDOW_S, motion_from_configurations
from human.errors import RecordingError
from human.fitted_skeleton import all_orientations, joint_offsets
from human.generate import scale_model
from human.kinematics import forward_kinematics
from human.model import HumanModel, Subject
from human.motion import Motion, Provenance
from human.names import JOINTS, PARENT_SEGMENT, SEGMENT_OF_JOINT, SEGMENTS
from human.pairwise_ik import PairSolution, solve_pair
from human.recording import Finding, Recording
from human.rotations import (
    matrix_to_quaternion,
    quaternion_conjugate,
    quaternion_continuous,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

#: A pelvis that moves less than this over a recording was not located in the world.
_FIXED_BASE_M = 0.005
_STATURE_MISMATCH = 0.10
#: Share of frames, and angle, beyond which a joint outside its limits is put down to calibration.
_MOSTLY = 0.8
_FAR_OUTSIDE_RAD = np.deg2rad(20.0)


class RecordingRefusedError(RecordingError):
    """A recording has findings that make its posture wrong, such as exchanged sides.

    Attributes:
        findings: what was found.
    """

    def __init__(self, source: str, findings: tuple[Finding, ...]) -> None:
        """Lists the findings and how to go on in spite of them."""
        self.findings = findings
        codes = ", ".join(dict.fromkeys(finding.code for finding in findings))
        listed = " ".join(f"[{f.code}, {f.place}] {f.message}" for f in findings)
        super().__init__(
            f"{source}: expected the recording of a body, got: {listed} "
            f"To fit it all the same, accept by name: {codes}."
        )


@dataclass(frozen=True, slots=True, eq=False)
class PoseDiagnostics:
    """How well the model's posture meets the recording; ``J`` joints in ``joint_names`` order.

    Attributes:
        joint_names: the model's joints.
        pair_error_rad: ``(frames, J)`` angle between recorded and fitted relative rotation.
        limited: ``(frames, J)`` a joint limit is active.
        near_singular: ``(frames, J)`` middle axis within 5 degrees of 90: rates there are
            unreliable.
        frozen: ``(frames, J)`` within 0.1 degree: split of the outer axes interpolated.
        segment_names: segments that the recording has.
        orientation_error_rad: ``(frames, segments)`` between recorded and fitted world orientation.
        position_error_m: ``(frames, segments)`` between recorded and fitted segment origins.
        filled_segments: segments that the recording lacks and whose orientation was filled in.
        notes: anything else worth knowing.
    """

    joint_names: tuple[str, ...]
    pair_error_rad: Array
    limited: Flags
    near_singular: Flags
    frozen: Flags
    segment_names: tuple[str, ...]
    orientation_error_rad: Array
    position_error_m: Array
    filled_segments: tuple[str, ...]
    notes: tuple[str, ...]

    def summary(self) -> dict[str, Any]:
        """Returns the figures a reader wants first, ready for JSON."""
        free = ~self.limited & ~self.frozen
        joints = {
            name: {
                "limit_active_share": float(np.mean(self.limited[:, k])),
                "error_at_limit_deg": float(np.rad2deg(np.max(self.pair_error_rad[:, k]))),
            }
            for k, name in enumerate(self.joint_names)
            if np.any(self.limited[:, k])
        }
        inside = self.pair_error_rad[free]
        return {
            "orientation_error_within_limits_deg": float(np.rad2deg(np.max(inside, initial=0.0))),
            "position_error_median_m": float(np.median(self.position_error_m)),
            "position_error_p95_m": float(np.percentile(self.position_error_m, 95)),
            "joints_at_limits": joints,
            "near_singular_frames": int(np.count_nonzero(np.any(self.near_singular, axis=1))),
            "filled_segments": list(self.filled_segments),
            "notes": list(self.notes),
        }


@dataclass(frozen=True, slots=True, eq=False)
class FittedRecording:
    """The model scaled to a recording, its motion, and how well they meet it."""

    model: HumanModel
    motion: Motion
    diagnostics: PoseDiagnostics


def fit_recording(
    recording: Recording,
    subject: Subject,
    *,
    accept: Collection[str] = (),
    within_limits: bool = True,
    window_s: float = WINDOW_S,
) -> FittedRecording:
    """Scales the model to a recording and computes its configurations.

    Args:
        recording: from `human.readers.read_recording`.
        subject: the person; the lengths come from the recording, masses from the subject.
        accept: codes of error findings to go on in spite of, such as ``sides``.
        within_limits: keep joint limits (the constrained optimum where one is active), or ignore
            them.
        window_s: width of the differentiating window, s.

    Returns:
        Model, motion (with frame flags ``limit_active`` and ``near_singular``) and diagnostics.

    Raises:
        RecordingRefusedError: the recording has error findings not named in ``accept``.
        ModelError: its skeleton is not one of a person of that stature.

    Source: Latella et al. 2019, eq. (6).
    """
    refused = tuple(f for f in recording.errors if f.code not in accept)
    if refused:
        raise RecordingRefusedError(recording.source, refused)
    model = scale_model(subject, joint_offsets(recording, subject))
    orientation, filled = all_orientations(recording)
    solutions = [
        _solve_joint(model, joint, orientation, within_limits) for joint in model.joint_names
    ]
    # An orientation and its negative are the same; the motion's do not jump between the two.
    base = quaternion_continuous(orientation[:, 0])
    q = np.concatenate(
        [
            recording.position[:, recording.segment_names.index("Pelvis")],
            base / np.linalg.norm(base, axis=-1, keepdims=True),
            *(solution.angles for solution in solutions),
        ],
        axis=1,
    )
    diagnostics = _diagnose(recording, model, subject, q, solutions, filled)
    motion = motion_from_configurations(
        model.dof_names,
        recording.time_s,
        q,
        window_s=window_s,
        base=_base_kind(q[:, :3]),
        flags={
            "limit_active": np.any(diagnostics.limited, axis=1),
            "near_singular": np.any(diagnostics.near_singular, axis=1),
        },
        provenance=_provenance(recording, filled, accept),
        spherical=[model.joint_dofs(joint) for joint in range(len(model.joint_names))],
    )
    return FittedRecording(model, motion, diagnostics)


def _solve_joint(
    model: HumanModel, joint: str, orientation: Array, within_limits: bool
) -> PairSolution:
    child = SEGMENT_OF_JOINT[joint]
    turn = quaternion_multiply(
        quaternion_conjugate(orientation[:, SEGMENTS.index(PARENT_SEGMENT[child])]),
        orientation[:, SEGMENTS.index(child)],
    )
    dofs = model.joint_dofs(model.joint_names.index(joint))
    lower, upper = model.lower[dofs], model.upper[dofs]
    if not within_limits:
        lower, upper = np.full(3, -np.inf), np.full(3, np.inf)
    return solve_pair(turn, lower, upper)


def _diagnose(
    recording: Recording,
    model: HumanModel,
    subject: Subject,
    q: Array,
    solutions: list[PairSolution],
    filled: tuple[str, ...],
) -> PoseDiagnostics:
    poses = forward_kinematics(model, q)
    at = [model.segment_names.index(name) for name in recording.segment_names]
    fitted = matrix_to_quaternion(poses.rotation[:, at])
    turn = quaternion_multiply(quaternion_conjugate(fitted), recording.orientation_xyzw)
    notes: list[str] = []
    ratio = recording.subject.skeleton_height_m / subject.height_m
    if abs(ratio - 1.0) > _STATURE_MISMATCH:
        notes.append(
            f"The file's skeleton is {recording.subject.skeleton_height_m:.2f} m tall, the subject "
            f"{subject.height_m:.2f} m: check height and units."
        )
    for joint, solution in zip(JOINTS, solutions, strict=True):
        share, worst = float(np.mean(solution.limited)), float(np.max(solution.error_rad))
        if share > _MOSTLY and worst > _FAR_OUTSIDE_RAD:
            notes.append(
                f"{joint} lies up to {np.rad2deg(worst):.0f} deg outside its limits in {share:.0%} "
                "of the frames: a calibration fault of the suit rather than a posture."
            )
    return PoseDiagnostics(
        joint_names=JOINTS,
        pair_error_rad=np.stack([s.error_rad for s in solutions], axis=1),
        limited=np.stack([s.limited for s in solutions], axis=1),
        near_singular=np.stack([s.near_singular for s in solutions], axis=1),
        frozen=np.stack([s.frozen for s in solutions], axis=1),
        segment_names=recording.segment_names,
        orientation_error_rad=np.linalg.norm(quaternion_to_rotation_vector(turn), axis=-1),
        position_error_m=np.linalg.norm(poses.position[:, at] - recording.position, axis=-1),
        filled_segments=filled,
        notes=tuple(notes),
    )


def _base_kind(position: Array) -> str:
    moved = float(np.max(np.linalg.norm(position - position[0], axis=-1)))
    return "fixed" if len(position) > 1 and moved < _FIXED_BASE_M else "measured"


def _provenance(
    recording: Recording, filled: tuple[str, ...], accept: Collection[str]
) -> Provenance:
    assumed = {
        name: "not measured in the recording"
        for name, status in recording.segment_status.items()
        if status == "unmeasured"
    }
    assumed |= dict.fromkeys(filled, "not in the recording: filled in from its neighbours")
    assumed |= {f.code: f"accepted: {f.message}" for f in recording.errors if f.code in accept}
    return Provenance(
        source=f"{recording.source} ({recording.format} {recording.version})",
        sha256=recording.digest,
        steps=(
            *recording.report.conversions,
            "joint offsets from the recording's skeleton",
            "joint angles by link-pairwise inverse kinematics",
        ),
        assumed=assumed,
    )
