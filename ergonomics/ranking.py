"""Which candidate loads the person least, how surely, and which cannot be told apart."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import CostError

Floats = NDArray[np.float64]
TieBasis = Literal["outcome", "mean"]

#: Two-sided 95 % of the normal distribution.
_Z95 = 1.959963984540054


@dataclass(frozen=True, slots=True)
class RankedCandidate:
    """One candidate among the others.

    Attributes:
        id: As given.
        rank: 1 is best; the same mean cost shares a rank.
        mean: Mean cost.
        p_best: Probability of being the best; equal bests share it.
        tied_with: Ids that the samples cannot tell from this one.
        expected_regret: Mean excess over the best candidate of each sample.
        cvar90: Mean of the worst tenth of the samples.
    """

    id: str
    rank: int
    mean: float
    p_best: float
    tied_with: tuple[str, ...]
    expected_regret: float
    cvar90: float

    def to_dict(self) -> dict[str, Any]:
        """Returns JSON-ready values."""
        return {
            "id": self.id,
            "rank": self.rank,
            "mean": self.mean,
            "p_best": self.p_best,
            "tied_with": list(self.tied_with),
            "expected_regret": self.expected_regret,
            "cvar90": self.cvar90,
        }


def rank_candidates(
    ids: Sequence[str], costs: ArrayLike, *, tie_basis: TieBasis = "outcome"
) -> tuple[RankedCandidate, ...]:
    """Ranks candidates by cost, sample against sample.

    The samples of all candidates must have been drawn with common random numbers: sample ``s``
    of each candidate is the same person on the same day. What is common then drops out of the
    differences, and few samples tell candidates apart.

    Args:
        ids: Names of the candidates.
        costs: ``(candidates, samples)``, lower is better.
        tie_basis: ``outcome`` calls two candidates tied when the central 95 % of the paired
            differences holds zero: which is better depends on the day. ``mean`` asks only
            whether the 95 % confidence interval of the mean difference holds zero, which any
            difference passes with enough samples.

    Returns:
        One record per candidate, in the order given.

    Raises:
        CostError: If ids repeat, shapes do not fit, or a cost is not finite.
    """
    cost = np.asarray(costs, dtype=np.float64)
    if cost.ndim != 2 or cost.shape[0] != len(ids) or 0 in cost.shape:
        raise CostError(f"expected costs ({len(ids)}, samples), got {cost.shape}")
    if len(set(ids)) != len(ids):
        raise CostError(f"candidate ids must differ, got {list(ids)}")
    if not np.isfinite(cost).all():
        row = int(np.argwhere(~np.isfinite(cost))[0][0])
        raise CostError(f"candidate {ids[row]!r} has a cost that is not finite")
    best = cost.min(axis=0)
    is_best = cost == best
    p_best = (is_best / is_best.sum(axis=0)).mean(axis=1)
    mean = cost.mean(axis=1)
    tail = max(1, int(np.ceil(cost.shape[1] / 10)))
    worst = np.sort(cost, axis=1)[:, -tail:].mean(axis=1)
    return tuple(
        RankedCandidate(
            id=name,
            rank=1 + int((mean < mean[i]).sum()),
            mean=float(mean[i]),
            p_best=float(p_best[i]),
            tied_with=tuple(
                ids[int(j)] for j in np.flatnonzero(_tied(cost[i] - cost, tie_basis)) if j != i
            ),
            expected_regret=float((cost[i] - best).mean()),
            cvar90=float(worst[i]),
        )
        for i, name in enumerate(ids)
    )


def _tied(differences: Floats, basis: TieBasis) -> NDArray[np.bool_]:
    """Returns whether each row of paired differences ``(others, samples)`` holds zero."""
    samples = differences.shape[1]
    if samples == 1:
        return np.asarray(differences[:, 0] == 0.0)
    if basis == "outcome":
        low, high = np.quantile(differences, [0.025, 0.975], axis=1)
    else:
        half = _Z95 * differences.std(axis=1, ddof=1) / np.sqrt(samples)
        mean = differences.mean(axis=1)
        low, high = mean - half, mean + half
    return np.asarray((low <= 0.0) & (high >= 0.0))
