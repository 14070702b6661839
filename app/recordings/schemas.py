"""What a client sees of a recording."""

from typing import Any

from pydantic import BaseModel

from app.takes import PartRole


class RecordingFile(BaseModel):
    """A file that goes with a motion."""

    #: ``static``, ``grf``, ``static_grf``, ``marker_set`` or ``columns``.
    role: PartRole
    name: str
    size_bytes: int
    sha256: str


class Recording(BaseModel):
    """An uploaded recording; its id is the digest of its motion."""

    id: str
    name: str
    format: str
    size_bytes: int
    #: What ``ergocast inspect`` says: subject, rate, duration, channels, gaps, problems.
    inspection: dict[str, Any]
    #: What was added to it: the static trial, force plates, mappings.
    files: list[RecordingFile] = []


class Recordings(BaseModel):
    """A list of recordings, newest first."""

    items: list[Recording]
