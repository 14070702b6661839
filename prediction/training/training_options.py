"""What can be chosen about a training."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

from prediction.chain import TASKS, Task
from prediction.errors import UnsupportedMethodError
from prediction.laws.kernels import KernelKind
from prediction.laws.methods import AUTO, BASELINES, CANDIDATES, method_class
from prediction.laws.mi_nsgp import MAX_SAMPLES
from prediction.search.law_search import Criterion, EngineName, SearchOptions, WeightKind
from prediction.search.weight_search import Optimizer


@dataclass(frozen=True, slots=True)
class TrainingOptions:
    """How to train.

    Attributes:
        method: The method to use by default, or ``auto``: the one of `CANDIDATES` that held-out
            parts of the demonstrations prefer. The baselines are always trained beside it.
        tasks: ``pose``, ``position`` or both; each is a model of its own.
        kernel: See `MiNsGp.fit`.
        optimizer: See `MiNsGp.fit`; the gradient climbs to the nearest optimum in a tenth of the
            time.
        engine: See `MiNsGp.fit`.
        criterion: See `MiNsGp.fit`; by default ``held-out``, because human motion repeats itself
            from sample to sample, and ``marginal`` with gpytorch, which has no other.
        weights: See `MiNsGp.fit`.
        max_evaluations: Budget of the weight search, per task.
        max_samples: Samples the likelihood is taken on; its cost grows with their cube.
        blocks: Parts the demonstrations are cut into to measure bands.
        baselines: Whether the baselines are trained beside the method: not where another model of
            the same demonstrations holds them.
    """

    method: str = AUTO
    tasks: tuple[Task, ...] = TASKS
    kernel: KernelKind = "separate"
    optimizer: Optimizer = "gradient"
    engine: EngineName = "fast"
    criterion: Criterion | None = None
    weights: WeightKind = "auto"
    max_evaluations: int = 10_000
    max_samples: int = MAX_SAMPLES
    blocks: int = 4
    baselines: bool = True

    def __post_init__(self) -> None:
        """Refuses what is not known."""
        if self.method != AUTO:
            method_class(self.method)
        for task in self.tasks:
            if task not in TASKS:
                raise UnsupportedMethodError("task", str(task), TASKS)
        SearchOptions(
            self.kernel,
            self.optimizer,
            self.engine,
            self.resolved_criterion,
            self.weights,
            self.max_evaluations,
        )

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
        return tuple(dict.fromkeys((*asked, *(BASELINES if self.baselines else ()))))

    def to_dict(self) -> dict[str, Any]:
        """Returns JSON values, the criterion as it is in effect."""
        return {**asdict(self), "tasks": list(self.tasks), "criterion": self.resolved_criterion}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Rebuilds options from `to_dict`.

        Raises:
            UnsupportedMethodError: A method or task is not known.
        """
        return cls(**{**values, "tasks": tuple(values["tasks"])})
