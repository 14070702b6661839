"""What a client sees of an operation."""

from typing import Any, Literal

from pydantic import BaseModel

State = Literal["queued", "running", "succeeded", "failed", "cancelled"]

#: States that an operation never leaves.
FINAL: frozenset[str] = frozenset({"succeeded", "failed", "cancelled"})


class Progress(BaseModel):
    """How far the work is."""

    done: int = 0
    total: int | None = None
    unit: str = ""
    rate: float | None = None
    eta_s: float | None = None
    message: str = ""
    #: Nats a sample, of work that fits a law, as far as it got.
    log_likelihood: float | None = None


class Operation(BaseModel):
    """One piece of long work."""

    id: str
    kind: str
    state: State
    progress: Progress
    created: str
    started: str | None = None
    finished: str | None = None
    #: How often the work was begun; more than one after a restart of the service.
    attempts: int = 0
    cancel_requested: bool = False
    result_url: str | None = None
    problem: dict[str, Any] | None = None


class Operations(BaseModel):
    """A list of operations, newest first."""

    items: list[Operation]
