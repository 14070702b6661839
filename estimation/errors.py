"""Errors of the estimation: one base, one subclass per thing a user can do about it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


class EstimationError(Exception):
    """Base of every error raised by the ``estimation`` package."""


class MeasurementError(EstimationError):
    """A measurement is malformed: wrong shape, not finite, or nothing that was ever measured.

    Attributes:
        frames: the frames at fault; empty where the whole measurement is.
    """

    def __init__(self, message: str, frames: int | Sequence[int] | None = ()) -> None:
        """Builds the message from what is wrong and the first frames at fault."""
        at = (frames,) if isinstance(frames, int | np.integer) else tuple(frames or ())
        self.frames = tuple(int(frame) for frame in at)
        shown = ", ".join(str(frame) for frame in self.frames[:5])
        more = f" and {len(self.frames) - 5} more" if len(self.frames) > 5 else ""
        where = f" at frame{'s' if len(self.frames) > 1 else ''} {shown}{more}" if shown else ""
        super().__init__(f"{message}{where}")


class NoContactError(EstimationError):
    """Frames without any contact: nothing ties the base to the ground.

    Attributes:
        contacts: names of what could have touched the ground.
        frames: indices of the frames without contact.
    """

    def __init__(self, contacts: Sequence[str], frames: Sequence[int], total: int) -> None:
        """Builds the message from the contacts, the frames at fault and how many there are."""
        known = ", ".join(contacts) or "none given"
        super().__init__(
            f"base velocity: expected a contact in every frame, got none in {len(frames)} of "
            f"{total} frames (contacts: {known}); give a contact there, or allow_unsupported=True"
        )
        self.contacts, self.frames = tuple(contacts), tuple(int(frame) for frame in frames)


class SingularContactsError(EstimationError):
    """The contacts of a frame leave the base free to turn; ``contacts`` names them."""

    def __init__(self, contacts: Sequence[str], index: int) -> None:
        """Builds the message from the contacts held and the frame."""
        super().__init__(
            f"base velocity at frame {index}: expected a rigid contact or points spread in two "
            f"directions, got {', '.join(contacts)}; add a contact"
        )
        self.contacts, self.index = tuple(contacts), index


class IllConditionedError(EstimationError):
    """A sensor's place cannot be told from these movements.

    Attributes:
        condition_number: ratio of the best to the worst determined direction.
        excitation_per_s2: ``(3,)`` strongest first: rms acceleration per metre of offset, 1/s^2.
        weakest: ``(3,)`` the worst determined direction, link axes.
    """

    def __init__(
        self, condition_number: float, excitation: NDArray[np.float64], weakest: NDArray[np.float64]
    ) -> None:
        """Says which direction is weak and which movement would help."""
        along = ", ".join(f"{x:.2f}" for x in weakest)
        super().__init__(
            f"IMU placement: the offset along ({along}) in link axes is not determined: condition "
            f"number {condition_number:.3g}, excitation {excitation[-1]:.3g} 1/s^2; turn the link "
            "quickly about an axis across that direction, and record longer"
        )
        self.condition_number = condition_number
        self.excitation_per_s2, self.weakest = excitation, weakest


class TreeError(EstimationError):
    """An estimation tree is malformed, or the state given does not fit it."""


class UnknownLinkError(EstimationError):
    """A sensor names a link that the tree has not; ``known`` lists what it has."""

    def __init__(self, name: str, known: Sequence[str]) -> None:
        """Builds the message from the name and the known ones."""
        super().__init__(f"no link {name!r} in this tree; known: {', '.join(known)}")
        self.name, self.known = name, tuple(known)


class KernelMissingError(EstimationError):
    """The compiled kernel is asked for and is not there for this processor."""


class MissingMeasurementError(EstimationError):
    """The estimate needs something that nobody measured and that cannot be derived."""


class CovarianceError(EstimationError):
    """A covariance is not one, or double precision cannot carry it; ``value`` is the worst one."""

    def __init__(self, place: str, message: str, value: float) -> None:
        """Builds the message from the place, what is wrong and the value."""
        super().__init__(f"{place}: {message}, got {value:g}")
        self.place, self.value = place, value
