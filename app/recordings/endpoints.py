"""Routes of recordings: add, list, look."""

from typing import Annotated

from fastapi import APIRouter, Query, Request

from app.deps import Service
from app.problem_handlers import declared
from app.problems import NotFound, TooLarge, Unreadable, UnsupportedFormat
from app.recordings.schemas import Recording, Recordings

router = APIRouter(prefix="/v1/recordings", tags=["recordings"])

_RAW_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    }
}


@router.post(
    "",
    status_code=201,
    responses=declared(TooLarge, UnsupportedFormat, Unreadable),
    openapi_extra=_RAW_BODY,
)
async def add_recording(
    request: Request,
    service: Service,
    name: Annotated[str, Query(description="The file's name, to show.")] = "recording",
) -> Recording:
    """Takes a recording as the raw body; its format is told by its content."""
    return await service.recordings.add(request.stream(), name, service.settings.max_upload_bytes)


@router.get("")
def list_recordings(service: Service) -> Recordings:
    """Lists recordings, newest first."""
    return Recordings(items=service.recordings.all())


@router.get("/{recording_id}", responses=declared(NotFound))
def get_recording(recording_id: str, service: Service) -> Recording:
    """Returns one recording and what was found in it."""
    return service.recordings.get(recording_id)
