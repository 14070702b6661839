"""Routes of operator models: add a file, train one, list, look, draw."""

import json
from typing import Annotated

from anyio import to_thread
from fastapi import APIRouter, HTTPException, Query, Request, Response
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError

from app.deps import Service
from app.models.schemas import Model, Models, TrainingRequest
from app.operations.schemas import Operation
from app.problem_handlers import declared
from app.problems import (
    Busy,
    InvalidRequest,
    NotFound,
    TooLarge,
    Unreadable,
    UnsupportedFormat,
)

router = APIRouter(prefix="/v1/models", tags=["models"])

#: Media type of a model file.
MODEL_TYPE = "application/vnd.ergocast.model"

_BODY = {
    "requestBody": {
        "required": True,
        "content": {
            MODEL_TYPE: {"schema": {"type": "string", "format": "binary"}},
            "application/json": {"schema": TrainingRequest.model_json_schema()},
        },
    }
}


@router.post(
    "",
    status_code=201,
    response_model=Model,
    responses={
        202: {"model": Operation, "description": "The training is queued; follow the operation"},
        **declared(TooLarge, UnsupportedFormat, Unreadable, NotFound, InvalidRequest, Busy),
    },
    openapi_extra=_BODY,
)
async def add_model(
    request: Request,
    service: Service,
    name: Annotated[str, Query(description="The file's name, to show.")] = "operator",
) -> Model | Response:
    """Takes a model file made by ``ergocast train``, or trains a model on recordings.

    The content type decides: a model file is the raw body; JSON asks for a training, which is
    done in the background.
    """
    kind = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if kind == "application/json":
        return await _train(await request.body(), service)
    if kind not in (MODEL_TYPE, "application/octet-stream"):
        raise UnsupportedFormat(
            f"A model file is sent as {MODEL_TYPE}, a request to train one as application/json; "
            f"this came as {kind or 'nothing'}."
        )
    return await service.models.add(request.stream(), name, service.settings.max_upload_bytes)


async def _train(body: bytes, service: Service) -> Response:
    try:
        asked = TrainingRequest.model_validate(json.loads(body))
    except ValidationError as error:
        raise RequestValidationError(error.errors()) from error
    except (ValueError, RecursionError) as error:
        raise HTTPException(400, "not JSON") from error
    operation = await to_thread.run_sync(service.trainings.ask, asked)
    return Response(
        operation.model_dump_json(),
        status_code=202,
        media_type="application/json",
        headers={"Location": f"/v1/operations/{operation.id}", "Retry-After": "1"},
    )


@router.get("")
def list_models(service: Service) -> Models:
    """Lists models, newest first."""
    return Models(items=service.models.all())


@router.get("/{model_id}", responses=declared(NotFound))
def get_model(model_id: str, service: Service) -> Model:
    """Returns one model's record."""
    return service.models.get(model_id)


@router.get(
    "/{model_id}/urdf",
    responses={
        200: {"content": {"text/xml": {}}, "description": "The person's body as URDF"},
        **declared(NotFound),
    },
    response_class=Response,
)
def get_urdf(model_id: str, service: Service) -> Response:
    """Returns the person's body as URDF with visuals, for drawing it."""
    return Response(service.models.urdf(model_id), media_type="text/xml")
