"""Worksheets as they travel; what a sheet may hold is decided in ``ergonomics``."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

Method = Literal["rula", "reba"]


class Worksheet(BaseModel):
    """One worksheet: ``input`` has the fields of the printed sheet, angles in degrees.

    ``id``, ``name``, ``note``, ``expected`` and ``agreed_by`` may stand beside it, as in a list of
    worked cases; ``id`` is given back, the others are not read.
    """

    input: dict[str, Any]
    method: Method | None = None
    profile: Literal["paper", "worksheet"] = "paper"
    ties: Literal["lower", "higher"] = "lower"
    neutral_tolerance_deg: float = 5.0
    id: str | None = None


class WorksheetResult(BaseModel):
    """Every intermediate score, the final one, and the reason for each point."""

    model_config = ConfigDict(extra="allow")

    final: int
    action_level: int
    reasons: dict[str, Any]
    method: Method
    profile: str
    ties: str
    neutral_tolerance_deg: float
    id: str | None = None
