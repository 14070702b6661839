"""Routes of recordings' scores."""

from fastapi import APIRouter, Response

from app.deps import Service
from app.problem_handlers import declared
from app.problems import InvalidRequest, NotFound, Unreadable
from app.scores.schemas import ScoreRequest, ScoreResult

router = APIRouter(prefix="/v1/scores", tags=["scores"])


@router.post(
    "",
    response_class=Response,
    responses={200: {"model": ScoreResult}, **declared(InvalidRequest, NotFound, Unreadable)},
)
def score(body: ScoreRequest, service: Service) -> Response:
    """Scores a recording: RULA and REBA of both sides over time, with reasons.

    The same recording and options give the same answer, byte for byte.
    """
    return Response(service.scores.answer(body), media_type="application/json")


@router.get(
    "/{score_id}",
    response_class=Response,
    responses={200: {"model": ScoreResult}, **declared(NotFound)},
)
def get_score(score_id: str, service: Service) -> Response:
    """Returns scores as they were answered."""
    return Response(service.scores.content(score_id), media_type="application/json")


@router.get(
    "/{score_id}/urdf",
    response_class=Response,
    responses={
        200: {"content": {"text/xml": {}}, "description": "The person's body as URDF"},
        **declared(NotFound),
    },
)
def get_urdf(score_id: str, service: Service) -> Response:
    """Returns the recorded person's body as URDF with visuals, for drawing it."""
    return Response(service.scores.urdf(score_id), media_type="text/xml")
