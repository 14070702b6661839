"""Routes of recordings: add, list, look."""

from typing import Annotated

from fastapi import APIRouter, Query, Request

from app.deps import Service
from app.problem_handlers import declared
from app.problems import NotFound, TooLarge, Unreadable, UnsupportedFormat
from app.recordings.schemas import Recording, Recordings
from app.takes import PartRole

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


@router.post(
    "/{recording_id}/files",
    status_code=201,
    responses=declared(NotFound, TooLarge, UnsupportedFormat, Unreadable),
    openapi_extra=_RAW_BODY,
)
async def add_file(
    recording_id: str,
    request: Request,
    service: Service,
    role: Annotated[
        PartRole,
        Query(
            description="`static`: markers of the person standing, which scale the body; `grf`: "
            "force plates of the motion; `static_grf`: those of the static trial; `marker_set`, "
            "`columns`: JSON that maps markers to the body, or columns of CSV and .mat files."
        ),
    ],
    name: Annotated[str, Query(description="The file's name, to show.")] = "file",
) -> Recording:
    """Adds a file to a recording, as the raw body; one of the same role is replaced."""
    return await service.recordings.add_part(
        recording_id, role, request.stream(), name, service.settings.max_upload_bytes
    )


@router.get("")
def list_recordings(service: Service) -> Recordings:
    """Lists recordings, newest first."""
    return Recordings(items=service.recordings.all())


@router.get("/{recording_id}", responses=declared(NotFound))
def get_recording(recording_id: str, service: Service) -> Recording:
    """Returns one recording and what was found in it."""
    return service.recordings.get(recording_id)
