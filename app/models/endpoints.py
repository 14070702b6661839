"""Routes of operator models: add a file, list, look, draw."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from app.deps import Service
from app.models.schemas import Model, Models
from app.problem_handlers import declared
from app.problems import NotFound, TooLarge, Unreadable, UnsupportedFormat

router = APIRouter(prefix="/v1/models", tags=["models"])

#: Media type of a model file.
MODEL_TYPE = "application/vnd.ergocast.model"

_RAW_BODY = {
    "requestBody": {
        "required": True,
        "content": {MODEL_TYPE: {"schema": {"type": "string", "format": "binary"}}},
    }
}


@router.post(
    "",
    status_code=201,
    responses=declared(TooLarge, UnsupportedFormat, Unreadable),
    openapi_extra=_RAW_BODY,
)
async def add_model(
    request: Request,
    service: Service,
    name: Annotated[str, Query(description="The file's name, to show.")] = "operator",
) -> Model:
    """Takes a model file made by ``ergocast train`` as the raw body."""
    kind = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if kind not in (MODEL_TYPE, "application/octet-stream"):
        raise UnsupportedFormat(
            f"A model file is sent as {MODEL_TYPE}; this one came as {kind or 'nothing'}."
        )
    return await service.models.add(request.stream(), name, service.settings.max_upload_bytes)


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
