"""What the body bears now: contacts, base velocity, external wrenches and joint torques."""

from estimation.base_velocity import (
    BaseVelocity,
    Contact,
    base_velocity,
    configuration_from_link,
)
from estimation.contacts import (
    SUPPORTS,
    ContactDetector,
    Contacts,
    ContactThresholds,
    FootMotion,
    classify_by_force,
)
from estimation.errors import (
    EstimationError,
    IllConditionedError,
    MeasurementError,
    NoContactError,
    SingularContactsError,
)
from estimation.foot_motion import sole_motion, sole_points
from estimation.imu_placement import ImuPlacement, LinkMotion, PlacementEstimator, place_imu

__all__ = [
    "SUPPORTS",
    "BaseVelocity",
    "Contact",
    "ContactDetector",
    "ContactThresholds",
    "Contacts",
    "EstimationError",
    "FootMotion",
    "IllConditionedError",
    "ImuPlacement",
    "LinkMotion",
    "MeasurementError",
    "NoContactError",
    "PlacementEstimator",
    "SingularContactsError",
    "base_velocity",
    "classify_by_force",
    "configuration_from_link",
    "place_imu",
    "sole_motion",
    "sole_points",
]
