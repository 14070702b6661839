"""What can be wrong with markers, their sets and the person under them."""

from human.errors import HumanError


class MarkerError(HumanError):
    """Base of every error about markers and the person who wears them."""


class MarkerBodyError(MarkerError):
    """The record of a person with markers on does not hold together."""
