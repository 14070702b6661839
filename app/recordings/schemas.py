"""What a client sees of a recording."""

from typing import Any

from pydantic import BaseModel


class Recording(BaseModel):
    """An uploaded recording; its id is its content's digest."""

    id: str
    name: str
    format: str
    size_bytes: int
    #: What ``ergocast inspect`` says: subject, rate, duration, channels, gaps, problems.
    inspection: dict[str, Any]


class Recordings(BaseModel):
    """A list of recordings, newest first."""

    items: list[Recording]
