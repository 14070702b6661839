"""The digital human: model, kinematics, dynamics, motions and the readers of recordings."""

from human.chain import Chain
from human.differentiate import Derivatives, LocalCubic, motion_from_configurations
from human.dynamics import (
    JointLoads,
    Wrench,
    inverse_dynamics,
    joint_forces,
    joint_loads,
    joint_moments,
)
from human.errors import (
    ConfigurationError,
    HumanError,
    ModelError,
    MotionError,
    RecordingError,
    RotationError,
    SubjectError,
    UnknownNameError,
    UrdfError,
)
from human.generate import generate_model, scale_model
from human.joint_log import JointLog
from human.kinematics import SegmentPoses, forward_kinematics, frame_poses
from human.model import Frame, HumanModel, Subject
from human.motion import Motion, Provenance
from human.names import DOF_NAMES, JOINTS, SEGMENTS
from human.pose import FittedRecording, PoseDiagnostics, RecordingRefusedError, fit_recording
from human.recording import Recording
from human.urdf_reader import from_urdf
from human.urdf_writer import to_urdf

__all__ = [
    "DOF_NAMES",
    "JOINTS",
    "SEGMENTS",
    "Chain",
    "ConfigurationError",
    "Derivatives",
    "FittedRecording",
    "Frame",
    "HumanError",
    "HumanModel",
    "JointLoads",
    "JointLog",
    "LocalCubic",
    "ModelError",
    "Motion",
    "MotionError",
    "PoseDiagnostics",
    "Provenance",
    "Recording",
    "RecordingError",
    "RecordingRefusedError",
    "RotationError",
    "SegmentPoses",
    "Subject",
    "SubjectError",
    "UnknownNameError",
    "UrdfError",
    "Wrench",
    "fit_recording",
    "forward_kinematics",
    "frame_poses",
    "from_urdf",
    "generate_model",
    "inverse_dynamics",
    "joint_forces",
    "joint_loads",
    "joint_moments",
    "motion_from_configurations",
    "scale_model",
    "to_urdf",
]
