"""Routes that score one worksheet."""

from typing import Annotated, Any

from fastapi import APIRouter, Body
from pydantic import WithJsonSchema

from app.problem_handlers import declared
from app.problems import InvalidRequest
from app.worksheets.schemas import Method, Worksheet, WorksheetResult
from app.worksheets.service import score_worksheet

router = APIRouter(prefix="/v1/worksheets", tags=["worksheets"])

_Document = Annotated[Any, Body(), WithJsonSchema(Worksheet.model_json_schema())]


@router.post(
    "/{method}",
    response_model=WorksheetResult,
    response_model_exclude_unset=True,
    responses=declared(InvalidRequest),
)
def score(method: Method, worksheet: _Document) -> dict[str, Any]:
    """Scores a RULA or REBA worksheet, with every intermediate value and its reason."""
    return score_worksheet(method, worksheet)
