"""Routes that say whether the service runs and can work."""

from typing import Literal

from fastapi import APIRouter, Response
from pydantic import BaseModel

from app.deps import Service
from app.version import VERSION

router = APIRouter(prefix="/health", tags=["health"])


class Live(BaseModel):
    """The process answers."""

    status: Literal["ok"] = "ok"
    version: str = VERSION


class Ready(BaseModel):
    """Each part that work needs, and whether it is there."""

    status: Literal["ok", "not ready"]
    checks: dict[str, bool]


@router.get("/live")
def live() -> Live:
    """Answers as long as the process runs."""
    return Live()


@router.get("/ready")
def ready(service: Service, response: Response) -> Ready:
    """Answers 503 while the data folder cannot be written or no thread is there to work."""
    checks = {"data": service.data_is_writable(), "operations": service.operations.is_working()}
    if all(checks.values()):
        return Ready(status="ok", checks=checks)
    response.status_code = 503
    return Ready(status="not ready", checks=checks)
