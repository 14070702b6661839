"""Turns every error of a request into ``application/problem+json``."""

import logging
from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import PlainTextResponse, Response
from pydantic import BaseModel
from starlette.exceptions import HTTPException

from app.files import dump_json
from app.problems import (
    ADVICE,
    PROBLEM_JSON,
    Conflict,
    Fault,
    Internal,
    InvalidRequest,
    NotFound,
    Problem,
    TooLarge,
    UnsupportedFormat,
    faults_of_validation,
    place_of,
)

_log = logging.getLogger("ergocast")


class FaultSchema(BaseModel):
    """One thing wrong with the request."""

    pointer: str
    expected: str
    got: str
    detail: str


class ProblemSchema(BaseModel):
    """Body of every error (RFC 9457)."""

    type: str
    title: str
    status: int
    detail: str
    instance: str | None = None
    errors: list[FaultSchema] = []


def declared(*kinds: type[Problem]) -> dict[int | str, dict[str, Any]]:
    """Returns the ``responses=`` entry of a route that may answer with these problems."""
    schema = ProblemSchema.model_json_schema(ref_template="#/components/schemas/{model}")
    schema.pop("$defs", None)
    return {
        kind.status: {"description": kind.title, "content": {PROBLEM_JSON: {"schema": schema}}}
        for kind in kinds
    }


def problem_response(problem: Problem, instance: str | None, status: int | None = None) -> Response:
    """Returns a problem as an HTTP answer."""
    body = problem.body(instance)
    if status is not None:
        body["status"] = status
    return Response(
        dump_json(body),
        status_code=body["status"],
        media_type=PROBLEM_JSON,
        headers=dict(problem.headers),
    )


_BY_STATUS: Mapping[int, type[Problem]] = {
    404: NotFound,
    409: Conflict,
    413: TooLarge,
    415: UnsupportedFormat,
    422: InvalidRequest,
}


async def _on_problem(request: Request, error: Exception) -> Response:
    assert isinstance(error, Problem)
    return problem_response(error, request.url.path)


async def _on_invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    if first["type"] == "json_invalid":
        why, at = first["ctx"]["error"], first["loc"][-1]
        return problem_response(_not_json(f"{why} at character {at}"), request.url.path)
    faults = faults_of_validation(error.errors())
    places = ", ".join(fault.pointer or "/" for fault in faults[:3])
    return problem_response(
        InvalidRequest(f"The request is not valid at {places}.", faults), request.url.path
    )


async def _on_http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    kind = _BY_STATUS.get(error.status_code, InvalidRequest)
    detail = error.detail
    if error.status_code == 404 and detail == "Not Found":
        detail = f"There is nothing at {request.url.path}."
    if error.status_code == 400:
        # A body that cannot even be parsed is malformed like any other.
        why = "not UTF-8, nested too deeply, or a number of too many digits"
        return problem_response(_not_json(why), request.url.path)
    problem = kind(str(detail), headers=dict(error.headers or {}))
    return problem_response(problem, request.url.path, status=error.status_code)


def _not_json(why: str) -> InvalidRequest:
    fault = Fault("", "one JSON value", why, "the body cannot be parsed")
    return InvalidRequest(f"The body is not JSON: {why}.", [fault])


async def _on_unforeseen(request: Request, error: Exception) -> Response:
    # The body may hold personal data: log where it was raised, not what was sent.
    _log.error("%s %s failed: %s", request.method, request.url.path, place_of(error))
    return problem_response(
        Internal("The service failed in a way it did not foresee; nothing was stored."),
        request.url.path,
    )


def install(app: FastAPI) -> None:
    """Registers the handlers and the page of each problem type on ``app``."""
    app.add_exception_handler(Problem, _on_problem)
    app.add_exception_handler(RequestValidationError, _on_invalid)
    app.add_exception_handler(HTTPException, _on_http)
    app.add_exception_handler(Exception, _on_unforeseen)

    @app.get("/problems/{slug}", include_in_schema=False)
    def problem_page(slug: str) -> PlainTextResponse:
        """Says what a problem type means and what to do about it."""
        if slug not in ADVICE:
            raise NotFound(f"No problem type is called {slug!r}.")
        return PlainTextResponse(f"{slug}\n\n{ADVICE[slug]}\n")
