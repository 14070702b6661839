"""Markers on a person: which set, where on the body, and the motion they show.

`body_from_static` measures the person who wears them; `fit_markers` moves the person's model until
it meets a recording.
"""

from human.markers.body import MarkerBody
from human.markers.errors import (
    MarkerBodyError,
    MarkerError,
    MarkerFitError,
    MarkerSetError,
    MarkersRefusedError,
    MissingLandmarksError,
    UnknownMarkerSetError,
)
from human.markers.fitted import FittedMarkers
from human.markers.ik import MARKER_WINDOW_S, fit_markers, fit_markers_in_windows
from human.markers.marker_set import ROLES, MarkerPlace, MarkerSet, marker_set_from_dict
from human.markers.recognise import (
    RecognisedMarkers,
    known_marker_set,
    known_marker_sets,
    match_markers,
    recognise_marker_set,
)
from human.markers.static import body_from_static

__all__ = [
    "MARKER_WINDOW_S",
    "ROLES",
    "FittedMarkers",
    "MarkerBody",
    "MarkerBodyError",
    "MarkerError",
    "MarkerFitError",
    "MarkerPlace",
    "MarkerSet",
    "MarkerSetError",
    "MarkersRefusedError",
    "MissingLandmarksError",
    "RecognisedMarkers",
    "UnknownMarkerSetError",
    "body_from_static",
    "fit_markers",
    "fit_markers_in_windows",
    "known_marker_set",
    "known_marker_sets",
    "marker_set_from_dict",
    "match_markers",
    "recognise_marker_set",
]
