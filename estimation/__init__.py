"""What the body bears now: contacts, base velocity, external wrenches and joint torques."""

from estimation.base_velocity import (
    BaseVelocity,
    Contact,
    base_velocity,
    configuration_from_link,
)
from estimation.errors import (
    EstimationError,
    IllConditionedError,
    MeasurementError,
    NoContactError,
    SingularContactsError,
)

__all__ = [
    "BaseVelocity",
    "Contact",
    "EstimationError",
    "IllConditionedError",
    "MeasurementError",
    "NoContactError",
    "SingularContactsError",
    "base_velocity",
    "configuration_from_link",
]
