"""What the body bears now: contacts, base velocity, external wrenches and joint torques."""

from estimation.base_velocity import (
    BaseVelocity,
    Contact,
    base_velocity,
    configuration_from_link,
)
from estimation.covariances import (
    APPLICATION,
    TPOSE_LOAD,
    TPOSE_NO_LOAD,
    ModelCovariances,
    TwoStepCovariances,
)
from estimation.effort import JointEfforts, JointLoad, joint_efforts, joint_load
from estimation.errors import (
    CovarianceError,
    EstimationError,
    IllConditionedError,
    KernelMissingError,
    MeasurementError,
    MissingMeasurementError,
    NoContactError,
    SingularContactsError,
    TreeError,
    UnknownLinkError,
)
from estimation.estimate_record import Estimate, Method
from estimation.feet.clocks import ClockOffset, align
from estimation.feet.contacts import (
    ROLLING_GAIT,
    SUPPORTS,
    ContactDetector,
    Contacts,
    ContactThresholds,
    FootMotion,
    classify_by_force,
)
from estimation.feet.foot_contacts import FootContacts, contacts_of_motion, contacts_of_tracks
from estimation.feet.foot_force_record import (
    FootForce,
    FootForces,
    FootState,
    PlateStance,
    PlateZero,
)
from estimation.feet.foot_forces import feet_from_plates
from estimation.feet.foot_motion import sole_motion, sole_points
from estimation.imu_placement import ImuPlacement, LinkMotion, PlacementEstimator, place_imu
from estimation.kernel import KernelState, compile_kernel, kernel_state
from estimation.map_estimator import estimate
from estimation.model_uncertainty import ModelErrors
from estimation.norm_quantiles import norm_quantiles
from estimation.payload import Payload, payload
from estimation.run.recording_run import RecordingRun, estimate_run
from estimation.run.run_records import (
    Balance,
    HandState,
    HoldMass,
    PayloadHold,
    RunChunk,
    RunInputError,
    RunSettings,
    RunSettingsError,
    RunSummary,
)
from estimation.run.run_tare import tare_stance
from estimation.sensors import (
    Accelerometer,
    AngularAcceleration,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
)
from estimation.stance_calibration import StanceCalibration, calibrate_stance, with_mass
from estimation.stream import Estimator
from estimation.tree import EstimationTree, hinge_tree, real_tree

__all__ = [
    "APPLICATION",
    "ROLLING_GAIT",
    "SUPPORTS",
    "TPOSE_LOAD",
    "TPOSE_NO_LOAD",
    "Accelerometer",
    "AngularAcceleration",
    "Balance",
    "BaseVelocity",
    "ClockOffset",
    "Contact",
    "ContactDetector",
    "ContactThresholds",
    "Contacts",
    "CovarianceError",
    "Estimate",
    "EstimationError",
    "EstimationTree",
    "Estimator",
    "FootContacts",
    "FootForce",
    "FootForces",
    "FootMotion",
    "FootState",
    "ForceTorque",
    "FreeWrench",
    "HandState",
    "HoldMass",
    "IllConditionedError",
    "ImuPlacement",
    "JointAcceleration",
    "JointEfforts",
    "JointLoad",
    "KernelMissingError",
    "KernelState",
    "LinkMotion",
    "Measurement",
    "MeasurementError",
    "Method",
    "MissingMeasurementError",
    "ModelCovariances",
    "ModelErrors",
    "NoContactError",
    "Payload",
    "PayloadHold",
    "PlacementEstimator",
    "PlateStance",
    "PlateZero",
    "RecordingRun",
    "RunChunk",
    "RunInputError",
    "RunSettings",
    "RunSettingsError",
    "RunSummary",
    "SingularContactsError",
    "StanceCalibration",
    "TreeError",
    "TwoStepCovariances",
    "UnknownLinkError",
    "align",
    "base_velocity",
    "calibrate_stance",
    "classify_by_force",
    "compile_kernel",
    "configuration_from_link",
    "contacts_of_motion",
    "contacts_of_tracks",
    "estimate",
    "estimate_run",
    "feet_from_plates",
    "hinge_tree",
    "joint_efforts",
    "joint_load",
    "kernel_state",
    "norm_quantiles",
    "payload",
    "place_imu",
    "real_tree",
    "sole_motion",
    "sole_points",
    "tare_stance",
    "with_mass",
]
