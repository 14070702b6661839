"""What a posture alone cannot tell: load, grip, support, time; and what is assumed where unsaid."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from .columns import ANGLE
from .errors import PostureError

ForceMode = Literal["intermittent", "static", "repeated", "shock"]
Coupling = Literal["good", "fair", "poor", "unacceptable"]
LegSupport = Literal["both", "one", "walking", "sitting"]


@dataclass(frozen=True, slots=True)
class SecondaryThresholds:
    """Where a measured angle ticks a yes/no box of the sheets.

    The papers give these boxes no number; studies that compared tools with experts found them
    the largest source of disagreement. They are ours, settable, and said with every point.

    Attributes:
        shoulder_raised_deg: Shoulder girdle over neutral.
        abducted_deg: Upper arm out of the sagittal plane.
        rotated_deg: Upper arm about itself (REBA only), half of the way to its end.
        across_midline_m: Wrist past the trunk's midline.
        out_to_side_m: Wrist outside the shoulder.
        wrist_deviated_deg: Hand towards thumb or little finger.
        forearm_twist_end_deg: Forearm twist from which it is "near the end", of about 80.
        neck_twisted_deg: Head against trunk; likewise the next three (EN 1005-4 uses 10 degrees).
    """

    shoulder_raised_deg: float = 10.0
    abducted_deg: float = 20.0
    rotated_deg: float = 45.0
    across_midline_m: float = 0.02
    out_to_side_m: float = 0.10
    wrist_deviated_deg: float = 10.0
    forearm_twist_end_deg: float = 45.0
    neck_twisted_deg: float = 10.0
    neck_side_bent_deg: float = 10.0
    trunk_twisted_deg: float = 10.0
    trunk_side_bent_deg: float = 10.0


@dataclass(frozen=True, slots=True)
class Assumption:
    """Something scored without being known.

    Attributes:
        what: The thing, in words.
        value: What was taken for it.
        range: What it could be.
        rula: Fields of ``RulaInputs`` at the other end of the range; likewise ``reba``.
        effect: The range it opens in the scores, in words; empty until worked out.
    """

    what: str
    value: str
    range: str
    rula: Mapping[str, int | bool] = field(default_factory=dict)
    reba: Mapping[str, int | bool] = field(default_factory=dict)
    effect: str = ""

    def to_dict(self) -> dict[str, str]:
        """Returns the four fields that a reader is shown."""
        return {
            "what": self.what,
            "value": self.value,
            "range": self.range,
            "effect": self.effect,
        }


@dataclass(frozen=True, slots=True)
class TaskContext:
    """What the assessor, the planner or other sensors say of the task; None means not known.

    Attributes:
        load_kg: ``(...)`` or one number: mass borne by the scored hand (force / 9.81).
        total_load_kg: Mass borne by both hands together; the scored hand's if None.
        force_mode: How the load acts.
        coupling: How good the grip is (REBA).
        arm_supported: The arm rests on something, or the person leans, or a robot carries it.
        legs: What the legs stand on.
        seated_supported: Seated, back supported, hips at 90 degrees or more (RULA).
        static: A posture held longer than a minute.
        repeated: An action repeated more than four times a minute.
        rapid_change: Rapid large changes of posture, or an unstable base (REBA).
    """

    load_kg: ArrayLike | None = None
    total_load_kg: ArrayLike | None = None
    force_mode: ForceMode = "intermittent"
    coupling: Coupling | None = None
    arm_supported: bool | None = None
    legs: LegSupport | None = None
    seated_supported: bool = False
    static: bool | None = None
    repeated: bool | None = None
    rapid_change: bool | None = None

    def __post_init__(self) -> None:
        """Refuses words and loads that no sheet knows.

        Raises:
            PostureError: If a load is negative or not finite, or a word is unknown.
        """
        for name in ("load_kg", "total_load_kg"):
            value = getattr(self, name)
            if value is None:
                continue
            load = ANGLE.checked(name, value)
            if (load < 0.0).any():
                raise PostureError(name, f"expected kg of 0 or more, got {load.min():g}")
            object.__setattr__(self, name, load)
        for name, words in (
            ("force_mode", ForceMode),
            ("coupling", Coupling),
            ("legs", LegSupport),
        ):
            value = getattr(self, name)
            if value not in get_args(words) and not (value is None and name != "force_mode"):
                raise PostureError(name, f"expected one of {get_args(words)}, got {value!r}")

    def assumptions(self) -> tuple[Assumption, ...]:
        """Returns what is taken for each thing that is not known."""
        unknown = {
            "load_kg": Assumption(
                "load in the hand",
                "none",
                "0 to more than 10 kg",
                rula={"force_a": 3, "force_b": 3},
                reba={"load": 3},
            ),
            "coupling": Assumption("grip", "good", "good to unacceptable", reba={"coupling": 3}),
            "arm_supported": Assumption(
                "support of the arm",
                "not supported",
                "supported or not",
                rula={"supported": True},
                reba={"supported_or_gravity_assisted": True},
            ),
            "legs": Assumption(
                "what the legs stand on",
                "both feet, balanced",
                "both feet, or one",
                rula={"legs_supported": False},
                reba={"bilateral": False},
            ),
            "static": Assumption(
                "postures held longer than a minute",
                "none",
                "none, or some",
                rula={"muscle_a": 1, "muscle_b": 1},
                reba={"static_over_1min": True},
            ),
            "repeated": Assumption(
                "actions repeated more than 4 times a minute",
                "none",
                "none, or some",
                rula={"muscle_a": 1, "muscle_b": 1},
                reba={"repeated_over_4_per_min": True},
            ),
            "rapid_change": Assumption(
                "rapid changes of posture",
                "none",
                "none, or some",
                reba={"rapid_large_change_or_unstable": True},
            ),
        }
        return tuple(said for name, said in unknown.items() if getattr(self, name) is None)

    @property
    def hand_load_kg(self) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        """Load of the scored hand, zero if unknown."""
        return np.asarray(0.0 if self.load_kg is None else self.load_kg, dtype=np.float64)

    @property
    def body_load_kg(self) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        """Load of both hands together."""
        if self.total_load_kg is None:
            return self.hand_load_kg
        return np.asarray(self.total_load_kg, dtype=np.float64)
