"""Errors of the digital human: one base, one subclass per thing a user can do about it."""


class HumanError(Exception):
    """Base of every error raised by the ``human`` package."""


class ModelError(HumanError):
    """A human model cannot be made from what was given (height, mass, sex, URDF)."""


class SubjectError(ModelError):
    """A person's height, mass or sex is outside what the tables were made for.

    Attributes:
        quantity: name of the offending quantity, with its unit.
        value: what was given.
        accepted: the accepted range or values, in words.
    """

    def __init__(self, quantity: str, value: object, accepted: str) -> None:
        """Builds the message from the quantity, the value got and the accepted range."""
        super().__init__(f"{quantity}: expected {accepted}, got {value!r}")
        self.quantity, self.value, self.accepted = quantity, value, accepted


class UrdfError(ModelError):
    """A URDF cannot be read as a human model; ``place`` names the element at fault."""

    def __init__(self, place: str, message: str) -> None:
        """Builds the message from the place and what is wrong there."""
        super().__init__(f"URDF, {place}: {message}")
        self.place = place


class UnknownNameError(ModelError):
    """A segment, joint or frame is not in the model; ``known`` lists what is."""

    def __init__(self, kind: str, name: str, known: tuple[str, ...]) -> None:
        """Builds the message from the kind of name, the name and the known ones."""
        super().__init__(f"no {kind} {name!r} in this model; known: {', '.join(known)}")
        self.kind, self.name, self.known = kind, name, known


class RotationError(HumanError):
    """A quaternion, rotation matrix or rotation vector is malformed."""


class ConfigurationError(HumanError):
    """A configuration, velocity, acceleration or wrench does not fit the model or is not finite."""


class MotionError(HumanError):
    """A motion or time vector is malformed; ``index`` is the first frame at fault, if any."""

    def __init__(self, message: str, index: int | None = None) -> None:
        """Keeps the first offending frame beside the message."""
        super().__init__(message)
        self.index = index


class RecordingError(HumanError):
    """A recording cannot be read: wrong format, truncated, or holding impossible values."""
