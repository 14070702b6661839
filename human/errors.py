"""Errors of the digital human: one base, one subclass per thing a user can do about it."""


class HumanError(Exception):
    """Base of every error raised by the ``human`` package."""


class ModelError(HumanError):
    """A human model cannot be made from what was given (height, mass, sex, URDF)."""


class MotionError(HumanError):
    """A motion, configuration or time vector is malformed."""


class RecordingError(HumanError):
    """A recording cannot be read: wrong format, truncated, or holding impossible values."""
