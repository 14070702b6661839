"""What a client asks of an estimate, and what it gets."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

Side = Literal["right", "left"]
Instant = Annotated[float, Field(ge=-1e10, le=1e10, allow_inf_nan=False)]


class _Described(BaseModel):
    """What stands below a field describes it at ``/docs``, too."""

    model_config = ConfigDict(use_attribute_docstrings=True)


class EstimateOptions(_Described):
    """Who the person is and how to estimate; what is left out is assumed and named."""

    model_config = ConfigDict(extra="forbid")

    height_m: float = Field(strict=True, gt=0.0, le=3.0, allow_inf_nan=False)
    """Stature."""
    mass_kg: float | None = Field(default=None, strict=True, gt=0.0, le=500.0, allow_inf_nan=False)
    """Left out, it is what plates carry in the static trial, which must then have plates."""
    sex: Literal["female", "male", "unknown"] = "unknown"
    """For the mass distribution."""
    method: Literal["one_step", "two_step", "deterministic"] = "one_step"
    """``two_step`` is the 2021 paper's, whose bands are tuning; ``deterministic`` has none."""
    hands: Literal["auto", "both", "right", "left", "none"] = "auto"
    """Hands that may bear something; ``auto``: both where there are foot forces."""
    definition: Literal["inertial", "vertical", "norm"] = "inertial"
    """Which kilograms the payload over time is; holds have all three."""
    tare_s: tuple[Instant, Instant] | None = None
    """Start and end, s, of a stretch in which the person stands still and bears nothing."""
    clock_offset_s: float | None = Field(
        default=None, strict=True, ge=-600.0, le=600.0, allow_inf_nan=False
    )
    """Seconds to add to the plates' times; left out, it is estimated where plates have a file of
    their own."""
    assign: dict[str, Side] = {}
    """Plate to foot, where the automatic assignment is wrong."""
    bands: Literal["noise", "noise_and_model"] = "noise_and_model"
    """``noise``: of the sensors alone; ``noise_and_model``: widened by what errors of masses,
    lengths, angles and plates would do."""
    accept: list[str] = []
    """Findings of the recording (codes) to go on in spite of, such as ``sides``."""

    @field_validator("tare_s")
    @classmethod
    def _forward(cls, tare_s: tuple[float, float] | None) -> tuple[float, float] | None:
        if tare_s is not None and not tare_s[0] < tare_s[1]:
            raise ValueError("expected the start before the end, in seconds")
        return tare_s


class EstimateRequest(EstimateOptions):
    """A recording to estimate."""

    recording_id: str


class Band(_Described):
    """A quantity with its 5, 50 and 95 % quantile; null where there are no bands."""

    p05: float | None
    p50: float
    p95: float | None


class Hold(_Described):
    """A stretch in which the hands' state does not change."""

    start_s: float
    end_s: float
    state: str
    """``free`` or ``loaded``."""
    hands: list[str]
    """Hands that may bear: the mass is their sum."""
    mass_kg: Band
    by_definition_kg: dict[str, Band]
    """The same by each definition: ``inertial``, ``vertical``, ``norm``."""
    split_kg: dict[str, float] | None
    """Each hand's part, or null where only the sum can be told."""


class PeakEffort(_Described):
    """How much a joint bore."""

    joint: str
    peak_nm: Band
    at_s: float
    median_nm: float
    """Over the known frames."""
    p90_nm: float
    """Exceeded in a tenth of them."""
    known_share: float
    """Share of the frames in which it can be told."""


class Estimate(_Described):
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
    left_out: dict[str, int]
    """Reason to frames that could not be estimated."""
    bands: str
    """``noise``, ``noise_and_model``, ``tuning`` (too narrow to be believed) or ``none``."""
    payload: dict[str, Any]
    holds: list[Hold]
    hands: list[dict[str, Any]]
    """``start_s``, ``end_s``, ``right``, ``left``, ``together``: free, loaded or unknown."""
    balance: dict[str, Any]
    """Where the body's balance is known, only its sum, or not at all."""
    efforts: list[PeakEffort]
    """Greatest first."""
    low_back: dict[str, Any] | None
    feet: dict[str, Any] | None
    fit: dict[str, Any]
    """How well the body meets the recording."""
    assumed: list[str]
    findings: list[str]
    files: list[dict[str, Any]]
    software: str
    columns: list[str]
    series_url: str
    model_urdf_url: str


class EstimateItem(_Described):
    """One line of the list."""

    id: str
    recording_id: str
    source: str
    created: str
    duration_s: float


class Estimates(_Described):
    """A list of estimates, newest first."""

    items: list[EstimateItem]


class SeriesPart(_Described):
    """Some columns over some time; null where a value cannot be told."""

    columns: dict[str, list[float | bool | str | None]]
    units: dict[str, str]
    """Unit of each column, as its name says."""
