"""Step functions from an angle to points: read one at a time in words, or by the million.

The two ways are written independently of each other, so that each can check the other.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .rules import ScoringRules

_NEUTRAL = {"neutral": 1.0, "-neutral": -1.0}


def degrees_text(angle_deg: float) -> str:
    """Returns an angle as a person would write it: one decimal at most, and no minus zero."""
    return f"{round(angle_deg, 1) + 0.0:g}°"


@dataclass(frozen=True, slots=True)
class Step:
    """One edge of a band scale with the rules applied.

    Attributes:
        at_deg: The edge.
        jump: Change of the score when the angle rises past the edge.
        includes_edge: True if the band above owns the edge itself.
    """

    at_deg: float
    jump: int
    includes_edge: bool


@dataclass(frozen=True, slots=True)
class BandScale:
    """Points by ranges of an angle.

    Attributes:
        edges: Edges in degrees, ascending; ``"neutral"`` and ``"-neutral"`` stand for the
            tolerance of the rules.
        scores: One more than ``edges``: below the first edge, between them, above the last.
    """

    edges: tuple[float | str, ...]
    scores: tuple[int, ...]

    def edges_deg(self, rules: ScoringRules) -> tuple[float, ...]:
        """Returns the edges as numbers."""
        tolerance = float(rules.neutral_tolerance_deg)
        return tuple(
            _NEUTRAL[edge] * tolerance if isinstance(edge, str) else float(edge)
            for edge in self.edges
        )

    def score(self, angle_deg: float, rules: ScoringRules) -> tuple[int, str]:
        """Scores one angle.

        Args:
            angle_deg: The angle, degrees.
            rules: Tie rule and tolerance.

        Returns:
            The points, and the band they come from in words.
        """
        edges = self.edges_deg(rules)
        bounds = (-np.inf, *edges, np.inf)
        touching = [i for i in range(len(self.scores)) if bounds[i] <= angle_deg <= bounds[i + 1]]
        if len(touching) == 1:
            chosen = touching[0]
            return self.scores[chosen], _range_text(bounds[chosen], bounds[chosen + 1])
        here = [edge for edge, at in zip(self.edges, edges, strict=True) if at == angle_deg]
        lower = rules.ties == "lower" or any(isinstance(edge, str) for edge in here)
        pick = min if lower else max
        chosen = pick(touching, key=lambda i: self.scores[i])
        words = _range_text(bounds[chosen], bounds[chosen + 1])
        if len({self.scores[i] for i in touching}) > 1 and not any(
            isinstance(edge, str) for edge in here
        ):
            words += f", on the edge: {rules.ties} score"
        return self.scores[chosen], words

    def steps(self, rules: ScoringRules) -> tuple[Step, ...]:
        """Returns the scale as jumps: score = first score + sum of the jumps passed.

        Args:
            rules: Tie rule and tolerance.
        """
        steps = []
        for k, (edge, at) in enumerate(zip(self.edges, self.edges_deg(rules), strict=True)):
            jump = self.scores[k + 1] - self.scores[k]
            lower = rules.ties == "lower" or isinstance(edge, str)
            # The lower score lies above a falling edge, so the band above owns it under "lower".
            steps.append(Step(at, jump, includes_edge=(jump < 0) == lower))
        return tuple(steps)


def band_scores(
    scale: BandScale, angle_deg: NDArray[np.float64], rules: ScoringRules
) -> NDArray[np.int8]:
    """Scores an array of angles.

    Args:
        scale: The bands.
        angle_deg: ``(...)`` angles, degrees, finite.
        rules: Tie rule and tolerance.

    Returns:
        ``(...)`` points.
    """
    # Comparing against each edge beats a search: there are at most five, and comparisons run
    # in the vector unit on one byte per angle.
    total = np.full(angle_deg.shape, scale.scores[0], dtype=np.int8)
    for step in scale.steps(rules):
        passed = angle_deg >= step.at_deg if step.includes_edge else angle_deg > step.at_deg
        if step.jump == 1:
            np.add(total, passed.view(np.int8), out=total)
        else:
            np.add(total, passed.view(np.int8) * np.int8(step.jump), out=total)
    return total


def _range_text(low: float, high: float) -> str:
    if np.isinf(low):
        return f"below {degrees_text(high)}"
    if np.isinf(high):
        return f"above {degrees_text(low)}"
    return f"{degrees_text(low)} to {degrees_text(high)}"
