"""The cost by which trajectories are ranked: a named sum of named parts, all of it data.

A cost is worked out for each posture sample by itself, over time, so that the ranking can compare
candidates sample by sample. Lower is better throughout.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import CostError
from .timeline import dose, time_mean, time_quantile

Floats = NDArray[np.float64]
Aggregation = Literal["mean", "p90", "max", "dose"]


@dataclass(frozen=True, slots=True)
class CostPart:
    """One term of a cost.

    Attributes:
        name: Of the term.
        quantity: What is summed up over time, a key of the quantities given.
        unit: Of the aggregated value.
        aggregation: ``mean`` or ``p90`` by time, ``max``, or ``dose`` (integral over time).
        zero: Value that costs nothing.
        full: Value that costs the whole weight; the scale is linear and does not stop there.
        weight: Share in the total.
    """

    name: str
    quantity: str
    unit: str
    aggregation: Aggregation
    zero: float
    full: float
    weight: float

    def __post_init__(self) -> None:
        """Refuses a term under which a worse posture would cost less.

        Raises:
            CostError: If the weight is negative, the scale empty or the aggregation unknown.
        """
        if self.aggregation not in get_args(Aggregation):
            raise CostError(
                f"part {self.name!r}: aggregation is {self.aggregation!r}, expected one of "
                f"{get_args(Aggregation)}"
            )
        if not (np.isfinite(self.weight) and self.weight >= 0.0 and self.full > self.zero):
            raise CostError(
                f"part {self.name!r}: expected weight of 0 or more and full above zero, got "
                f"weight {self.weight}, zero {self.zero}, full {self.full}"
            )


@dataclass(frozen=True, slots=True)
class CostDefinition:
    """A named cost."""

    name: str
    parts: tuple[CostPart, ...]

    def to_dict(self) -> dict[str, Any]:
        """Returns the definition as JSON-ready values."""
        return {
            "name": self.name,
            "direction": "lower is better",
            "parts": [
                {
                    "name": p.name,
                    "quantity": p.quantity,
                    "unit": p.unit,
                    "aggregation": p.aggregation,
                    "zero": p.zero,
                    "full": p.full,
                    "weight": p.weight,
                }
                for p in self.parts
            ],
        }


#: Posture counts for 0.6, the back for 0.1, effort for 0.3. RULA runs from 1 to 7; 60 degrees is
#: where trunk flexion enters its last band; effort counts in shares of ``REFERENCE_MOMENT_NM`` at
#: the joint that works hardest. The weights are a choice of ours: replace them by your own.
DEFAULT_COST = CostDefinition(
    "posture-and-effort",
    (
        CostPart("rula_mean", "rula", "score", "mean", 1.0, 7.0, 0.4),
        CostPart("rula_p90", "rula", "score", "p90", 1.0, 7.0, 0.2),
        CostPart("back_angle_mean", "back_angle_deg", "deg", "mean", 0.0, 60.0, 0.1),
        CostPart("effort_mean", "effort_share", "share of reference", "mean", 0.0, 1.0, 0.2),
        CostPart("effort_max", "effort_share", "share of reference", "max", 0.0, 1.0, 0.1),
    ),
)


@dataclass(frozen=True, slots=True)
class CostSamples:
    """A cost of one candidate, sample by sample.

    Attributes:
        definition: What was summed.
        total: ``(samples,)``.
        values: Aggregated value of each part, ``(samples,)``, in the part's unit.
    """

    definition: CostDefinition
    total: Floats
    values: Mapping[str, Floats]

    def to_dict(self) -> dict[str, Any]:
        """Returns means over the samples as JSON-ready values."""
        return {
            "name": self.definition.name,
            "total": float(self.total.mean()),
            "parts": [
                {
                    "name": part.name,
                    "value": float(self.values[part.name].mean()),
                    "unit": part.unit,
                    "weight": part.weight,
                    "contribution": float(_scaled(part, self.values[part.name]).mean()),
                    "aggregation": part.aggregation,
                    "direction": "lower is better",
                }
                for part in self.definition.parts
            ],
        }


def cost_samples(
    quantities: Mapping[str, ArrayLike],
    time_s: ArrayLike,
    definition: CostDefinition = DEFAULT_COST,
) -> CostSamples:
    """Works out a cost for every posture sample of one candidate.

    Args:
        quantities: ``(samples, frames)`` by name; one without a sample axis counts for all.
        time_s: ``(frames,)`` seconds.
        definition: The terms.

    Raises:
        CostError: If a quantity of the definition is missing or its shape does not fit.
        PostureError: If a value is not finite or the times do not increase.
    """
    missing = sorted({p.quantity for p in definition.parts} - set(quantities))
    if missing:
        raise CostError(f"cost {definition.name!r} needs {', '.join(missing)}, which is not given")
    arrays = {
        p.quantity: np.asarray(quantities[p.quantity], dtype=np.float64) for p in definition.parts
    }
    samples = {len(array) for array in arrays.values() if array.ndim == 2}
    if len(samples) > 1 or any(array.ndim not in (1, 2) for array in arrays.values()):
        shapes = {name: array.shape for name, array in arrays.items()}
        raise CostError(f"expected (samples, frames) with the same samples, got {shapes}")
    count = samples.pop() if samples else 1
    values = {
        part.name: np.broadcast_to(
            _aggregated(part.aggregation, arrays[part.quantity], time_s), (count,)
        )
        for part in definition.parts
    }
    total = sum((_scaled(part, values[part.name]) for part in definition.parts), np.zeros(count))
    return CostSamples(definition, total, values)


def _aggregated(aggregation: Aggregation, values: Floats, time_s: ArrayLike) -> Floats:
    if aggregation == "mean":
        return time_mean(values, time_s)
    if aggregation == "p90":
        return time_quantile(values, time_s, 0.9)
    if aggregation == "dose":
        return dose(values, time_s)
    time_mean(values, time_s)  # the checks of shape, times and finiteness
    greatest: Floats = values.max(axis=-1)
    return greatest


def _scaled(part: CostPart, value: Floats) -> Floats:
    return part.weight * (value - part.zero) / (part.full - part.zero)
