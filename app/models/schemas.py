"""What a client sees of an operator model."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field


class Subject(BaseModel):
    """The person a model was trained on."""

    height_m: float
    mass_kg: float
    sex: str | None


class Model(BaseModel):
    """An operator model; its id is its file's digest."""

    id: str
    name: str
    subject: Subject
    #: The led hand, or ``both``.
    hand: str
    #: What of the body stays where it is: ``pelvis`` or ``feet``.
    base: str = "pelvis"
    method: str
    #: When the model was added to this service.
    created: str
    #: Held-out figures of each method, as training measured them.
    metrics: dict[str, Any]
    #: What else the file holds: takes, joints, methods, options, findings.
    holds: dict[str, Any] = {}
    urdf_url: str


class TrainingRequest(BaseModel):
    """Recordings of one person to train a model on; what is left out has a default."""

    model_config = ConfigDict(extra="forbid", use_attribute_docstrings=True)

    recordings: list[str] = []
    """Ids. What was added to a recording (static trial, mappings) goes with it. Without any, and
    without ``add_to``, the model is of how people in general move."""
    add_to: str | None = None
    """A model of the same person and chain: its own demonstrations come first, and what is left
    out below is as it was trained."""
    name: str = Field(default="operator", max_length=200)
    """To show."""
    height_m: float | None = Field(default=None, strict=True, gt=0.0, le=3.0, allow_inf_nan=False)
    """Stature; may be left out with ``add_to`` alone."""
    mass_kg: float | None = Field(default=None, strict=True, gt=0.0, le=500.0, allow_inf_nan=False)
    """Body mass; may be left out with ``add_to`` alone."""
    sex: Literal["female", "male", "unknown"] | None = None
    """For the mass distribution; ``unknown`` unless given."""
    hand: Literal["right", "left", "both"] | None = None
    """The hand that will be led; ``right`` unless given."""
    base: Literal["pelvis", "feet"] | None = None
    """What stays where it is; ``pelvis`` unless given."""
    method: str | None = None
    """``auto`` unless given: what errs less on held-out motion."""
    optimizer: Literal["bipop", "gradient"] | None = None
    """Search of the weights; ``gradient`` unless given."""
    engine: Literal["fast", "gpytorch"] | None = None
    """``fast`` unless given; ``gpytorch`` is the slow reference."""
    kernel: Literal["separate", "paper"] | None = None
    """``separate`` unless given."""
    criterion: Literal["held-out", "marginal", "leave-one-trajectory-out", "in-sample"] | None = (
        None
    )
    """``held-out`` unless given."""
    weights: Literal["auto", "correlated", "diagonal"] | None = None
    """``auto`` unless given."""
    seed: int | None = Field(default=None, strict=True, ge=0, lt=2**32)
    """Seed of all randomness; 0 unless given."""
    accept: list[str] = []
    """Findings of the recordings (codes) to go on in spite of, such as ``sides``."""


class Models(BaseModel):
    """A list of models, newest first."""

    items: list[Model]
