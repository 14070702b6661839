"""Markers on a person: which set, where on the body, and the motion they show."""

from human.markers.body import MarkerBody
from human.markers.errors import MarkerBodyError, MarkerError

__all__ = ["MarkerBody", "MarkerBodyError", "MarkerError"]
