"""Errors of posture prediction: one base, one subclass per thing a user can do about it.

PredictionError
├── DemonstrationError            the demonstrations cannot teach anything
├── TrainingCancelledError        the caller asked training to stop
├── TrajectoryError               a hand trajectory cannot be followed
│   ├── UnreachableTrajectoryError
│   ├── DiscontinuousTrajectoryError
│   └── StartMismatchError
├── UnsupportedMethodError        a method, engine or task this model does not hold
└── ModelFileError                an operator model file cannot be read
"""

from collections.abc import Sequence
from pathlib import Path


class PredictionError(Exception):
    """Base of every error raised by the ``prediction`` package."""


class DemonstrationError(PredictionError):
    """Demonstrations are malformed, too few, or say nothing about the body."""


class TrainingCancelledError(PredictionError):
    """Training was stopped by its caller; nothing was kept."""


class UnsupportedMethodError(PredictionError):
    """A method, engine, kernel or task was asked for that is not there.

    Attributes:
        asked: What was asked for.
        available: What could have been asked for.
    """

    def __init__(self, kind: str, asked: str, available: Sequence[str]) -> None:
        """Names what was asked and what there is."""
        self.asked = asked
        self.available = tuple(available)
        super().__init__(f"unknown {kind} {asked!r}: choose one of {', '.join(self.available)}")


class TrajectoryError(PredictionError):
    """A hand trajectory is malformed: shapes, times, non-finite values, rotations."""


class UnreachableTrajectoryError(TrajectoryError):
    """The hand cannot get to a point of the trajectory.

    Attributes:
        index: Index of the first point that cannot be reached.
        distance: What is missing to that point, m.
        angle_deg: What is missing to its orientation, degrees (0 if the task is the position).
        tip: Which tip of the chain stays away most, or would have to leave its place; None if it
            has one tip only.
    """

    def __init__(
        self, index: int, distance: float, angle_deg: float = 0.0, tip: str | None = None
    ) -> None:
        """Says which point cannot be reached and by how much."""
        self.index = index
        self.distance = distance
        self.angle_deg = angle_deg
        self.tip = tip
        what = "the hand" if tip is None else tip
        super().__init__(
            f"point {index} of the trajectory is out of reach: {what} stays {distance:.3f} m and "
            f"{angle_deg:.1f} deg away; move the trajectory nearer, begin with bent arms, or "
            "send positions alone"
        )


class DiscontinuousTrajectoryError(TrajectoryError):
    """Two neighbouring points are further apart than a hand can travel between them.

    Attributes:
        index: Index of the later of the two points.
        distance: Distance between them, m.
        speed: Speed that would be needed, m/s (or rad/s when ``angular``).
        limit: Highest speed accepted, same unit.
        angular: Whether the jump is one of orientation.
    """

    def __init__(
        self, index: int, distance: float, speed: float, limit: float, angular: bool = False
    ) -> None:
        """Says where the jump is and what speed it would take."""
        self.index = index
        self.distance = distance
        self.speed = speed
        self.limit = limit
        self.angular = angular
        unit, speed_unit = ("rad", "rad/s") if angular else ("m", "m/s")
        super().__init__(
            f"the trajectory jumps by {distance:.3f} {unit} before point {index}: that takes "
            f"{speed:.1f} {speed_unit}, and {limit:.1f} {speed_unit} is the most a hand is led at; "
            "check the times and the units, or send more points"
        )


class StartMismatchError(TrajectoryError):
    """The hand of the start posture is not where the trajectory begins.

    Attributes:
        distance_m: Distance from the hand to the first point, m.
        angle_deg: Angle from the hand's to the first orientation, degrees.
        tip: Which hand is furthest off; None if one alone is led.
    """

    def __init__(
        self,
        distance_m: float,
        angle_deg: float,
        limit_m: float,
        limit_deg: float,
        tip: str | None = None,
    ) -> None:
        """Says how far the hand is from the first point."""
        self.distance_m = distance_m
        self.angle_deg = angle_deg
        self.tip = tip
        what = "the hand" if tip is None else tip
        super().__init__(
            f"the start posture holds {what} {distance_m:.3f} m and {angle_deg:.1f} deg from the "
            f"first point (accepted: {limit_m:.3f} m, {limit_deg:.1f} deg); give a start "
            "posture that meets the trajectory, or a grasp that joins them"
        )


class ModelFileError(PredictionError):
    """An operator model file is missing, damaged, hostile or of another version.

    Attributes:
        path: The file.
    """

    def __init__(self, path: str | Path, what: str) -> None:
        """Names the file and what is wrong with it."""
        self.path = str(path)
        super().__init__(f"{path}: {what}")
