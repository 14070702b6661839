"""How bad a posture or effort is: RULA, REBA, back angle, articular stress."""

from .angles import SIDES, ArmAngles, PostureAngles, Side, posture_angles
from .distribution import ScoreDistribution, score_distribution
from .errors import CostError, ErgonomicsError, PostureError, UnmeasuredError, WorksheetError
from .evidence import Evidence
from .expected import reba_pmf, rula_pmf
from .inputs import DEFAULT_THRESHOLDS, reba_inputs, rula_inputs, with_effects
from .method_data import MethodData, method_data
from .reba import RebaResult, score_reba_worksheet
from .reba_arrays import (
    RebaInputs,
    RebaInterval,
    RebaScores,
    explain_reba,
    score_reba,
    score_reba_interval,
)
from .rula import RulaResult, score_rula_worksheet
from .rula_arrays import (
    RulaInputs,
    RulaInterval,
    RulaScores,
    explain_rula,
    score_rula,
    score_rula_interval,
)
from .rules import DEFAULT_RULES, ScoringRules
from .task import Assumption, SecondaryThresholds, TaskContext
from .worksheet import score_worksheet

__all__ = [
    "DEFAULT_RULES",
    "DEFAULT_THRESHOLDS",
    "SIDES",
    "ArmAngles",
    "Assumption",
    "CostError",
    "ErgonomicsError",
    "Evidence",
    "MethodData",
    "PostureAngles",
    "PostureError",
    "RebaInputs",
    "RebaInterval",
    "RebaResult",
    "RebaScores",
    "RulaInputs",
    "RulaInterval",
    "RulaResult",
    "RulaScores",
    "ScoreDistribution",
    "ScoringRules",
    "SecondaryThresholds",
    "Side",
    "TaskContext",
    "UnmeasuredError",
    "WorksheetError",
    "explain_reba",
    "explain_rula",
    "method_data",
    "posture_angles",
    "reba_inputs",
    "reba_pmf",
    "rula_inputs",
    "rula_pmf",
    "score_distribution",
    "score_reba",
    "score_reba_interval",
    "score_reba_worksheet",
    "score_rula",
    "score_rula_interval",
    "score_rula_worksheet",
    "score_worksheet",
    "with_effects",
]
