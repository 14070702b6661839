"""A distribution over a score, and how samples become one."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import PostureError
from .method_data import Method, method_data

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ScoreDistribution:
    """Probabilities of each final score.

    Attributes:
        scores: ``(levels,)`` the scores, ascending: 1 to 7 for RULA, 1 to 15 for REBA.
        pmf: ``(..., levels)`` their probabilities; they sum to one.
    """

    scores: tuple[int, ...]
    pmf: Floats

    @property
    def expected(self) -> Floats:
        """``(...)`` mean score."""
        mean: Floats = self.pmf @ np.asarray(self.scores, dtype=np.float64)
        return mean

    def at_least(self, score: int) -> Floats:
        """Returns ``(...)`` the probability of this score or a worse one."""
        tail: Floats = self.pmf[..., np.asarray(self.scores) >= score].sum(axis=-1)
        return tail

    def quantile(self, probability: float) -> NDArray[np.uint8]:
        """Returns ``(...)`` the least score that is not exceeded with this probability.

        Args:
            probability: Inside 0 and 1.

        Raises:
            PostureError: If the probability is not inside 0 and 1.
        """
        if not 0.0 < probability < 1.0:
            raise PostureError("probability", f"expected between 0 and 1, got {probability}")
        # A sum of many small masses may stop a rounding short of the probability it should reach.
        reached = np.cumsum(self.pmf, axis=-1) >= probability - 1e-12
        scores: NDArray[np.uint8] = np.asarray(self.scores, dtype=np.uint8)[reached.argmax(axis=-1)]
        return scores


def score_distribution(finals: ArrayLike, method: Method = "rula") -> ScoreDistribution:
    """Returns the share of samples at each score.

    Args:
        finals: ``(samples, ...)`` final scores of correlated samples, e.g. ``(samples, frames)``.
        method: ``rula`` or ``reba``.

    Raises:
        PostureError: If there are no samples, or a value is no score of the method.
    """
    scores = method_data(method).final_scores
    array = np.asarray(finals)
    if array.ndim < 1 or array.shape[0] == 0:
        raise PostureError("finals", f"expected (samples, ...), got shape {array.shape}")
    if not np.isin(array, scores).all():
        raise PostureError("finals", f"expected scores from {scores[0]} to {scores[-1]}")
    pmf = np.stack([(array == score).mean(axis=0) for score in scores], axis=-1)
    pmf.setflags(write=False)
    return ScoreDistribution(scores, pmf)
