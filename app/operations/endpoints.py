"""Routes of long work: look, follow, cancel."""

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Header, Response
from fastapi.responses import StreamingResponse

from app.deps import Service
from app.operations.schemas import FINAL, Operation
from app.operations.schemas import Operations as OperationList
from app.problem_handlers import declared
from app.problems import Conflict, NotFound

router = APIRouter(prefix="/v1/operations", tags=["operations"])

#: How often an open event stream looks for news, and says that it is alive, in seconds.
_POLL_S = 0.1
_KEEPALIVE_S = 15.0


@router.get("")
def list_operations(service: Service) -> OperationList:
    """Lists long work, newest first."""
    return OperationList(items=service.operations.files.all()[::-1])


@router.get("/{operation_id}", responses=declared(NotFound))
def get_operation(operation_id: str, service: Service, response: Response) -> Operation:
    """Returns one operation as it is now."""
    operation = service.operations.get(operation_id)
    if operation.state not in FINAL:
        response.headers["Retry-After"] = "1"
    return operation


@router.post("/{operation_id}/cancel", responses=declared(NotFound, Conflict))
def cancel_operation(operation_id: str, service: Service) -> Operation:
    """Asks the work to stop at its next step."""
    return service.operations.cancel(operation_id)


@router.get(
    "/{operation_id}/events",
    responses={
        200: {"content": {"text/event-stream": {}}, "description": "Server-sent events"},
        **declared(NotFound),
    },
    response_class=StreamingResponse,
)
async def follow_operation(
    operation_id: str,
    service: Service,
    last_event_id: Annotated[int, Header(ge=0)] = 0,
) -> StreamingResponse:
    """Streams the operation each time it changes, until it ends.

    The ids of the events are their numbers: after a dropped connection, ``Last-Event-ID`` makes
    the stream go on where it stopped.
    """
    service.operations.get(operation_id)

    async def stream() -> AsyncIterator[str]:
        seen, quiet = last_event_id, 0.0
        while True:
            # Asked before the events are read: its last event is there by then, and is not missed.
            ended = service.operations.get(operation_id).state in FINAL
            for number, event in service.operations.files.events(operation_id, seen):
                seen, quiet = number, 0.0
                data = Operation.model_validate(event).model_dump_json()
                yield f"id: {number}\nevent: {event['state']}\ndata: {data}\n\n"
            if ended:
                return
            await asyncio.sleep(_POLL_S)
            quiet += _POLL_S
            if quiet >= _KEEPALIVE_S:
                quiet = 0.0
                yield ": still there\n\n"

    return StreamingResponse(
        stream(), media_type="text/event-stream", headers={"Cache-Control": "no-store"}
    )
