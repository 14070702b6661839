"""Errors of the service, and how they reach a client: ``application/problem+json`` (RFC 9457).

The tree (a status and a stable ``slug`` per leaf)::

    AppError
    ├── ConfigurationError      (start-up only)
    └── Problem
        ├── InvalidRequest 422   ├── NotFound 404         ├── Conflict 409
        ├── TooLarge 413         ├── UnsupportedFormat 415├── Unreadable 422
        ├── Unauthorized 401     ├── Forbidden 403        ├── Busy 429
        ├── Cancelled 409        └── Internal 500
"""

import traceback
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

#: Media type of every error body.
PROBLEM_JSON = "application/problem+json"


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing wrong with a request, and where.

    Attributes:
        pointer: JSON Pointer (RFC 6901) into the request body; empty for the whole body.
        expected: What would have been accepted.
        got: What was there, shortened.
        detail: One sentence for people.
    """

    pointer: str
    expected: str
    got: str
    detail: str


class AppError(Exception):
    """Base of every error raised by the ``app`` package."""


class ConfigurationError(AppError):
    """The service cannot start as configured."""


class Problem(AppError):
    """An error with a status, a stable type and, where it helps, the faults one by one."""

    status: ClassVar[int] = 500
    slug: ClassVar[str] = "internal"
    title: ClassVar[str] = "The service failed"

    def __init__(
        self,
        detail: str,
        faults: Sequence[Fault] = (),
        headers: dict[str, str] | None = None,
    ) -> None:
        """Stores what happened (``detail``), where (``faults``) and headers to answer with."""
        super().__init__(detail)
        self.detail = detail
        self.faults = tuple(faults)
        self.headers = headers or {}

    def body(self, instance: str | None = None) -> dict[str, Any]:
        """Returns the problem as the JSON object a client gets."""
        return {
            "type": f"/problems/{self.slug}",
            "title": self.title,
            "status": self.status,
            "detail": self.detail,
            "instance": instance,
            "errors": [asdict(fault) for fault in self.faults],
        }

    def text(self) -> str:
        """Returns the problem as lines for a terminal."""
        lines = [self.detail]
        for fault in self.faults:
            lines.append(
                f"  {fault.pointer or '/'}: {fault.detail} "
                f"(expected {fault.expected}; got {fault.got})"
            )
        return "\n".join(lines)


class InvalidRequest(Problem):
    """The request is malformed, or holds values outside what can be."""

    status = 422
    slug = "invalid-request"
    title = "The request is not valid"


class Unreadable(Problem):
    """A file is of a known format but its content cannot be used."""

    status = 422
    slug = "unreadable-file"
    title = "The file cannot be used"


class NotFound(Problem):
    """There is nothing by that name."""

    status = 404
    slug = "not-found"
    title = "Not found"


class Conflict(Problem):
    """The request is fine but the state of the thing forbids it."""

    status = 409
    slug = "conflict"
    title = "The state does not allow this"


class TooLarge(Problem):
    """The body is larger than the service takes."""

    status = 413
    slug = "too-large"
    title = "The body is too large"


class UnsupportedFormat(Problem):
    """The content is in no format that the service reads."""

    status = 415
    slug = "unsupported-format"
    title = "The format is not supported"


class Unauthorized(Problem):
    """No valid key came with the request."""

    status = 401
    slug = "unauthorized"
    title = "A valid API key is needed"


class Forbidden(Problem):
    """The request comes from a page of another site."""

    status = 403
    slug = "forbidden"
    title = "Not allowed from there"


class Busy(Problem):
    """Too much work waits already."""

    status = 429
    slug = "busy"
    title = "Too much work is waiting"


class Cancelled(Problem):
    """The work was cancelled on request."""

    status = 409
    slug = "cancelled"
    title = "The work was cancelled"


class Internal(Problem):
    """The service failed in a way it did not foresee."""


#: What to do about each problem type; served at ``/problems/{slug}``.
ADVICE: dict[str, str] = {
    "invalid-request": "Correct the places listed under `errors` (JSON Pointers) and send again.",
    "unreadable-file": "The file was recognised but is damaged or holds impossible values. "
    "`ergocast inspect FILE` shows the place; export the recording again.",
    "not-found": "Check the id and the path; GET the collection to see what there is.",
    "conflict": "Read the resource again: its state has changed or does not allow the action.",
    "too-large": "Send less at once, or start the service with a larger ERGOCAST_MAX_UPLOAD_BYTES "
    "or ERGOCAST_MAX_BODY_BYTES.",
    "unsupported-format": "Send a motion (MVNX, BVH, or markers as C3D, TRC, CSV, .mat), forces as "
    "its file of role `grf` (MOT, STO, C3D), or an Ergocast model file.",
    "unauthorized": "Send the header `Authorization: Bearer KEY` with a key from "
    "ERGOCAST_API_KEYS.",
    "forbidden": "A browser page of another site may not use this service.",
    "busy": "Wait as long as the Retry-After header says, then send again.",
    "cancelled": "Send the request again to start over.",
    "candidate-rejected": "One candidate cannot be assessed; the others are. Correct the places "
    "listed under `errors`.",
    "internal": "Try again; if it persists, report it with the operation or request id.",
}


def place_of(error: BaseException) -> str:
    """Returns an error's kind and where it was raised, for a log: nothing of what it says.

    Messages may hold what a client sent; file names, lines and functions are our own.
    """
    frames = traceback.extract_tb(error.__traceback__)[-3:]
    places = (f"{Path(one.filename).name}:{one.lineno} ({one.name})" for one in reversed(frames))
    return f"{type(error).__name__} at {', from '.join(places) or 'an unknown place'}"


def shorten(value: object, limit: int = 80) -> str:
    """Returns a value as text short enough for an error message."""
    text = repr(value)
    return text if len(text) <= limit else text[: limit - 1] + "…"


def pointer(*parts: str | int) -> str:
    """Returns the JSON Pointer (RFC 6901) through ``parts``."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in parts)


def faults_of_validation(
    errors: Sequence[Any], prefix: tuple[str | int, ...] = ()
) -> tuple[Fault, ...]:
    """Returns pydantic's error records as faults.

    Args:
        errors: ``ValidationError.errors()`` or ``RequestValidationError.errors()``.
        prefix: Where the validated value stands in the body.
    """
    faults = []
    for error in errors:
        location = tuple(error["loc"])
        if location and location[0] == "body":
            location = location[1:]
        message = str(error["msg"])
        message = message.removeprefix("Value error, ")
        expected = message.removeprefix("Input should be ").removeprefix("expected ")
        if error["type"] in ("model_type", "dict_type", "model_attributes_type"):
            expected = "an object"
            message = "Input should be an object"
        got = "nothing" if error["type"] == "missing" else shorten(error.get("input"))
        faults.append(Fault(pointer(*prefix, *location), expected, got, message))
    return tuple(faults)
