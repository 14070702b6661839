"""How bad a posture or effort is: RULA, REBA, back angle, articular stress."""

from .angles import SIDES, ArmAngles, PostureAngles, Side, posture_angles
from .back_angle import BACK_JOINTS, BackAngle, BackDose, back_angle, back_dose
from .blame import reba_blame, rula_blame
from .cost import DEFAULT_COST, CostDefinition, CostPart, CostSamples, cost_samples
from .distribution import ScoreDistribution, score_distribution
from .effort import REFERENCE_MOMENT_NM, effort_l2, effort_quantiles, effort_share, moment_norm
from .errors import CostError, ErgonomicsError, PostureError, UnmeasuredError, WorksheetError
from .evidence import Evidence
from .expected import reba_pmf, rula_pmf
from .inputs import DEFAULT_THRESHOLDS, reba_inputs, rula_inputs, with_effects
from .method_data import MethodData, method_data
from .ranking import RankedCandidate, rank_candidates
from .reba import RebaResult, score_reba_worksheet
from .reba_arrays import (
    RebaInputs,
    RebaInterval,
    RebaScores,
    explain_reba,
    score_reba,
    score_reba_interval,
    score_reba_with,
)
from .rula import RulaResult, score_rula_worksheet
from .rula_arrays import (
    RulaInputs,
    RulaInterval,
    RulaScores,
    explain_rula,
    score_rula,
    score_rula_interval,
    score_rula_with,
)
from .rules import DEFAULT_RULES, ScoringRules
from .task import Assumption, SecondaryThresholds, TaskContext
from .timeline import TimeSummary, dose, summarise, time_mean, time_quantile, time_share
from .worksheet import score_worksheet
from .worst import WorstMoment, frame_inputs, worst_moments

__all__ = [
    "BACK_JOINTS",
    "DEFAULT_COST",
    "DEFAULT_RULES",
    "DEFAULT_THRESHOLDS",
    "REFERENCE_MOMENT_NM",
    "SIDES",
    "ArmAngles",
    "Assumption",
    "BackAngle",
    "BackDose",
    "CostDefinition",
    "CostError",
    "CostPart",
    "CostSamples",
    "ErgonomicsError",
    "Evidence",
    "MethodData",
    "PostureAngles",
    "PostureError",
    "RankedCandidate",
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
    "TimeSummary",
    "UnmeasuredError",
    "WorksheetError",
    "WorstMoment",
    "back_angle",
    "back_dose",
    "cost_samples",
    "dose",
    "effort_l2",
    "effort_quantiles",
    "effort_share",
    "explain_reba",
    "explain_rula",
    "frame_inputs",
    "method_data",
    "moment_norm",
    "posture_angles",
    "rank_candidates",
    "reba_blame",
    "reba_inputs",
    "reba_pmf",
    "rula_blame",
    "rula_inputs",
    "rula_pmf",
    "score_distribution",
    "score_reba",
    "score_reba_interval",
    "score_reba_with",
    "score_reba_worksheet",
    "score_rula",
    "score_rula_interval",
    "score_rula_with",
    "score_rula_worksheet",
    "score_worksheet",
    "summarise",
    "time_mean",
    "time_quantile",
    "time_share",
    "with_effects",
    "worst_moments",
]
