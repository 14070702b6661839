"""A whole worksheet document, as a file or a request brings it: input, options, and a result."""

from collections.abc import Mapping
from typing import Any

from .errors import WorksheetError
from .method_data import Method
from .reba import RebaResult, reba_from_checked
from .rula import RulaResult, rula_from_checked
from .rules import ScoringRules
from .worksheet_schema import checked_worksheet, escaped

_OPTIONS = ("profile", "ties", "neutral_tolerance_deg")
#: Keys that describe a worked case and change nothing in its score.
_DESCRIPTION = ("id", "name", "note", "expected", "agreed_by")


def score_worksheet(method: Method, document: object) -> RulaResult | RebaResult:
    """Scores a document ``{"input": ..., "profile", "ties", "neutral_tolerance_deg"}``.

    Use this where a document comes from outside; ``score_rula_worksheet`` where the input and
    the options are already apart.

    Args:
        method: ``rula`` or ``reba``; a ``method`` in the document must say the same.
        document: The parsed JSON. ``input`` is required; ``id``, ``name``, ``note``,
            ``expected`` and ``agreed_by`` may stand there and are not read.

    Raises:
        WorksheetError: At the first thing that cannot be scored; the pointer starts at the
            document.
    """
    if not isinstance(document, Mapping):
        raise WorksheetError(
            "", "an object with input, and perhaps " + ", ".join(_OPTIONS), document
        )
    for key in document:
        if key not in ("input", "method", *_OPTIONS, *_DESCRIPTION):
            raise WorksheetError(
                f"/{escaped(key)}", "only input, method, " + ", ".join(_OPTIONS), document[key]
            )
    if document.get("method", method) != method:
        raise WorksheetError("/method", repr(method), document["method"])
    if "input" not in document:
        raise WorksheetError("/input", f"the {method.upper()} worksheet", None)
    options: dict[str, Any] = {key: document[key] for key in _OPTIONS if key in document}
    rules = ScoringRules(**options)
    sheet = checked_worksheet(method, document["input"], "/input")
    return rula_from_checked(sheet, rules) if method == "rula" else reba_from_checked(sheet, rules)
