"""How well the demonstrations cover a posture: 1 as in training, 0 never seen."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from prediction.demonstrations import Demonstrations

Array = NDArray[np.float64]

#: Kernel width: squared distance over the variance of all joints together at which weight falls by
#: e^-1/2; e^-0.75 times the mean variance of 15 joints, with which it was measured.
WIDTH = float(np.exp(-0.75)) / 15.0
#: Time spent near a posture that makes it half familiar, s.
HALF_S = float(np.exp(3.0)) / 30.0
#: What a sample that stands alone counts for, s.
_ALONE_S = 1.0 / 30.0
#: Centres kept. With few, the gaps between them are wider than the kernel and a demonstrated
#: posture can count as unseen: with 256 of 3200 samples the least familiar one got 0.00, with 1024
#: it gets 0.31.
MAX_CENTRES = 1024
#: Bands widen by 1 + SLOPE (1 - familiarity).
SLOPE = 2.5


@dataclass(frozen=True, slots=True)
class Familiarity:
    """The time spent near a posture in the demonstrations, against what training postures get.

    ``f(q) = s(q) / (s(q) + s0)`` with ``s`` the kernel-weighted time of training samples, so that
    the rate of a recording does not matter; the figure reported is ``min(1, f / f_train)``,
    ``f_train`` being the mean over held-out demonstrations.

    Attributes:
        centres: Demonstrated postures, ``(C, n)`` rad.
        weight: Time each centre stands for, s.
        variance: Joint variance, all joints together, times `WIDTH`, rad^2: joints that move with
            others change nothing.
        level: f_train.

    Source: the fallback weight of posture-local covariance; constants as measured on two sets of
    human arm motion, where 1 + 2.5 (1 - phi) restored the coverage of bands under unfamiliar
    motion.
    """

    centres: Array
    weight: float
    variance: float
    level: float

    @classmethod
    def of(cls, demonstrations: Demonstrations, blocks: int = 4) -> "Familiarity":
        """Takes the centres, and the level from contiguous blocks held out in turn."""
        plain = cls._plain(demonstrations)
        held_out = []
        for block in demonstrations.blocks(blocks):
            if block.all():
                continue
            rest = cls._plain(demonstrations.take(~block), plain.variance)
            held_out.append(rest.raw(demonstrations.q[block]))
        level = float(np.concatenate(held_out).mean()) if held_out else 0.0
        floor = 0.05  # demonstrations that do not resemble each other at all
        return replace(plain, level=max(level, floor))

    @classmethod
    def _plain(cls, demonstrations: Demonstrations, variance: float | None = None) -> "Familiarity":
        kept = demonstrations.thinned(MAX_CENTRES)
        if variance is None:
            variance = float(demonstrations.q.var(axis=0).sum()) * WIDTH
        return cls(kept.q, _duration(demonstrations) / len(kept), max(variance, 1e-12), 1.0)

    def without(self, demonstrations: Demonstrations) -> "Familiarity":
        """Returns the figure of other demonstrations on the same scale."""
        return replace(self._plain(demonstrations, self.variance), level=self.level)

    def raw(self, q: Array) -> Array:
        """Returns f in [0, 1), ``(...)``, at postures ``(..., n)``."""
        flat = q.reshape(-1, q.shape[-1])
        squared = (
            (flat**2).sum(-1)[:, None] + (self.centres**2).sum(-1) - 2.0 * flat @ self.centres.T
        )
        near = np.exp(-0.5 * np.maximum(squared, 0.0) / self.variance).sum(-1) * self.weight
        return np.asarray((near / (near + HALF_S)).reshape(q.shape[:-1]))

    def relative(self, q: Array) -> Array:
        """Returns the familiarity in [0, 1], ``(...)``, at postures ``(..., n)``."""
        return np.asarray(np.minimum(1.0, self.raw(q) / self.level))


def _duration(demonstrations: Demonstrations) -> float:
    """Returns the time demonstrated, s: each sample counts for one usual step."""
    runs = [run for run in demonstrations.runs() if len(run) > 1]
    if not runs:
        return _ALONE_S * len(demonstrations)
    time_s = demonstrations.time_s
    step = float(np.median(np.concatenate([np.diff(time_s[run]) for run in runs])))
    return step * len(demonstrations)


def widening(familiarity: Array) -> Array:
    """Returns the factor on the deviation of a band at a familiarity, 1 to 3.5."""
    return np.asarray(1.0 + SLOPE * np.maximum(0.0, 1.0 - familiarity))
