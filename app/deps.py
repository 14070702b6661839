"""What a route gets handed: the one object that holds the service's parts."""

from typing import Annotated

from fastapi import Depends, Request

from app.service import ErgocastService


def _service(request: Request) -> ErgocastService:
    service: ErgocastService = request.app.state.service
    return service


Service = Annotated[ErgocastService, Depends(_service)]
