"""The measurement behind a yes/no box, kept so that the reason can say the number."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .bands import degrees_text
from .columns import entry


@dataclass(frozen=True, slots=True)
class Evidence:
    """A measured quantity and the limit beyond which it ticks a box.

    Attributes:
        words: What it is, e.g. ``"upper arm abducted"``.
        value: ``(...)`` the quantity, degrees or metres.
        limit: The box is ticked above it.
        unit: ``deg`` or ``m``.
    """

    words: str
    value: NDArray[np.float64]
    limit: float
    unit: str = "deg"

    def exceeded(self) -> NDArray[np.bool_]:
        """Returns ``(...)`` whether the box is ticked."""
        return np.asarray(self.value > self.limit)

    def text(self, index: tuple[int, ...]) -> str:
        """Returns the words with the number and the limit, or nothing where the box is empty.

        Args:
            index: Index of the posture in the batch that ``value`` broadcasts to.
        """
        value = float(entry(self.value, index))
        if value <= self.limit:
            return ""
        if self.unit == "deg":
            # One decimal could show 20.04 degrees as the limit it has just passed.
            rounds = round(value, 1) == self.limit
            number = f"{value:.6g}°" if rounds else degrees_text(value)
            return f"{self.words} {number} (> {degrees_text(self.limit)})"
        return f"{self.words} {100 * value:.0f} cm (> {100 * self.limit:.0f} cm)"


def evidence_words(
    evidence: Mapping[str, tuple[Evidence, ...]],
    notes: Mapping[str, str],
    index: tuple[int, ...],
) -> dict[str, str]:
    """Returns the words of one posture by worksheet field.

    Args:
        evidence: Measurements by field; a field may have several ("abducted or rotated").
        notes: Words that hold for every posture.
        index: Index of the posture in the batch.
    """
    words = dict(notes)
    for key, measured in evidence.items():
        said = [text for one in measured if (text := one.text(index))]
        if said:
            words[key] = " and ".join(said)
    return words
