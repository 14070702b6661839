"""Scores worksheets with ``ergonomics``."""

from collections.abc import Mapping
from typing import Any

from app.problems import Fault, InvalidRequest, pointer, shorten
from app.worksheets.schemas import Method
from ergonomics import WorksheetError
from ergonomics import score_worksheet as score_document


def score_worksheet(
    method: Method, document: Any, place: tuple[str | int, ...] = ()
) -> dict[str, Any]:
    """Scores one worksheet.

    Args:
        method: Which sheet it is.
        document: The parsed JSON: ``input`` and options.
        place: Where the worksheet stands in the request, for error messages.

    Returns:
        Every intermediate score, the reasons, and the conventions used.

    Raises:
        InvalidRequest: The document holds something that cannot be scored.
    """
    try:
        result = score_document(method, document).to_dict()
    except WorksheetError as error:
        where = pointer(*place) + error.pointer
        fault = Fault(where, error.expected, shorten(error.got), "not what the sheet takes")
        raise InvalidRequest(
            f"The worksheet cannot be scored at {where or '/'}.", [fault]
        ) from error
    identifier = document.get("id") if isinstance(document, Mapping) else None
    return result if identifier is None else {**result, "id": identifier}
