"""From demonstrations to an operator model."""

import hashlib
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from human import Chain, Motion
from human.threads import single_threaded
from prediction.chain import TASKS, JointReduction, Task, TaskChain
from prediction.choice import Choice, choose_method
from prediction.demonstrations import (
    Demonstrations,
    demonstrations_from_samples,
    find_reduction,
)
from prediction.errors import DemonstrationError, UnsupportedMethodError
from prediction.familiarity import Familiarity
from prediction.held_out import calibrate
from prediction.joint_limits import JointLimits
from prediction.kernels import KernelKind
from prediction.law_search import Criterion, EngineName, WeightKind
from prediction.methods import AUTO, BASELINES, CANDIDATES, METHODS, method_class
from prediction.mi_nsgp import MAX_SAMPLES, MiNsGp
from prediction.model_file import model_bytes, model_from_bytes
from prediction.operator_model import FittedMethod, OperatorModel, Skeleton
from prediction.predictor import Predictor, Progress, ShouldStop, check_stop
from prediction.weight_search import Optimizer

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TrainingOptions:
    """How to train.

    Attributes:
        method: The method to use by default, or ``auto``: the one of `CANDIDATES` that held-out
            parts of the demonstrations prefer. The baselines are always trained beside it.
        tasks: ``pose``, ``position`` or both; each is a model of its own.
        kernel: See `MiNsGp.fit`.
        optimizer: See `MiNsGp.fit`.
        engine: See `MiNsGp.fit`.
        criterion: See `MiNsGp.fit`; by default ``held-out``, because human motion repeats itself
            from sample to sample, and ``marginal`` with gpytorch, which has no other.
        weights: See `MiNsGp.fit`.
        max_evaluations: Budget of the weight search, per task.
        max_samples: Samples the likelihood is taken on; its cost grows with their cube.
        blocks: Parts the demonstrations are cut into to measure bands.
    """

    method: str = AUTO
    tasks: tuple[Task, ...] = TASKS
    kernel: KernelKind = "separate"
    optimizer: Optimizer = "bipop"
    engine: EngineName = "fast"
    criterion: Criterion | None = None
    weights: WeightKind = "auto"
    max_evaluations: int = 3000
    max_samples: int = MAX_SAMPLES
    blocks: int = 4

    def __post_init__(self) -> None:
        """Refuses what is not known."""
        if self.method != AUTO:
            method_class(self.method)
        for task in self.tasks:
            if task not in TASKS:
                raise UnsupportedMethodError("task", str(task), TASKS)

    @property
    def resolved_criterion(self) -> Criterion:
        """The criterion in effect."""
        if self.criterion is not None:
            return self.criterion
        return "marginal" if self.engine == "gpytorch" else "held-out"

    @property
    def methods(self) -> tuple[str, ...]:
        """Methods trained: the chosen one or the candidates, and the baselines."""
        asked = CANDIDATES if self.method == AUTO else (self.method,)
        return tuple(dict.fromkeys((*asked, *BASELINES)))


def demonstrations_from_motion(
    chain: Chain, motion: Motion, *, trajectory_id: int = 0, rate_hz: float = 60.0
) -> Demonstrations:
    """Takes the chain's joints out of a motion of the same model.

    The pelvis may move: the chain is seen from it, so hand velocities are relative to it. Frames
    flagged ``weak_derivative`` are left out: their velocities are not measured (a lone frame
    between gaps has zeros), and a person at rest is not what was seen.

    Args:
        chain: The chain.
        motion: A motion whose joints are those of the chain's model.
        trajectory_id: Number of the take.
        rate_hz: Frames are thinned evenly to at most this rate.

    Returns:
        The demonstrations.

    Raises:
        DemonstrationError: The motion lacks joints of the chain, or is too short.
    """
    known = {name: index for index, name in enumerate(motion.model_dof_names)}
    missing = [name for name in chain.dof_names if name not in known]
    if missing:
        raise DemonstrationError(f"the motion lacks the joints {', '.join(missing)}")
    columns = [known[name] for name in chain.dof_names]
    if len(motion.time_s) < 2:
        raise DemonstrationError("the motion has fewer than two frames")
    typical = float(np.median(np.diff(motion.time_s)))
    stride = max(1, int(np.floor(1.0 / (rate_hz * typical) + 1e-6)))
    frames = np.arange(0, len(motion.time_s), stride)
    weak = motion.flags.get("weak_derivative")
    if weak is not None:
        frames = frames[~weak[frames]]
        if len(frames) == 0:
            raise DemonstrationError(
                "no stretch of the motion is long enough between its gaps to tell velocities"
            )
    return demonstrations_from_samples(
        chain,
        motion.joint_angles[frames][:, columns],
        motion.joint_rates[frames][:, columns],
        motion.time_s[frames],
        np.full(len(frames), trajectory_id, dtype=np.int64),
    )


def data_digest(demonstrations: Demonstrations) -> str:
    """Returns the SHA-256 of joint names, postures, velocities and times."""
    digest = hashlib.sha256("\n".join(demonstrations.joint_names).encode())
    for array in (demonstrations.q, demonstrations.qdot, demonstrations.time_s):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def fit_predictor(
    name: str,
    demonstrations: Demonstrations,
    rng: np.random.Generator,
    options: TrainingOptions,
    progress: Progress | None = None,
    should_stop: ShouldStop | None = None,
) -> Predictor:
    """Fits one method on learned-joint demonstrations, with the options that concern it."""
    cls = method_class(name)
    if issubclass(cls, MiNsGp):
        return cls.fit(
            demonstrations,
            rng,
            progress=progress,
            should_stop=should_stop,
            kernel=options.kernel,
            optimizer=options.optimizer,
            engine=options.engine,
            criterion=options.resolved_criterion,
            weights=options.weights if cls is MiNsGp else None,
            max_evaluations=options.max_evaluations,
            max_samples=options.max_samples,
        )
    return cls.fit(demonstrations, rng, progress=progress, should_stop=should_stop)


@single_threaded
def train_operator(
    chain: TaskChain,
    demonstrations: Demonstrations,
    *,
    seed: int,
    options: TrainingOptions | None = None,
    metrics: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
    should_stop: ShouldStop | None = None,
) -> OperatorModel:
    """Trains the chosen method and the baselines, and measures their bands.

    Args:
        chain: The chain the demonstrations are of; the skeleton is kept if it is a `human.Chain`.
        demonstrations: All its joints.
        seed: Seed of all randomness: same demonstrations, options and seed, same model.
        options: How.
        metrics: Held-out comparison to keep with the model; see `compare_methods`.
        progress: Told what is being done, the share done and the log likelihood a sample.
        should_stop: Asked often.

    Returns:
        The operator model.

    Raises:
        DemonstrationError: The demonstrations cannot teach anything.
        TrainingCancelledError: ``should_stop`` said so.
    """
    options = TrainingOptions() if options is None else options
    reduction = find_reduction(demonstrations)
    learned = demonstrations.reduced(reduction)
    learned.check_enough()
    limits = JointLimits(reduction.expansion, chain.lower, chain.upper)
    limits = limits.widened_to(demonstrations.q)
    methods: dict[tuple[str, Task], FittedMethod] = {}
    jobs = [(task, name) for task in options.tasks for name in options.methods]
    for number, (task, name) in enumerate(jobs):
        check_stop(should_stop)
        part = _Part(progress, number / len(jobs), 1.0 / len(jobs), f"{name} ({task})")
        methods[name, task] = _train_one(
            name,
            demonstrations.for_task(task),
            chain,
            reduction,
            limits,
            task,
            # a generator of its own: the order of methods must not change any of them
            np.random.default_rng([seed, TASKS.index(task), list(METHODS).index(name)]),
            options,
            part,
            should_stop,
        )
    q = demonstrations.q
    chosen = Choice(options.method, "asked for")
    if options.method == AUTO:
        held_out = {name: methods[name, options.tasks[0]].metrics for name in options.methods}
        chosen = choose_method(held_out)
    model = OperatorModel(
        methods=methods,
        method=chosen.method,
        reduction=reduction,
        familiarity=Familiarity.of(learned, options.blocks),
        demonstrated=np.stack([q.min(axis=0), q.max(axis=0)]),
        skeleton=Skeleton.of(chain) if isinstance(chain, Chain) else None,
        linear_rows=demonstrations.linear_rows,
        seed=seed,
        data_digest=data_digest(demonstrations),
        metrics={} if metrics is None else dict(metrics),
        training={
            "options": {
                "method": options.method,
                "tasks": list(options.tasks),
                "kernel": options.kernel,
                "optimizer": options.optimizer,
                "engine": options.engine,
                "criterion": options.resolved_criterion,
                "weights": options.weights,
                "max_evaluations": options.max_evaluations,
                "max_samples": options.max_samples,
                "blocks": options.blocks,
            },
            "chosen_by": chosen.reason,
            "samples": len(demonstrations),
            "takes": len(np.unique(demonstrations.trajectory_id)),
            "duration_s": _duration(demonstrations),
            "versions": {
                "python": ".".join(map(str, sys.version_info[:3])),
                "numpy": np.__version__,
            },
        },
    )
    # Products of matrices round differently in another memory layout. Through the file format and
    # back, the model in hand is bit for bit the one that will be loaded.
    model = model_from_bytes(model_bytes(model))
    if progress is not None:
        reached = model.fitted(task=options.tasks[0]).metrics["null_log_likelihood_training"]
        progress("done", 1.0, float(reached or 0.0))
    return model


def _train_one(
    name: str,
    demonstrations: Demonstrations,
    chain: TaskChain,
    reduction: JointReduction,
    limits: JointLimits,
    task: Task,
    rng: np.random.Generator,
    options: TrainingOptions,
    progress: "_Part",
    should_stop: ShouldStop | None,
) -> FittedMethod:
    learned = demonstrations.reduced(reduction)
    predictor = fit_predictor(name, learned, rng, options, progress.first_half, should_stop)
    q, xdot, qdot, J = learned.q, learned.xdot, learned.qdot, learned.jacobian
    reached = float(predictor.log_prob(q, xdot, qdot, J, np.eye(J.shape[1])).null_space.mean())
    progress.tell("measuring its bands", 0.5, reached)
    calibration = calibrate(
        predictor,
        demonstrations,
        chain,
        reduction,
        limits,
        task,
        rng,
        blocks=options.blocks,
        should_stop=should_stop,
    )
    metrics = {
        "null_log_likelihood_training": reached,
        "variance_factor": calibration.variance_factor,
        "coverage90_one_step_before": calibration.coverage_one_step[0],
        "coverage90_one_step_after": calibration.coverage_one_step[1],
        "coverage90_rollout_before": calibration.coverage_rollout,
        "rollout_rmse_deg_held_out": calibration.rollout_rmse_deg,
        "null_log_likelihood_held_out": calibration.null_log_likelihood,
        "band_length": calibration.band.length,
    }
    return FittedMethod(predictor.rescaled(calibration.variance_factor), calibration.band, metrics)


def _duration(demonstrations: Demonstrations) -> float:
    same = np.diff(demonstrations.trajectory_id) == 0
    return float(np.diff(demonstrations.time_s)[same].sum())


@dataclass(frozen=True, slots=True)
class _Part:
    """Progress of one job among several."""

    progress: Progress | None
    start: float
    share: float
    label: str

    def tell(self, what: str, done: float, likelihood: float) -> None:
        if self.progress is not None:
            self.progress(f"{self.label}: {what}", self.start + self.share * done, likelihood)

    def first_half(self, what: str, done: float, likelihood: float) -> None:
        self.tell(what, 0.5 * min(done, 1.0), likelihood)


def with_method(model: OperatorModel, method: str) -> OperatorModel:
    """Returns the model with another of its methods as the chosen one.

    Raises:
        UnsupportedMethodError: It was not trained.
    """
    if method not in model.method_names:
        raise UnsupportedMethodError("method", method, model.method_names)
    return replace(model, method=method)
