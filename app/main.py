"""Builds the web application from its settings."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI

from app import dashboard, problem_handlers
from app.access import Access
from app.assessments.endpoints import router as assessments
from app.body_limit import BodyLimit
from app.estimates.endpoints import router as estimates
from app.health.endpoints import router as health
from app.models.endpoints import router as models
from app.operations.endpoints import router as operations
from app.recordings.endpoints import router as recordings
from app.scores.endpoints import router as scores
from app.service import ErgocastService
from app.settings import Settings
from app.version import VERSION
from app.worksheets.endpoints import router as worksheets

_ABOUT = """Ranks robot motions by what they do to the body of the person holding the other end.

SI units, radians, seconds; degrees only in names that end in `_deg`. World: z up, x forward,
y left. Quaternions are `xyzw`. Errors are `application/problem+json` with a JSON Pointer per fault.
"""


def create_app(settings: Settings | None = None) -> FastAPI:
    """Returns the service as an ASGI application.

    Args:
        settings: Where data is kept and what is allowed; read from the environment if not given.
    """
    settings = settings or Settings()
    service = ErgocastService(settings)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        service.start()
        try:
            yield
        finally:
            service.close()

    app = FastAPI(
        title="Ergocast",
        version=VERSION,
        description=_ABOUT,
        lifespan=lifespan,
        # A field that the client did not know about must not silently become a second schema.
        separate_input_output_schemas=False,
    )
    app.state.service = service
    app.add_middleware(
        BodyLimit, json_bytes=settings.max_body_bytes, upload_bytes=settings.max_upload_bytes
    )
    app.add_middleware(Access, keys=settings.keys)
    problem_handlers.install(app)
    for router in (
        worksheets,
        models,
        recordings,
        estimates,
        scores,
        assessments,
        operations,
        health,
    ):
        app.include_router(router)
    dashboard.install(app)
    return app
