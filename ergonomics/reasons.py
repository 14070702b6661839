"""Points and the words for them, gathered while a worksheet is scored."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from .method_data import Part
from .rules import ScoringRules

#: What is said for a flag that carries no measurement of its own.
FLAG_WORDS: Mapping[str, str] = {
    "upper_arm.shoulder_raised": "shoulder raised",
    "upper_arm.abducted": "upper arm abducted",
    "upper_arm.abducted_or_rotated": "upper arm abducted or rotated",
    "upper_arm.supported": "arm supported or leaning",
    "upper_arm.supported_or_gravity_assisted": "arm supported, leaning or helped by gravity",
    "lower_arm.across_midline_or_out_to_side": "lower arm across the midline or out to the side",
    "wrist.deviated": "wrist deviated sideways",
    "wrist.deviated_or_twisted": "wrist deviated or twisted",
    "wrist.twist": "forearm twisted to the end of its range",
    "neck.twisted": "neck twisted",
    "neck.side_bent": "neck side-bent",
    "trunk.twisted": "trunk twisted",
    "trunk.side_bent": "trunk side-bent",
}


@dataclass(slots=True)
class Tally:
    """Adds up the points of one field and says where each comes from."""

    score: int
    words: list[str] = field(default_factory=list)

    def add(self, points: int, why: str) -> None:
        """Adds points with their reason; a modifier of zero is not worth a word."""
        if points:
            self.score += points
            self.words.append(f"{points:+d}: {why}")

    def hold(self, part: Part) -> None:
        """Holds the score inside the part's range, and says so if that changed it."""
        held = part.hold(self.score)
        if held != self.score:
            word = "most" if held < self.score else "least"
            self.words.append(f"held at {held}, the {word} this part can score")
        self.score = held

    def text(self) -> str:
        """Returns the reason as one line."""
        return "; ".join(self.words)


def banded(part: Part, angle_deg: float, rules: ScoringRules, what: str) -> Tally:
    """Starts a tally from an angle.

    Args:
        part: The part, with bands.
        angle_deg: The angle, degrees.
        rules: Tie rule and tolerance.
        what: Name of the angle, e.g. ``"flexion"``.
    """
    if part.bands is None:
        raise ValueError("this part is not scored from an angle")
    score, band = part.bands.score(angle_deg, rules)
    # One decimal could show 45.02 degrees as the edge it has just passed.
    edges = part.bands.edges_deg(rules)
    shown = round(angle_deg, 1)
    number = f"{angle_deg:.6g}" if shown in edges and shown != angle_deg else f"{shown + 0.0:g}"
    return Tally(score, [f"{score}: {what} {number}° ({band})"])


def not_measured(ends: tuple[int, int]) -> Tally:
    """Returns the tally of a part that nobody measured: its greatest score, and that it is so."""
    low, high = ends
    return Tally(high, [f"{high}: not measured, could be {low} to {high}; the most is taken"])


def flag_words(key: str, measured: Mapping[str, str]) -> str:
    """Returns the words of a flag, with its measurement where there is one."""
    return measured.get(key, FLAG_WORDS[key])
