"""From demonstrations to an operator model."""

import hashlib
import json
import sys
from collections.abc import Mapping, MutableMapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from human import Chain
from human.threads import single_threaded
from prediction.chain import TASKS, Task, TaskChain
from prediction.demonstrations import SAMPLES_PER_JOINT, Demonstrations, find_reduction
from prediction.errors import ModelFileError
from prediction.following.familiarity import Familiarity
from prediction.following.joint_limits import JointLimits
from prediction.joint_costs import joint_costs, weights_in_words
from prediction.laws.gaussian_laws import WIk
from prediction.laws.hand_scatter import checked_sigma_x
from prediction.laws.joint_process import CcGp, Gp
from prediction.laws.methods import AUTO, METHODS, method_class
from prediction.laws.mi_nsgp import MiNsGp
from prediction.laws.predictor import Predictor, Progress, ShouldStop, check_stop
from prediction.model_file import VERSION, model_bytes, model_from_bytes
from prediction.operator_model import FittedMethod, OperatorModel, Skeleton
from prediction.search.law_search import WeightKind
from prediction.search.recall import Recall, Remember, ask
from prediction.training.choice import Choice, choose_method
from prediction.training.demonstration_check import check_demonstrations
from prediction.training.held_out import calibrate
from prediction.training.kept_samples import KeptSamples, TakeSource
from prediction.training.training_options import TrainingOptions

Array = NDArray[np.float64]

#: Samples W and kernel are searched on where a part is left out: a search from nothing on three
#: times as many gave the same errors to .02 deg and the same densities to .4 nats.
ANEW_SAMPLES = 300
#: Processor time of a fit beside that of Cov-IK, for the share done that is reported.
_WORK: Mapping[str, float] = {
    "mi-nsgp": 12.0,
    "nsgp": 4.0,
    "w-ik": 2.0,
    "gp": 3.0,
    "locov-ik": 4.0,
    "cc-gp": 4.0,
}


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
    *,
    start: Predictor | None = None,
    remember: Remember = ask,
) -> Predictor:
    """Fits one method on learned-joint demonstrations, with the options that concern it.

    ``start`` is the same method of the same joints, on fewer demonstrations.
    """
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
            start=start.law if isinstance(start, MiNsGp) else None,
            remember=remember,
        )
    return cls.fit(demonstrations, rng, progress=progress, should_stop=should_stop)


#: Laws with numbers that are searched, and that tell of the motion they were searched on.
_SEARCHED = (MiNsGp, CcGp, Gp, WIk)


def fit_anew(
    predictor: Predictor,
    part: Demonstrations,
    rng: np.random.Generator,
    options: TrainingOptions,
    should_stop: ShouldStop | None = None,
) -> Predictor:
    """Fits a method to a part of its demonstrations, so that the rest is new to it.

    W and kernel of `MiNsGp` are searched anew, from those of the whole and on `ANEW_SAMPLES`. Left
    as they were they would tell of the rest: on 19 s of real motion that made held-out roll-outs
    err x.79 of what they do, x.96 with the W of `WIk` and x.97 with the kernel of `CcGp`. The three
    numbers of `LoCovIk` stay, which made no difference there; the other laws have none.
    """
    enough = len(part) >= SAMPLES_PER_JOINT * len(part.joint_names)
    if not isinstance(predictor, _SEARCHED) or not enough:
        return predictor.refitted(part)
    if not isinstance(predictor, MiNsGp):
        return fit_predictor(predictor.name, part, rng, options, should_stop=should_stop)
    if options.criterion == "in-sample":
        return predictor.refitted(part)
    criterion = options.resolved_criterion
    weights: WeightKind = "diagonal" if predictor.law.correlation is None else "correlated"
    light = replace(
        options,
        optimizer="gradient",
        engine="fast",
        criterion="marginal" if criterion == "marginal" else "held-out",
        weights=weights,
        max_samples=min(options.max_samples, ANEW_SAMPLES),
    )
    found = fit_predictor(
        predictor.name, part, rng, light, should_stop=should_stop, start=predictor
    )
    return found.refitted(part)


@single_threaded
def train_operator(
    chain: TaskChain,
    demonstrations: Demonstrations,
    *,
    seed: int,
    options: TrainingOptions | None = None,
    metrics: Mapping[str, Any] | None = None,
    takes: Sequence[TakeSource] = (),
    sigma_x: Array | None = None,
    start: OperatorModel | None = None,
    kept: MutableMapping[str, bytes] | None = None,
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
        takes: Where each take came from, in their order.
        sigma_x: Scatter of the hand velocity about the commanded one, ``(m, m)``, to keep with the
            model; `learned_sigma_x` learns it where the command is known.
        start: A model of the same chain whose weights and kernel the search starts from.
        kept: Filled with what is finished. Given again with the same arguments after the training
            was broken off, the rest and what is damaged is done and the model is the same bit for
            bit. What is in it for other arguments is left alone.
        progress: Told what is being done, the share done and the log likelihood a sample.
        should_stop: Asked often.

    Returns:
        The operator model.

    Raises:
        DemonstrationError: The demonstrations cannot teach anything, or a take is there twice.
        TrainingCancelledError: ``should_stop`` said so.
    """
    options = TrainingOptions() if options is None else options
    samples = KeptSamples.of(demonstrations, takes)
    findings = check_demonstrations(chain, demonstrations)
    reduction = find_reduction(demonstrations)
    learned = demonstrations.reduced(reduction)
    learned.check_enough()
    limits = JointLimits(reduction.expansion, chain.lower, chain.upper)
    limits = limits.widened_to(demonstrations.q)
    q, rows = demonstrations.q, demonstrations.jacobian.shape[1]
    model = OperatorModel(
        methods={},
        method=options.method,
        reduction=reduction,
        familiarity=Familiarity.of(learned, options.blocks),
        demonstrated=np.stack([q.min(axis=0), q.max(axis=0)]),
        skeleton=Skeleton.of(chain) if isinstance(chain, Chain) else None,
        linear_rows=demonstrations.linear_rows,
        seed=seed,
        data_digest=data_digest(demonstrations),
        sigma_x=None if sigma_x is None else checked_sigma_x(sigma_x, rows),
    )
    job = _Job(chain, demonstrations, model, limits, options, start, should_stop)
    pieces = _Pieces(kept, model, _key(chain, demonstrations, seed, options, start))
    methods: dict[tuple[str, Task], FittedMethod] = {}
    jobs = [(task, name) for task in options.tasks for name in options.methods]
    total = sum(_WORK.get(name, 1.0) for _, name in jobs)
    done = 0.0
    for task, name in jobs:
        check_stop(should_stop)
        share = _WORK.get(name, 1.0) / total
        part = _Part(progress, done, share, f"{name} ({task})")
        fitted = pieces.get(name, task)
        if fitted is None:
            recall = pieces.recall(name, task)
            fitted = job.fit(name, task, recall or ask, part)
            pieces.put(name, task, fitted)
            if recall is not None:
                recall.forget()
        methods[name, task] = fitted
        done += share
    chosen = Choice(options.method, "asked for")
    if options.method == AUTO:
        held_out = {name: methods[name, options.tasks[0]].metrics for name in options.methods}
        chosen = choose_method(held_out)
    model = replace(
        model,
        methods=methods,
        method=chosen.method,
        metrics={} if metrics is None else dict(metrics),
        training={
            "options": options.to_dict(),
            "chosen_by": chosen.reason,
            "samples": len(demonstrations),
            "takes": len(samples.takes),
            "findings": [*findings, *_notes(methods, chosen.method)],
            "duration_s": sum(take.duration_s for take in samples.takes),
            "versions": _versions(),
        },
        samples=samples,
    )
    if (MiNsGp.name, options.tasks[0]) in methods:
        told = weights_in_words(joint_costs(model, MiNsGp.name, options.tasks[0]))
        model = replace(model, metrics={**model.metrics, "weights": told})
    # Products of matrices round differently in another memory layout. Through the file format and
    # back, the model in hand is bit for bit the one that will be loaded.
    model = model_from_bytes(model_bytes(model))
    if progress is not None:
        reached = model.fitted(task=options.tasks[0]).metrics["null_log_likelihood_training"]
        progress("done", 1.0, float(reached or 0.0))
    return model


def _notes(methods: Mapping[tuple[str, Task], FittedMethod], chosen: str) -> list[str]:
    """Returns what the chosen method says of its fits, each once."""
    said = [
        f"{name}: {note}"
        for (name, _), fitted in methods.items()
        if name == chosen
        for note in fitted.predictor.notes
    ]
    return list(dict.fromkeys(said))


@dataclass(frozen=True, slots=True)
class _Job:
    """All that the fits of one training have in common."""

    chain: TaskChain
    demonstrations: Demonstrations
    model: OperatorModel
    limits: JointLimits
    options: TrainingOptions
    start: OperatorModel | None
    should_stop: ShouldStop | None

    def fit(self, name: str, task: Task, remember: Remember, progress: "_Part") -> FittedMethod:
        """Fits one method for one task and measures its bands."""
        # a generator of its own: the order of methods must not change any of them
        rng = np.random.default_rng([self.model.seed, TASKS.index(task), list(METHODS).index(name)])
        demonstrations = self.demonstrations.for_task(task)
        learned = demonstrations.reduced(self.model.reduction)
        predictor = fit_predictor(
            name,
            learned,
            rng,
            self.options,
            progress.first_half,
            self.should_stop,
            start=self._start(name, task),
            remember=remember,
        )
        learns = name == MiNsGp.name and self.options.weights != "identity"
        if learns and isinstance(predictor, MiNsGp):
            predictor = predictor.with_interval(learned, self.options.resolved_criterion)
        q, xdot, qdot, J = learned.q, learned.xdot, learned.qdot, learned.jacobian
        reached = float(predictor.log_prob(q, xdot, qdot, J, np.eye(J.shape[1])).null_space.mean())
        progress.tell("measuring its bands", 0.5, reached)
        calibration = calibrate(
            predictor,
            demonstrations,
            self.chain,
            self.model.reduction,
            self.limits,
            task,
            rng,
            blocks=self.options.blocks,
            refit=lambda part: fit_anew(predictor, part, rng, self.options, self.should_stop),
            should_stop=self.should_stop,
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
            "band_clock": calibration.band.clock,
        }
        predictor = predictor.rescaled(calibration.variance_factor)
        predictor = predictor.with_tails(calibration.degrees)
        return FittedMethod(predictor, calibration.band, metrics, calibration.memory)

    def _start(self, name: str, task: Task) -> Predictor | None:
        """Returns what the search may set out from: the same method of the same joints."""
        if self.start is None or (name, task) not in self.start.methods:
            return None
        same = self.start.reduction.kept_names == self.model.reduction.kept_names
        same &= self.start.training["options"]["kernel"] == self.options.kernel
        return self.start.fitted(name, task).predictor if same else None


@dataclass(frozen=True, slots=True)
class _Pieces:
    """Finished fits, each kept as a model file that holds nothing else."""

    kept: MutableMapping[str, bytes] | None
    model: OperatorModel
    key: str

    def get(self, name: str, task: Task) -> FittedMethod | None:
        if self.kept is None or self._name(name, task) not in self.kept:
            return None
        try:
            return model_from_bytes(self.kept[self._name(name, task)]).fitted(name, task)
        except ModelFileError:
            return None  # damaged: it is done again

    def put(self, name: str, task: Task, fitted: FittedMethod) -> None:
        if self.kept is not None:
            alone = replace(self.model, methods={(name, task): fitted}, method=name)
            self.kept[self._name(name, task)] = model_bytes(alone)

    def recall(self, name: str, task: Task) -> Recall | None:
        return None if self.kept is None else Recall(self.kept, f"{self._name(name, task)}-search")

    def _name(self, name: str, task: Task) -> str:
        return f"{self.key}-{task}-{name}"


def _key(
    chain: TaskChain,
    demonstrations: Demonstrations,
    seed: int,
    options: TrainingOptions,
    start: OperatorModel | None,
) -> str:
    """Returns a digest of all that a training's outcome depends on."""
    values = {
        "options": options.to_dict(),
        "seed": seed,
        "version": VERSION,
        "versions": _versions(),
        "linear_rows": demonstrations.linear_rows,
        "data": data_digest(demonstrations),
        "start": None if start is None else hashlib.sha256(model_bytes(start)).hexdigest(),
    }
    digest = hashlib.sha256(json.dumps(values, sort_keys=True).encode())
    for array in (
        demonstrations.jacobian,
        demonstrations.trajectory_id,
        chain.lower,
        chain.upper,
    ):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]


def _versions() -> dict[str, str]:
    return {
        "python": ".".join(map(str, sys.version_info[:3])),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
    }


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
