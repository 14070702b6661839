"""The conventions on which published versions of RULA and REBA differ, as one record."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

from .errors import WorksheetError

Profile = Literal["paper", "worksheet"]
Ties = Literal["lower", "higher"]

#: The neutral band must stay inside the nearest published edge, the wrist's 15 degrees.
NEUTRAL_TOLERANCE_LIMIT_DEG = 15.0


@dataclass(frozen=True, slots=True)
class ScoringRules:
    """Which reading of the method is applied; printed with every result.

    Attributes:
        profile: ``paper`` follows the publications of 1993 and 2000, ``worksheet`` the printed
            sheets. They differ in REBA's twist and side-bend (one point for either, one for
            each) and in RULA's intermittent force above 10 kg (2, 3).
        ties: Score of an angle exactly on a published edge between two bands.
        neutral_tolerance_deg: Half-width of "upright" and "neutral", which the papers leave
            without a number; inclusive, whatever ``ties`` says, because it is our own bound and
            not a published edge.
    """

    profile: Profile = "paper"
    ties: Ties = "lower"
    neutral_tolerance_deg: float = 5.0

    def __post_init__(self) -> None:
        """Refuses anything but the documented choices.

        Raises:
            WorksheetError: If an option has another value.
        """
        if self.profile not in get_args(Profile):
            raise WorksheetError("/profile", "'paper' or 'worksheet'", self.profile)
        if self.ties not in get_args(Ties):
            raise WorksheetError("/ties", "'lower' or 'higher'", self.ties)
        tolerance: object = self.neutral_tolerance_deg
        if (
            isinstance(tolerance, bool)
            or not isinstance(tolerance, int | float)
            or not math.isfinite(tolerance)
            or not 0.0 <= tolerance < NEUTRAL_TOLERANCE_LIMIT_DEG
        ):
            raise WorksheetError(
                "/neutral_tolerance_deg",
                f"a number of degrees from 0 to below {NEUTRAL_TOLERANCE_LIMIT_DEG:g}",
                tolerance,
            )


DEFAULT_RULES = ScoringRules()
