"""How bad a posture or effort is: RULA, REBA, back angle, articular stress."""

from .errors import CostError, ErgonomicsError, PostureError, UnmeasuredError, WorksheetError
from .method_data import MethodData, method_data
from .reba import RebaResult, score_reba_worksheet
from .rula import RulaResult, score_rula_worksheet
from .rules import DEFAULT_RULES, ScoringRules
from .worksheet import score_worksheet

__all__ = [
    "DEFAULT_RULES",
    "CostError",
    "ErgonomicsError",
    "MethodData",
    "PostureError",
    "RebaResult",
    "RulaResult",
    "ScoringRules",
    "UnmeasuredError",
    "WorksheetError",
    "method_data",
    "score_reba_worksheet",
    "score_rula_worksheet",
    "score_worksheet",
]
