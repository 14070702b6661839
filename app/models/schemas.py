"""What a client sees of an operator model."""

from typing import Any

from pydantic import BaseModel


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
    hand: str
    method: str
    #: When the model was added to this service.
    created: str
    #: Held-out figures of each method, as training measured them.
    metrics: dict[str, Any]
    urdf_url: str


class Models(BaseModel):
    """A list of models, newest first."""

    items: list[Model]
