"""Routes of assessments: ask, list, read, play back."""

from typing import Annotated

from fastapi import APIRouter, Header, Response

from app.assessments.schemas import Assessment, AssessmentRequest, Assessments, Posture
from app.deps import Service
from app.operations.schemas import Operation
from app.problem_handlers import declared
from app.problems import Busy, InvalidRequest, NotFound, TooLarge

router = APIRouter(prefix="/v1/assessments", tags=["assessments"])


def _json(content: bytes) -> Response:
    return Response(content, media_type="application/json")


@router.post(
    "",
    response_class=Response,
    responses={
        200: {"model": Assessment},
        202: {"model": Operation, "description": "Under way; follow `Location`"},
        **declared(InvalidRequest, NotFound, TooLarge, Busy),
    },
)
def assess(
    body: AssessmentRequest,
    service: Service,
    prefer: Annotated[str, Header()] = "",
) -> Response:
    """Ranks candidate trajectories by what they do to the person.

    The same request gives the same answer, byte for byte. Above 20 000 candidate points, or with
    ``Prefer: respond-async``, the answer is 202 and an operation to follow.
    """
    answer = service.assessments.answer(body, in_background="respond-async" in prefer.lower())
    if isinstance(answer, bytes):
        return _json(answer)
    return Response(
        answer.model_dump_json(),
        status_code=202,
        media_type="application/json",
        headers={"Location": f"/v1/operations/{answer.id}", "Retry-After": "1"},
    )


@router.get("")
def list_assessments(service: Service) -> Assessments:
    """Lists assessments, newest first."""
    return Assessments(items=service.assessments.all())


@router.get(
    "/{assessment_id}",
    response_class=Response,
    responses={200: {"model": Assessment}, **declared(NotFound)},
)
def get_assessment(assessment_id: str, service: Service) -> Response:
    """Returns an assessment as it was answered."""
    return _json(service.assessments.content(assessment_id))


@router.get(
    "/{assessment_id}/candidates/{candidate_id:path}/posture",
    response_class=Response,
    responses={200: {"model": Posture}, **declared(NotFound)},
)
def get_posture(assessment_id: str, candidate_id: str, service: Service) -> Response:
    """Returns the predicted body along one candidate, for playing it back."""
    return _json(service.assessments.posture(assessment_id, candidate_id))
