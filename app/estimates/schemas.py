"""What a client asks of an estimate, and what it gets."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

Side = Literal["right", "left"]
Instant = Annotated[float, Field(ge=-1e10, le=1e10, allow_inf_nan=False)]


class EstimateOptions(BaseModel):
    """Who the person is and how to estimate; what is left out is assumed and named."""

    model_config = ConfigDict(extra="forbid")

    height_m: float = Field(strict=True, gt=0.0, le=3.0, allow_inf_nan=False)
    #: Left out, it is what plates carry in the static trial, which must then have plates.
    mass_kg: float | None = Field(default=None, strict=True, gt=0.0, le=500.0, allow_inf_nan=False)
    sex: Literal["female", "male", "unknown"] = "unknown"
    method: Literal["one_step", "two_step", "deterministic"] = "one_step"
    #: Hands that may bear something; ``auto``: both where there are foot forces.
    hands: Literal["auto", "both", "right", "left", "none"] = "auto"
    #: Which kilograms the payload over time is; holds have all three.
    definition: Literal["inertial", "vertical", "norm"] = "inertial"
    #: Start and end, s, of a stretch in which the person stands still and bears nothing.
    tare_s: tuple[Instant, Instant] | None = None
    #: Seconds to add to the plates' times; left out, it is estimated where plates have a file of
    #: their own.
    clock_offset_s: float | None = Field(
        default=None, strict=True, ge=-600.0, le=600.0, allow_inf_nan=False
    )
    #: Plate to foot, where the automatic assignment is wrong.
    assign: dict[str, Side] = {}
    #: ``noise``: of the sensors alone; ``noise_and_model``: widened by what errors of masses,
    #: lengths, angles and plates would do.
    bands: Literal["noise", "noise_and_model"] = "noise_and_model"
    #: Findings of the recording (codes) to go on in spite of, such as ``sides``.
    accept: list[str] = []

    @field_validator("tare_s")
    @classmethod
    def _forward(cls, tare_s: tuple[float, float] | None) -> tuple[float, float] | None:
        if tare_s is not None and not tare_s[0] < tare_s[1]:
            raise ValueError("expected the start before the end, in seconds")
        return tare_s


class EstimateRequest(EstimateOptions):
    """A recording to estimate."""

    recording_id: str


class Band(BaseModel):
    """A quantity with its 5, 50 and 95 % quantile; null where there are no bands."""

    p05: float | None
    p50: float
    p95: float | None


class Hold(BaseModel):
    """A stretch in which the hands' state does not change."""

    start_s: float
    end_s: float
    #: ``free`` or ``loaded``.
    state: str
    #: Hands that may bear: the mass is their sum.
    hands: list[str]
    mass_kg: Band
    #: The same by each definition: ``inertial``, ``vertical``, ``norm``.
    by_definition_kg: dict[str, Band]
    #: Each hand's part, or null where only the sum can be told.
    split_kg: dict[str, float] | None


class PeakEffort(BaseModel):
    """How much a joint bore."""

    joint: str
    peak_nm: Band
    at_s: float
    #: Over the known frames.
    median_nm: float
    p90_nm: float
    #: Share of the frames in which it can be told.
    known_share: float


class Estimate(BaseModel):
    """What an estimate comes to; the time series are at ``series_url``."""

    id: str
    recording_id: str
    source: str
    created: str
    options: dict[str, Any]
    person: dict[str, Any]
    duration_s: float
    frames: int
    rate_hz: float
    #: Reason to frames that could not be estimated.
    left_out: dict[str, int]
    #: ``noise``, ``noise_and_model``, ``tuning`` (too narrow to be believed) or ``none``.
    bands: str
    payload: dict[str, Any]
    holds: list[Hold]
    #: ``start_s``, ``end_s``, ``right``, ``left``, ``together``: free, loaded or unknown.
    hands: list[dict[str, Any]]
    #: Where the body's balance is known, only its sum, or not at all.
    balance: dict[str, Any]
    #: Greatest first.
    efforts: list[PeakEffort]
    low_back: dict[str, Any] | None
    feet: dict[str, Any] | None
    #: How well the body meets the recording.
    fit: dict[str, Any]
    assumed: list[str]
    findings: list[str]
    files: list[dict[str, Any]]
    software: str
    columns: list[str]
    series_url: str
    model_urdf_url: str


class EstimateItem(BaseModel):
    """One line of the list."""

    id: str
    recording_id: str
    source: str
    created: str
    duration_s: float


class Estimates(BaseModel):
    """A list of estimates, newest first."""

    items: list[EstimateItem]


class SeriesPart(BaseModel):
    """Some columns over some time; null where a value cannot be told."""

    columns: dict[str, list[float | bool | str | None]]
    #: Unit of each column, as its name says.
    units: dict[str, str]
