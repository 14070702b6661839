"""A marker set: which marker sits on which segment, what bony point it shows, how far it strays.

Sets are data. Those that come with the package are in ``human/data/marker_sets``; a user's own is
a file of the same form (`human.readers.read_marker_set`).
"""

import fnmatch
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from human.markers.errors import MarkerSetError
from human.names import SEGMENTS

SCHEMA = 1
#: Trust (m) in a marker whose entry states none.
DEFAULT_SD_M = 0.010
_SD_RANGE_M = (0.0005, 0.1)
#: Angle by which the plane of the four iliac spines dips forward in a standing person, degrees:
#: the mean of Levine and Whittle 1996 (11.3), rounded.
PELVIS_DIP_DEG = 12.0
_DIP_RANGE_DEG = (-45.0, 45.0)
_MOST_MARKERS = 1000
_LONGEST_NAME = 200
#: What video pipelines add to the names of the markers they make up.
_SUFFIXES = ("_study",)

_MIDLINE_ROLES = {
    "sacrum": "middle between the posterior iliac spines",
    "c7": "spinous process of C7 (or T1)",
    "t8": "spinous process of T8 (or T10)",
    "jugular_notch": "upper end of the breastbone",
    "xiphoid": "lower end of the breastbone",
    "head_top": "top of the head",
}
_KEYS = ("schema", "name", "title", "source", "not_markers", "pelvis_dip_deg", "markers")
_SIDED_ROLES = {
    "asis": "anterior superior iliac spine",
    "psis": "posterior superior iliac spine",
    "hip_center": "hip joint centre found by other means",
    "knee_lateral": "lateral epicondyle of the femur",
    "knee_medial": "medial epicondyle of the femur",
    "knee_center": "knee joint centre found by other means",
    "ankle_lateral": "lateral malleolus",
    "ankle_medial": "medial malleolus",
    "ankle_center": "ankle joint centre found by other means",
    "heel": "back of the heel",
    "toe_first": "head of the first metatarsal",
    "toe_second": "head of the second metatarsal",
    "toe_fifth": "head of the fifth metatarsal",
    "acromion": "tip of the shoulder",
    "shoulder_center": "shoulder joint centre found by other means",
    "sternal": "sternal end of the collar bone",
    "elbow_lateral": "lateral epicondyle of the humerus",
    "elbow_medial": "medial epicondyle of the humerus",
    "elbow_center": "elbow joint centre found by other means",
    "wrist_radial": "styloid process of the radius: the thumb's side",
    "wrist_ulnar": "styloid process of the ulna: the little finger's side",
    "wrist_center": "wrist joint centre found by other means",
    "hand_second": "knuckle of the forefinger",
    "hand_fifth": "knuckle of the little finger",
    "head_front": "front of the head",
    "head_back": "back of the head",
    "head_side": "temple, or side of the head",
}
#: Every bony point a marker may show, in words.
ROLES: Mapping[str, str] = {
    **_MIDLINE_ROLES,
    **{
        f"{side}_{role}": f"{words}, {side}"
        for side in ("right", "left")
        for role, words in _SIDED_ROLES.items()
    },
}


@dataclass(frozen=True, slots=True)
class MarkerPlace:
    """One marker of a set.

    Attributes:
        name: its usual spelling.
        also: other spellings.
        segment: the segment of the model that carries it.
        role: the bony point it shows, a key of `ROLES`; None for one that only tracks.
        sd_m: how far skin and placement let it stray along each axis, m.
        tracked: whether it is a marker to follow; a joint centre computed from other markers is
            not.
    """

    name: str
    segment: str
    also: tuple[str, ...] = ()
    role: str | None = None
    sd_m: float = DEFAULT_SD_M
    tracked: bool = True


@dataclass(frozen=True, slots=True)
class MarkerSet:
    """A marker set.

    Attributes:
        name: short name.
        title: what it is.
        source: who described it.
        places: its markers.
        pelvis_dip_deg: angle by which the plane of the four pelvis markers dips forward in a
            standing person; other than usual where they sit on a belt.
        not_markers: shell patterns of names that files with this set hold beside the markers:
            axes, angles and moments computed by other software.
    """

    name: str
    title: str
    source: str
    places: tuple[MarkerPlace, ...]
    not_markers: tuple[str, ...] = ()
    pelvis_dip_deg: float = PELVIS_DIP_DEG

    def find(self, label: str) -> MarkerPlace | None:
        """Returns the place of a marker by its name in a file, or None.

        A prefix up to a colon (the subject's name), capital letters and marks such as dots,
        blanks and underscores do not matter.
        """
        spelled = plain_name(label)
        for place in self.places:
            if spelled in {plain_name(name) for name in (place.name, *place.also)}:
                return place
        return None

    def roles(self) -> frozenset[str]:
        """Returns the bony points that its markers show."""
        return frozenset(place.role for place in self.places if place.role)

    def is_result(self, label: str) -> bool:
        """Tells whether a name is of something computed rather than of a marker."""
        bare = label.rpartition(":")[2].upper()
        return any(fnmatch.fnmatchcase(bare, pattern.upper()) for pattern in self.not_markers)


def wearer(label: str) -> str:
    """Returns the prefix of a marker's name that says whose it is, empty if there is none."""
    return label.rpartition(":")[0]


@lru_cache(maxsize=4096)
def plain_name(label: str) -> str:
    """Returns a marker's name without prefix, capitals, marks and the suffixes of video tools."""
    bare = label.rpartition(":")[2].casefold()
    for suffix in _SUFFIXES:
        bare = bare.removesuffix(suffix)
    return re.sub(r"[\W_]+", "", bare)


def marker_set_from_dict(value: object) -> MarkerSet:
    """Makes a marker set of its parsed description.

    Args:
        value: ``{"schema": 1, "name", "title", "source", "not_markers": [...], "pelvis_dip_deg",
            "markers": [{"name", "also": [...], "segment", "role", "sd_m", "tracked"}, ...]}``;
            only ``schema``, ``name`` and ``markers``, and of a marker ``name`` and ``segment``, are
            required.

    Raises:
        MarkerSetError: anything is missing, unknown or of another kind; it names the entry.
    """
    top = _mapping(value, "file")
    _only(top, _KEYS, "file")
    if top.get("schema") != SCHEMA:
        raise MarkerSetError("schema", f"expected {SCHEMA}, got {top.get('schema')!r}.")
    rows = top.get("markers")
    if not isinstance(rows, list) or not 1 <= len(rows) <= _MOST_MARKERS:
        raise MarkerSetError("markers", f"expected a list of 1 to {_MOST_MARKERS} markers.")
    places = tuple(_place(row, f"markers[{k}]") for k, row in enumerate(rows))
    spelled: dict[str, str] = {}
    for place in places:
        for name in (place.name, *place.also):
            if not plain_name(name):
                raise MarkerSetError(place.name, f"expected letters or digits in {name!r}.")
            other = spelled.setdefault(plain_name(name), place.name)
            if other != place.name:
                raise MarkerSetError(
                    place.name, f"{name!r} reads the same as a spelling of {other!r}."
                )
    _unique([p.role for p in places if p.role], "role")
    _unique([p.name for p in places], "name")
    return MarkerSet(
        name=_text(top.get("name"), "name"),
        title=_text(top.get("title", ""), "title", empty=True),
        source=_text(top.get("source", ""), "source", empty=True),
        places=places,
        not_markers=_texts(top.get("not_markers", []), "not_markers"),
        pelvis_dip_deg=_number(
            top.get("pelvis_dip_deg", PELVIS_DIP_DEG), _DIP_RANGE_DEG, "degrees", "pelvis_dip_deg"
        ),
    )


def _place(value: object, place: str) -> MarkerPlace:
    row = _mapping(value, place)
    _only(row, ("name", "also", "segment", "role", "sd_m", "tracked"), place)
    name = _text(row.get("name"), f"{place}.name")
    place = f"{place} ({name})"
    segment = row.get("segment")
    if segment not in SEGMENTS:
        raise MarkerSetError(
            place, f"segment: expected one of {', '.join(SEGMENTS)}, got {segment!r}."
        )
    role = row.get("role")
    if role is not None and role not in ROLES:
        raise MarkerSetError(place, f"role: expected one of {', '.join(ROLES)}, got {role!r}.")
    sd = _number(row.get("sd_m", DEFAULT_SD_M), _SD_RANGE_M, "metres", f"{place}, sd_m")
    tracked = row.get("tracked", True)
    if not isinstance(tracked, bool):
        raise MarkerSetError(place, f"tracked: expected true or false, got {tracked!r}.")
    also = _texts(row.get("also", []), f"{place}.also")
    return MarkerPlace(name, str(segment), also, role, sd, tracked)


def _mapping(value: object, place: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise MarkerSetError(place, f"expected an object, got {type(value).__name__}.")
    return value


def _only(value: dict[str, Any], known: tuple[str, ...], place: str) -> None:
    strange = [name for name in value if name not in known]
    if strange:
        raise MarkerSetError(
            place, f"expected only {', '.join(known)}, got {', '.join(map(repr, strange))}."
        )


def _number(value: object, accepted: tuple[float, float], unit: str, place: str) -> float:
    low, high = accepted
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise MarkerSetError(place, f"expected {unit} from {low:g} to {high:g}, got {value!r:.60}.")
    return float(value)


def _text(value: object, place: str, *, empty: bool = False) -> str:
    if not isinstance(value, str) or len(value) > _LONGEST_NAME or not (value.strip() or empty):
        raise MarkerSetError(
            place, f"expected text of at most {_LONGEST_NAME} characters, got {value!r:.60}."
        )
    return value


def _texts(value: object, place: str) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) > _MOST_MARKERS:
        raise MarkerSetError(place, f"expected a list of names, got {value!r:.60}.")
    return tuple(_text(item, place) for item in value)


def _unique(names: list[str], what: str) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise MarkerSetError("markers", f"expected each {what} once, got {twice} more than once.")
