"""What a person did a moment ago, as a word on what they do now.

How someone strays from a law lasts some tenths of a second: whoever carries the elbow higher than
predicted in one frame does so in the next. Where the joint velocity of the step before was
measured, that tells most of the next one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from prediction.demonstrations import Demonstrations
from prediction.errors import PredictionError
from prediction.laws.predictor import Predictor, Previous

Array = NDArray[np.float64]

#: Times the usual step beyond which two samples of a take are no neighbours.
_GAP = 1.5
#: Share of the variance that is never explained: a smooth motion is not a known one.
_LEAST_SPREAD = 0.01


@dataclass(frozen=True, slots=True)
class NullSpaceMemory:
    """How long what a person does beyond a law lasts.

    With ``r' = dq' - (mean of the law)`` of the step before, which lies in the null space there,
    ``a (I - K J) r'`` joins the mean and the null-space covariance shrinks by ``1 - e a^2``,
    ``a = exp(-dt / time_s)``: an autoregression of order one if ``e = 1``. The hand's velocity and
    its law stay as they are. Only the residual is carried: the whole null-space velocity of the
    step before would leak motion of the hand as J turns.

    One step ahead this is worth far more than any choice of method; beyond a quarter of a second it
    is worth nothing, and a roll-out does without.

    Attributes:
        time_s: Time over which the residual forgets itself, s.
        explained: e in [0, 1].

    Source: the null-space memory of `docs/theory/prediction.md`.
    """

    time_s: float
    explained: float

    def __post_init__(self) -> None:
        """Refuses what no memory is."""
        if not (0.0 < self.time_s < np.inf and 0.0 <= self.explained <= 1.0):
            raise PredictionError(
                f"a memory of {self.time_s} s that explains {self.explained} of the variance: "
                "expected a positive time and a share from 0 to 1"
            )

    @classmethod
    def fit(cls, parts: Sequence[tuple[Predictor, Demonstrations]]) -> Self | None:
        """Finds the memory on motion held out.

        Args:
            parts: Predictors and demonstrations they were not fitted on.

        Returns:
            The memory; None if no two samples are neighbours, or a step tells nothing of the next.

        Derived here: with w the whitened residual and w' what is carried to it, whitened alike, the
        Gaussian likelihood of ``w - a w'`` is greatest at ``a = <w, w'> / <w', w'>``, where its
        mean square is ``<w, w> - a <w, w'>``.
        """
        own = across = carried = 0.0
        steps = []
        for predictor, held in parts:
            elapsed = elapsed_in(held)
            follows = np.isfinite(elapsed)
            if not follows.any():
                continue
            near = elapsed <= _GAP * np.median(elapsed[follows])
            steps.append(elapsed[near])
            w = predictor.standardised_residuals(held)
            whole = Previous(_before(_residual(predictor, held)), np.ones(len(held)), np.ones(1))
            v = w - predictor.standardised_residuals(held, whole)
            own += float((w[near] ** 2).sum())
            across += float((w[near] * v[near]).sum())
            carried += float((v[near] ** 2).sum())
        if across <= 0.0:
            return None
        kept = min(across / carried, 0.999)
        left = (own - 2.0 * kept * across + kept**2 * carried) / own
        step = float(np.median(np.concatenate(steps)))
        return cls(-step / np.log(kept), min((1.0 - left) / kept**2, 1.0))

    def after(
        self, predictor: Predictor, q: Array, qdot: Array, jacobian: Array, elapsed_s: Array | float
    ) -> Previous:
        """Returns what a measured step says about the next one.

        Args:
            predictor: The method.
            q: Postures of the step before, ``(..., n)`` rad.
            qdot: Joint velocities measured there, ``(..., n)`` rad/s.
            jacobian: ``(..., m, n)`` there.
            elapsed_s: Time since, ``(...)`` s, positive; infinite where there was no such step.
        """
        return self._previous(predictor.null_residual(q, qdot, jacobian), elapsed_s)

    def within(self, predictor: Predictor, demonstrations: Demonstrations) -> Previous:
        """Returns for each sample what the one before it in its take says; see `after`."""
        elapsed = elapsed_in(demonstrations)
        return self._previous(_before(_residual(predictor, demonstrations)), elapsed)

    def _previous(self, residual: Array, elapsed_s: Array | float) -> Previous:
        kept = np.exp(-np.asarray(elapsed_s, dtype=np.float64) / self.time_s)
        spread = np.maximum(1.0 - self.explained * kept**2, _LEAST_SPREAD)
        return Previous(residual, kept, spread)


def elapsed_in(demonstrations: Demonstrations) -> Array:
    """Returns the time since the sample before, ``(N,)`` s; infinite at the start of a take."""
    elapsed = np.full(len(demonstrations), np.inf)
    same = np.diff(demonstrations.trajectory_id) == 0
    elapsed[1:][same] = np.diff(demonstrations.time_s)[same]
    return elapsed


def _residual(predictor: Predictor, samples: Demonstrations) -> Array:
    return predictor.null_residual(samples.q, samples.qdot, samples.jacobian)


def _before(rows: Array) -> Array:
    """Returns each row's predecessor; the first, which has none, gets zeros."""
    return np.concatenate([np.zeros_like(rows[:1]), rows[:-1]])
