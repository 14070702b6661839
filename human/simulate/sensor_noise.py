"""What real sensors add to the truth: noise, an offset drawn once a run, a limit, lost frames."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from human.simulate.errors import SimulationError

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """How one kind of sensor errs, in its own unit; numbers or one for each of its channels.

    Attributes:
        sd: of the white noise of each sample.
        offset_sd: of the constant offset, drawn once a sensor and run.
        limit: largest reading either way; beyond it the sensor saturates.

    Raises:
        SimulationError: a negative number, or one that is not finite (but for the limit).
    """

    sd: ArrayLike = 0.0
    offset_sd: ArrayLike = 0.0
    limit: ArrayLike = np.inf

    def __post_init__(self) -> None:
        """Refuses what no sensor does."""
        for name in ("sd", "offset_sd", "limit"):
            value = np.asarray(getattr(self, name), dtype=np.float64)
            finite = name == "limit" or bool(np.all(np.isfinite(value)))
            if not finite or not np.all(value >= 0.0):
                raise SimulationError(f"{name}: expected zero or more, got {getattr(self, name)}")


@dataclass(frozen=True, slots=True)
class Dropouts:
    """How often a sensor's radio fails.

    Attributes:
        per_s: failures begun per second.
        mean_s: their mean duration, exponentially distributed [s].
    """

    per_s: float = 0.0
    mean_s: float = 0.1


#: A sensor without fault.
PERFECT = SensorNoise()
ALWAYS_THERE = Dropouts()


def disturbed(true: Array, noise: SensorNoise, rng: np.random.Generator) -> tuple[Array, Array]:
    """Returns what a sensor reads of the truth ``T x k``, and the offset ``k`` that is in it."""
    offset = rng.normal(size=true.shape[1:]) * np.asarray(noise.offset_sd)
    read = true + offset + rng.normal(size=true.shape) * np.asarray(noise.sd)
    limit = np.asarray(noise.limit, dtype=np.float64)
    return np.clip(read, -limit, limit), offset


def frames_received(time_s: Array, dropouts: Dropouts, rng: np.random.Generator) -> Mask:
    """Returns which frames ``T`` arrive; the first always does."""
    received = np.ones(len(time_s), dtype=np.bool_)
    if dropouts.per_s > 0.0:
        now, end = float(time_s[0]), float(time_s[-1])
        while (now := now + rng.exponential(1.0 / dropouts.per_s)) < end:
            back = now + rng.exponential(dropouts.mean_s)
            received &= (time_s < now) | (time_s > back)
            now = back
        received[0] = True
    return received


def held(values: Array, received: Mask) -> Array:
    """Returns the values with each lost frame repeating the last that arrived."""
    last = np.maximum.accumulate(np.where(received, np.arange(len(values)), 0))
    return values[last]
