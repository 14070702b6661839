"""Force plates to feet: which foot each plate carries, and its wrench at the motion's frames."""

from estimation.foot_force_record import (
    USABLE,
    FootForce,
    FootForces,
    FootState,
    PlateStance,
)

__all__ = ["USABLE", "FootForce", "FootForces", "FootState", "PlateStance"]
