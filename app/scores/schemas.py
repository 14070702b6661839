"""What a client asks of a recording's scores, and what it gets."""

from typing import Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from app.assessments.schemas import Assumption, Posture
from app.estimates.schemas import PeakEffort


class ScoreRequest(BaseModel):
    """A recording or an estimate of one to score; what is left out is assumed and named."""

    model_config = ConfigDict(extra="forbid")

    recording_id: str | None = None
    #: Instead: its recording is scored with the person and the payload that the estimate has, and
    #: the answer holds the articular stress.
    estimate_id: str | None = None
    height_m: float | None = Field(default=None, strict=True, gt=0.0, le=3.0, allow_inf_nan=False)
    mass_kg: float | None = Field(default=None, strict=True, gt=0.0, le=500.0, allow_inf_nan=False)
    sex: Literal["female", "male", "unknown"] | None = None
    #: Load borne by both hands together, kg.
    hand_load_kg: float | None = Field(
        default=None, strict=True, ge=0.0, le=200.0, allow_inf_nan=False
    )
    profile: Literal["paper", "worksheet"] = "paper"
    ties: Literal["lower", "higher"] = "lower"
    neutral_tolerance_deg: float = Field(
        default=5.0, strict=True, ge=0.0, lt=15.0, allow_inf_nan=False
    )
    #: Findings of the recording (codes) to go on in spite of, such as ``sides``.
    accept: list[str] = []

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.recording_id is None) == (self.estimate_id is None):
            raise ValueError("expected recording_id or estimate_id, one of them")
        return self


class SideScores(BaseModel):
    """Scores of one side over time."""

    rula: list[int]
    reba: list[int]


class Sides(BaseModel):
    """Both sides."""

    left: SideScores
    right: SideScores


class Summary(BaseModel):
    """A score over the whole recording, by time."""

    median: float
    p90: float
    max: int
    #: Seconds at or above each threshold.
    time_at_or_above: dict[str, float]
    time_of_max_s: float


class Summaries(BaseModel):
    """Summary of each method, of the worse side."""

    rula: Summary
    reba: Summary


class WorstMoment(BaseModel):
    """An instant worth looking at, and why."""

    time_s: float
    side: str
    body_part: str
    score: int
    reasons: list[str]


class ScoreResult(BaseModel):
    """RULA and REBA of a recording over time."""

    id: str
    recording_id: str
    estimate_id: str | None = None
    #: Efforts of the joints with bands, greatest first; of an estimate alone.
    articular_stress: list[PeakEffort] | None = None
    time_s: list[float]
    #: Frames between two entries of the time series; summaries use every frame.
    every_frames: int
    sides: Sides
    #: Of the worse side. Where segments were not measured, the greatest that they allow; the least
    #: is beside it.
    rula: list[int]
    reba: list[int]
    rula_least: list[int]
    reba_least: list[int]
    unmeasured: list[str]
    back_angle_deg: list[float]
    summary: Summaries
    worst: list[WorstMoment]
    assumed: list[Assumption]
    rules: dict[str, Any]
    fit: dict[str, Any]
    model_urdf_url: str
    posture: Posture
