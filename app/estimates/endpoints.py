"""Routes of estimates: ask, list, read, the time series."""

from typing import Annotated

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse

from app.deps import Service
from app.estimates.schemas import Estimate, EstimateRequest, Estimates, SeriesPart
from app.operations.schemas import Operation
from app.problem_handlers import declared
from app.problems import Busy, InvalidRequest, NotFound

router = APIRouter(prefix="/v1/estimates", tags=["estimates"])

#: Media type of the time series as a file.
PARQUET = "application/vnd.apache.parquet"


def _json(content: bytes) -> Response:
    return Response(content, media_type="application/json")


@router.post("", status_code=202, responses=declared(InvalidRequest, NotFound, Busy))
def estimate(body: EstimateRequest, service: Service, response: Response) -> Operation:
    """Estimates joint torques, efforts and payload of a recording; follow the operation.

    Forces come from the recording's own plates (C3D) or from the file added to it as `grf`. What
    cannot be told from what was measured is null in the series, and named in the summary.
    """
    operation = service.estimates.ask(body)
    response.headers["Location"] = f"/v1/operations/{operation.id}"
    response.headers["Retry-After"] = "1"
    return operation


@router.get("")
def list_estimates(service: Service) -> Estimates:
    """Lists estimates, newest first."""
    return Estimates(items=service.estimates.all())


@router.get(
    "/{estimate_id}",
    response_class=Response,
    responses={200: {"model": Estimate}, **declared(NotFound)},
)
def get_estimate(estimate_id: str, service: Service) -> Response:
    """Returns an estimate's summary: holds, efforts, low back, feet, what was assumed."""
    return _json(service.estimates.content(estimate_id))


@router.get(
    "/{estimate_id}/series",
    response_class=Response,
    responses={200: {"model": SeriesPart}, **declared(NotFound, InvalidRequest)},
)
def get_series(
    estimate_id: str,
    service: Service,
    columns: Annotated[
        str, Query(description="Names with commas between, from the summary's `columns`.")
    ],
    start: Annotated[
        float | None, Query(description="First instant, s.", allow_inf_nan=False)
    ] = None,
    end: Annotated[
        float | None, Query(description="First instant after, s.", allow_inf_nan=False)
    ] = None,
) -> Response:
    """Returns columns of the time series, evenly thinned to at most 20 000 rows."""
    wanted = [name for name in columns.split(",") if name]
    return _json(service.estimates.series(estimate_id, wanted, start, end))


@router.get(
    "/{estimate_id}/series.parquet",
    response_class=FileResponse,
    responses={
        200: {"content": {PARQUET: {}}, "description": "Every column and frame"},
        **declared(NotFound),
    },
)
def get_parquet(estimate_id: str, service: Service) -> FileResponse:
    """Returns the whole time series as a Parquet file."""
    path = service.estimates.parquet(estimate_id)
    return FileResponse(path, media_type=PARQUET, filename=f"{estimate_id[:12]}.parquet")


@router.get(
    "/{estimate_id}/urdf",
    response_class=Response,
    responses={
        200: {"content": {"text/xml": {}}, "description": "The person's body as URDF"},
        **declared(NotFound),
    },
)
def get_urdf(estimate_id: str, service: Service) -> Response:
    """Returns the person's body, scaled to the recording, as URDF with visuals."""
    return Response(service.estimates.urdf(estimate_id), media_type="text/xml")
