"""What can be wrong with markers, their sets and the person under them."""

from collections.abc import Sequence

from human.errors import HumanError
from human.recording import Finding


class MarkerError(HumanError):
    """Base of every error about markers and the person who wears them."""


class MarkerBodyError(MarkerError):
    """The record of a person with markers on does not hold together."""


class MarkerSetError(MarkerError):
    """A description of a marker set is malformed; ``place`` names the entry at fault."""

    def __init__(self, place: str, message: str) -> None:
        """Builds the message from the place and what is wrong there."""
        super().__init__(f"marker set, {place}: {message}")
        self.place = place


class UnknownMarkerSetError(MarkerError):
    """The markers of a recording are of no known set.

    Attributes:
        names: the recording's markers.
        closest: the known set that names most of them.
    """

    def __init__(self, names: Sequence[str], closest: str, known: Sequence[str], why: str) -> None:
        """Lists the names and says how to describe them."""
        super().__init__(
            f"markers: expected those of a known set ({', '.join(known)}), got "
            f"{', '.join(names) or 'none'}; the closest is {closest}: {why} "
            "Describe the set in a mapping file and pass it (human/markers/README.md)."
        )
        self.names, self.closest = tuple(names), closest


class MissingLandmarksError(MarkerError):
    """A person cannot be measured: markers that show a bony point are not there.

    Attributes:
        roles: the landmarks missing.
    """

    def __init__(self, source: str, purpose: str, roles: Sequence[str]) -> None:
        """Names the landmarks and what they are needed for."""
        super().__init__(
            f"{source}: expected markers that show {purpose}; {', '.join(roles)} not seen together "
            "in any frame. Take another trial as the static one, or name these in a mapping file."
        )
        self.roles = tuple(roles)


class MarkersRefusedError(MarkerError):
    """The markers are not those of a person standing up, such as exchanged sides or wrong units.

    Attributes:
        findings: what was found.
    """

    def __init__(self, source: str, findings: Sequence[Finding]) -> None:
        """Lists the findings and how to go on in spite of them."""
        self.findings = tuple(findings)
        codes = ", ".join(dict.fromkeys(f.code for f in findings))
        listed = " ".join(f"[{f.code}, {f.place}] {f.message}" for f in findings)
        super().__init__(
            f"{source}: expected the markers of a person, got: {listed} "
            f"To measure them all the same, accept by name: {codes}."
        )


class MarkerFitError(MarkerError):
    """No posture can be fitted to a recording's markers."""

    def __init__(self, source: str, message: str) -> None:
        """Names the recording and what is wrong."""
        super().__init__(f"{source}, markers: {message}")
