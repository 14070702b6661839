"""Errors of the MAP estimator: what cannot be assembled or solved, and what to do about it."""

from collections.abc import Sequence

from estimation.errors import EstimationError


class TreeError(EstimationError):
    """An estimation tree is malformed, or the state given does not fit it."""


class UnknownLinkError(EstimationError):
    """A sensor names a link that the tree has not; ``known`` lists what it has."""

    def __init__(self, name: str, known: Sequence[str]) -> None:
        """Builds the message from the name and the known ones."""
        super().__init__(f"no link {name!r} in this tree; known: {', '.join(known)}")
        self.name, self.known = name, tuple(known)


class SensorError(EstimationError):
    """A measurement has the wrong shape or is not finite.

    Attributes:
        sensor: which measurement, in words.
        frames: the frames at fault; empty when the whole measurement is.
    """

    def __init__(self, sensor: str, message: str, frames: Sequence[int] = ()) -> None:
        """Builds the message from the sensor, what is wrong and the first frames at fault."""
        shown = ", ".join(str(frame) for frame in frames[:5])
        more = f" and {len(frames) - 5} more" if len(frames) > 5 else ""
        where = f" (frames {shown}{more})" if frames else ""
        super().__init__(f"{sensor}: {message}{where}")
        self.sensor, self.frames = sensor, tuple(frames)


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
