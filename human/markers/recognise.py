"""Which known marker set a recording wears, and which of its markers are missing or unknown."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from human.markers.errors import MarkerSetError, UnknownMarkerSetError
from human.markers.marker_set import MarkerPlace, MarkerSet, marker_set_from_dict, wearer

#: Share of a file's markers that a set must name, and least number of bony points among them.
LEAST_SHARE = 0.5
LEAST_LANDMARKS = 6


@cache
def known_marker_sets() -> tuple[MarkerSet, ...]:
    """Returns the marker sets that come with the package, by name."""
    folder = files("human").joinpath("data").joinpath("marker_sets")
    names = sorted(entry.name for entry in folder.iterdir() if entry.name.endswith(".json"))
    texts = [
        files("human").joinpath(f"data/marker_sets/{name}").read_text("utf-8") for name in names
    ]
    return tuple(marker_set_from_dict(json.loads(text)) for text in texts)


def known_marker_set(name: str) -> MarkerSet:
    """Returns one of the sets that come with the package.

    Raises:
        MarkerSetError: there is none of that name.
    """
    known = {marker_set.name: marker_set for marker_set in known_marker_sets()}
    if name not in known:
        raise MarkerSetError(repr(name), f"expected one of the known sets, {', '.join(known)}.")
    return known[name]


@dataclass(frozen=True, slots=True)
class RecognisedMarkers:
    """A recording's markers, matched with a set.

    Attributes:
        marker_set: the set.
        place_of: name in the recording -> its place in the set.
        missing: the set's bony points that the recording does not have, as marker names.
        unknown: the recording's markers that the set does not name; they are left out.
        results: names in the recording that are no markers but computed by other software.
        others: wearers of further markers of the set, by the prefixes of their names, who show
            enough of it to be persons, too.
    """

    marker_set: MarkerSet
    place_of: dict[str, MarkerPlace]
    missing: tuple[str, ...]
    unknown: tuple[str, ...]
    results: tuple[str, ...]
    others: tuple[str, ...] = ()

    @property
    def share(self) -> float:
        """Part of the recording's markers that the set names."""
        count = len(self.place_of) + len(self.unknown)
        return len(self.place_of) / count if count else 0.0

    @property
    def landmarks(self) -> tuple[str, ...]:
        """The recording's markers that show a bony point."""
        return tuple(name for name, place in self.place_of.items() if place.role)

    def name_of_role(self, role: str) -> str | None:
        """Returns the recording's name of the marker that shows a bony point."""
        return next((n for n, place in self.place_of.items() if place.role == role), None)


def match_markers(names: Sequence[str], marker_set: MarkerSet) -> RecognisedMarkers:
    """Matches a recording's marker names with one set, whatever the share.

    Of several wearers, told by the prefixes of the names, the one who shows most is taken, the
    first of equals; nobody is given the markers of another.
    """
    found = {name: marker_set.find(name) for name in names}
    worn: dict[str, set[str]] = {}
    for name, place in found.items():
        if place is not None:
            worn.setdefault(wearer(name), set()).add(place.name)
    who = max(worn, key=lambda prefix: len(worn[prefix]), default="")
    place_of: dict[str, MarkerPlace] = {}
    taken: set[str] = set()
    unknown, results = [], []
    # Names without a prefix may be of anybody, so those with one come first.
    for name in sorted(names, key=lambda name: wearer(name) != who):
        place = found[name]
        mine = wearer(name) in (who, "")
        if place is not None and mine and place.name not in taken:
            place_of[name] = place
            taken.add(place.name)
        elif place is None and marker_set.is_result(name):
            results.append(name)
        else:
            unknown.append(name)
    missing = tuple(
        p.name for p in marker_set.places if p.role and p.tracked and p.name not in taken
    )
    others = tuple(
        prefix for prefix, shown in worn.items() if prefix != who and len(shown) >= LEAST_LANDMARKS
    )
    return RecognisedMarkers(marker_set, place_of, missing, tuple(unknown), tuple(results), others)


def recognise_marker_set(names: Sequence[str]) -> RecognisedMarkers:
    """Finds the known set that names most of a recording's markers.

    Args:
        names: of the recording's markers.

    Raises:
        UnknownMarkerSetError: no set names half of them, or too few bony points.
    """
    best = max(
        (match_markers(names, marker_set) for marker_set in known_marker_sets()),
        key=lambda match: (len(match.place_of), match.share, len(match.landmarks)),
    )
    if best.share < LEAST_SHARE or len(best.landmarks) < LEAST_LANDMARKS:
        raise UnknownMarkerSetError(
            names,
            best.marker_set.name,
            [s.name for s in known_marker_sets()],
            f"it names {len(best.place_of)} of {len(best.place_of) + len(best.unknown)} markers, "
            f"{len(best.landmarks)} of them bony points.",
        )
    return best
