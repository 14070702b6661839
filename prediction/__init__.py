"""The postures one operator will take when a robot leads their hand."""

from prediction.chain import JointReduction, Task, TaskChain
from prediction.comparison.evaluate import (
    HORIZONS_S,
    MethodScore,
    compare_methods,
    score_method,
    scores_to_dict,
    split_in_time,
)
from prediction.comparison.paired import (
    PAPERS_WAY,
    PairedRow,
    SplitScores,
    compare_on_splits,
    paired_table,
)
from prediction.comparison.reaches import Reaches, find_reaches
from prediction.comparison.splits import Split, splits_by_primitive, splits_by_reach, splits_of
from prediction.demonstrations import (
    Demonstrations,
    demonstrations_from_samples,
    find_reduction,
    join,
)
from prediction.errors import (
    DemonstrationError,
    DiscontinuousTrajectoryError,
    ModelFileError,
    PredictionError,
    StartMismatchError,
    TrainingCancelledError,
    TrajectoryError,
    UnreachableTrajectoryError,
    UnsupportedMethodError,
)
from prediction.following.familiarity import Familiarity
from prediction.following.hand_noise import HandNoise
from prediction.following.hand_path import HandPath
from prediction.following.joint_limits import JointLimits
from prediction.following.posture_band import PostureBand
from prediction.following.rollout import Follower, Rollout
from prediction.joint_costs import JointCosts, joint_costs
from prediction.laws.cov_ik import CovIk
from prediction.laws.gaussian_laws import MinimumNormIk, SbM, WIk
from prediction.laws.hand_scatter import learned_sigma_x
from prediction.laws.joint_process import CcGp, Gp
from prediction.laws.locov_ik import LoCovIk
from prediction.laws.memory import NullSpaceMemory
from prediction.laws.methods import BASELINES, METHODS
from prediction.laws.mi_nsgp import MiNsGp, NsGp
from prediction.laws.null_space import NullSpaceBasis
from prediction.laws.predictor import LogDensity, Prediction, Predictor, Previous
from prediction.laws.promp import ProMp
from prediction.led_chain import BASES, HANDS, Base, Hand, led_chain
from prediction.model_file import load_model, model_bytes, model_from_bytes, save_model
from prediction.operator_model import FittedMethod, OperatorModel, Skeleton
from prediction.training.add_demonstrations import (
    add_demonstrations,
    check_same_person,
    options_of,
    with_earlier,
)
from prediction.training.demonstration_check import check_demonstrations
from prediction.training.generic import generic_operator
from prediction.training.held_out import Stretches, run_held_out
from prediction.training.kept_samples import KeptSamples, KeptTake, TakeSource
from prediction.training.motion_check import motion_findings
from prediction.training.motion_demonstrations import demonstrations_from_motion
from prediction.training.standing import standing_frames
from prediction.training.train import train_operator
from prediction.training.training_options import TrainingOptions

__all__ = [
    "BASELINES",
    "BASES",
    "HANDS",
    "HORIZONS_S",
    "METHODS",
    "PAPERS_WAY",
    "Base",
    "CcGp",
    "CovIk",
    "DemonstrationError",
    "Demonstrations",
    "DiscontinuousTrajectoryError",
    "Familiarity",
    "FittedMethod",
    "Follower",
    "Gp",
    "Hand",
    "HandNoise",
    "HandPath",
    "JointCosts",
    "JointLimits",
    "JointReduction",
    "KeptSamples",
    "KeptTake",
    "LoCovIk",
    "LogDensity",
    "MethodScore",
    "MiNsGp",
    "MinimumNormIk",
    "ModelFileError",
    "NsGp",
    "NullSpaceBasis",
    "NullSpaceMemory",
    "OperatorModel",
    "PairedRow",
    "PostureBand",
    "Prediction",
    "PredictionError",
    "Predictor",
    "Previous",
    "ProMp",
    "Reaches",
    "Rollout",
    "SbM",
    "Skeleton",
    "Split",
    "SplitScores",
    "StartMismatchError",
    "Stretches",
    "TakeSource",
    "Task",
    "TaskChain",
    "TrainingCancelledError",
    "TrainingOptions",
    "TrajectoryError",
    "UnreachableTrajectoryError",
    "UnsupportedMethodError",
    "WIk",
    "add_demonstrations",
    "check_demonstrations",
    "check_same_person",
    "compare_methods",
    "compare_on_splits",
    "demonstrations_from_motion",
    "demonstrations_from_samples",
    "find_reaches",
    "find_reduction",
    "generic_operator",
    "join",
    "joint_costs",
    "learned_sigma_x",
    "led_chain",
    "load_model",
    "model_bytes",
    "model_from_bytes",
    "motion_findings",
    "options_of",
    "paired_table",
    "run_held_out",
    "save_model",
    "score_method",
    "scores_to_dict",
    "split_in_time",
    "splits_by_primitive",
    "splits_by_reach",
    "splits_of",
    "standing_frames",
    "train_operator",
    "with_earlier",
]
