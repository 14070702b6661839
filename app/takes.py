"""Which files belong together: a motion, the static trial that scales the person, its forces.

On the command line a file may carry its role, as in ``static:FILE`` or ``grf:FILE``; over HTTP a
recording has parts by role.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal, get_args

from app.problems import InvalidRequest

Role = Literal["motion", "static", "grf"]
ROLES: tuple[Role, ...] = get_args(Role)
#: What can be added to a motion.
PartRole = Literal["static", "grf", "static_grf", "marker_set", "columns"]


@dataclass(frozen=True, slots=True)
class Part:
    """One file, and what its owner calls it."""

    path: Path
    name: str


@dataclass(frozen=True, slots=True)
class Take:
    """One motion and what goes with it.

    Attributes:
        motion: MVNX, BVH, or markers, which may have force plates of their own.
        static: markers of the person standing, or None.
        grf: force plates of the motion in a file of their own, or None.
        static_grf: the same of the static trial.
        marker_set: JSON that maps markers to the body, or None to tell them by their names.
        columns: JSON that says what the columns of CSV and .mat files hold.
    """

    motion: Part
    static: Part | None = None
    grf: Part | None = None
    static_grf: Part | None = None
    marker_set: Part | None = None
    columns: Part | None = None

    def parts(self) -> dict[str, Part]:
        """Returns the files that there are, by role."""
        found = {one.name: getattr(self, one.name) for one in fields(self)}
        return {role: part for role, part in found.items() if part is not None}


def takes_of(
    names: Sequence[str], marker_set: Path | None = None, columns: Path | None = None
) -> list[Take]:
    """Sorts the files of a command into takes of one person.

    A ``grf:`` file goes with the motion or static trial whose name its own begins with; without
    such a one, with the motion before it, or with the only motion. The static trial is everyone's.

    Args:
        names: Files, each with its role before a colon where it is not the motion.
        marker_set: Mapping of markers, for every take.
        columns: Mapping of columns, for every take.

    Raises:
        InvalidRequest: There is no motion, or a file cannot be given a place.
    """
    parts = [_with_role(name) for name in names]
    motions = [part for role, part in parts if role == "motion"]
    statics = [part for role, part in parts if role == "static"]
    if not motions:
        raise InvalidRequest("Expected a motion: one file without a role, or motion:FILE.")
    if len(statics) > 1:
        raise InvalidRequest(
            f"{statics[1].name}: expected one static trial, got {len(statics)}. "
            "Run people one by one."
        )
    forces: dict[Path, Part] = {}
    before: Part | None = None
    for role, part in parts:
        if role == "motion":
            before = part
        elif role == "grf":
            owner = _owner(part, motions + statics) or before
            if owner is None and len(motions) == 1:
                owner = motions[0]
            if owner is None:
                raise InvalidRequest(f"grf:{part.name}: put it after the motion it belongs to.")
            if owner.path in forces:
                raise InvalidRequest(
                    f"{owner.name} has two files of forces, {forces[owner.path].name} and "
                    f"{part.name}: expected one."
                )
            forces[owner.path] = part
    static = statics[0] if statics else None
    return [
        Take(
            motion=motion,
            static=static,
            grf=forces.get(motion.path),
            static_grf=forces.get(static.path) if static else None,
            marker_set=None if marker_set is None else Part(marker_set, marker_set.name),
            columns=None if columns is None else Part(columns, columns.name),
        )
        for motion in motions
    ]


def _with_role(name: str) -> tuple[Role, Part]:
    start, colon, rest = name.partition(":")
    # A file may be called grf:something; what exists as it stands is no role.
    if colon and not Path(name).exists():
        for role in ROLES:
            if start == role:
                return role, Part(Path(rest), Path(rest).name)
        if start.isalpha() and len(start) > 1:
            raise InvalidRequest(
                f"{name}: {start!r} is no role; expected {', '.join(ROLES)}, as in static:FILE."
            )
    return "motion", Part(Path(name), Path(name).name)


def _owner(forces: Part, candidates: Sequence[Part]) -> Part | None:
    """Returns the trial whose name the forces' begins with, the longest where several do."""
    stem = forces.path.stem.lower()
    fitting = [one for one in candidates if stem.startswith(one.path.stem.lower())]
    return max(fitting, key=lambda one: len(one.path.stem), default=None)
