"""Every prediction method on a folder of one person's recordings, paired split by split."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from app.problems import InvalidRequest, Unreadable
from app.takes import Part, Take, takes_of
from app.training import TrainingProgress, motions_of
from app.unseen import unseen_finding
from human import Chain, HumanError, Subject
from human.readers import marker_format
from prediction import (
    PAPERS_WAY,
    Base,
    DemonstrationError,
    Demonstrations,
    Hand,
    PairedRow,
    Split,
    SplitScores,
    TrainingOptions,
    check_demonstrations,
    compare_on_splits,
    demonstrations_from_motion,
    led_chain,
    paired_table,
    splits_by_primitive,
    splits_of,
)

#: What is compared unless something else is asked for, and beside it the paper's own training.
METHODS = ("auto", "mi-nsgp", "locov-ik", "cc-gp", "nsgp", "w-ik", "promp", "gp", "sb-m")
PAPER = "paper"
_MOTIONS = (".mvnx", ".bvh", ".c3d", ".trc")
#: Share of the work spent on reading and fitting.
_READING = 0.1


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A recording that is not compared on.

    Attributes:
        name: The file, from the folder.
        reason: Why not, and what to do.
    """

    name: str
    reason: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """What came out.

    Attributes:
        tables: Rows by design: ``part`` and ``recording``, or with sub-folders ``same`` and
            ``other``.
        results: Scores of every split.
        files: Recordings used, by primitive.
        left_out: Recordings that could not be.
        notes: What the fits said.
    """

    tables: dict[str, list[PairedRow]]
    results: list[SplitScores]
    files: Mapping[str, tuple[str, ...]]
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Returns JSON values."""
        return {
            "files": [name for names in self.files.values() for name in names],
            "primitives": {name: list(files) for name, files in self.files.items()},
            "left_out": [asdict(one) for one in self.left_out],
            "tables": {name: [asdict(row) for row in rows] for name, rows in self.tables.items()},
            "splits": [
                {
                    "design": result.split[0],
                    "held_out": result.split[1],
                    "problem": result.problem,
                    "scores": [score.to_dict() for score in result.scores.values()],
                }
                for result in self.results
            ],
            "notes": list(self.notes),
        }


def recordings_in(folder: Path) -> dict[str, list[Take]]:
    """Returns the motions of a folder by what they show.

    The recordings of a sub-folder are takes of one primitive, named as the sub-folder. Those in the
    folder itself are another, named as the folder. A static trial of markers (``static`` in its
    name) scales the person for its own folder, one in the folder itself for all that have none.

    Raises:
        InvalidRequest: It is no folder, or holds no motion.
    """
    if not folder.is_dir():
        raise InvalidRequest(f"{folder}: expected a folder of recordings.")
    rooms = [folder, *sorted(p for p in folder.iterdir() if p.is_dir() and p.name[0] != ".")]
    found: dict[str, list[Take]] = {}
    everyones: list[Path] = []
    for room in rooms:
        files = sorted(p for p in room.iterdir() if p.suffix.lower() in _MOTIONS)
        static = [p for p in files if "static" in p.stem.lower() and marker_format(p) is not None]
        motions = [p for p in files if p not in static]
        if room == folder:
            everyones = static
        if motions:
            scaling = [f"static:{p}" for p in (static or everyones)[:1]]
            takes = takes_of([*scaling, *(str(p) for p in motions)])
            found[room.resolve().name] = [_named(take, folder) for take in takes]
    if not found:
        raise InvalidRequest(
            f"{folder}: expected recordings of motion ({', '.join(_MOTIONS)}) in it or in its "
            "sub-folders, found none."
        )
    return found


def _named(take: Take, folder: Path) -> Take:
    """Names a motion from the folder on: two primitives may each have a take 1."""
    path = take.motion.path
    return replace(take, motion=Part(path, path.relative_to(folder).as_posix()))


def splits_for(primitives: Mapping[str, Sequence[tuple[str, Demonstrations]]]) -> list[Split]:
    """Cuts by primitive if there are several, else by part and recording."""
    if len(primitives) > 1:
        return splits_by_primitive(primitives)
    return splits_of([take for takes in primitives.values() for take in takes])


def compare_folder(
    folder: Path,
    subject: Subject,
    hand: Hand,
    *,
    methods: Sequence[str] | None = None,
    seed: int = 0,
    options: TrainingOptions | None = None,
    accept: Sequence[str] = (),
    base: Base = "pelvis",
    progress: TrainingProgress | None = None,
    rate_hz: float = 30.0,
) -> Comparison:
    """Compares the methods on the recordings of a folder, all of one person.

    Args:
        folder: The recordings, in sub-folders by what they show or not.
        subject: The person.
        hand: The hand that is led, or both.
        methods: What to compare, `METHODS` and the paper's own training unless given; Cov-IK and
            minimum-norm are always there.
        seed: Seed of everything.
        options: How to train.
        accept: Codes of findings to go on in spite of.
        base: What of the body stays where it is.
        progress: Told what is being done, the share done and the log likelihood, where there is.
        rate_hz: Demonstrations are thinned to at most this rate.

    Raises:
        InvalidRequest: The folder holds nothing that can be used, or different people.
        PredictionError: No split could be scored, or a method is not known.
    """

    def tell(what: str, done: float, likelihood: float | None = None) -> None:
        if progress is not None:
            progress(what, done, likelihood)

    rooms = recordings_in(folder)
    read = _Reading(subject, hand, base, accept, rate_hz)
    count = sum(len(takes) for takes in rooms.values())
    for name, takes in rooms.items():
        for take in takes:
            tell(f"reading {take.motion.name}", _READING * read.seen / count)
            read.add(name, take)
    if read.chain is None:
        reasons = "; ".join(f"{one.name}: {one.reason}" for one in read.left_out)
        raise InvalidRequest(f"{folder}: none of its recordings can be used. {reasons}")
    options = TrainingOptions() if options is None else options
    papers = replace(PAPERS_WAY, optimizer=options.optimizer)
    results = compare_on_splits(
        read.chain,
        splits_for(read.primitives),
        METHODS if methods is None else methods,
        seed=seed,
        options=options,
        also={PAPER: papers} if methods is None else None,
        progress=lambda what, done, nats: tell(what, _READING + (1.0 - _READING) * done, nats),
    )
    designs = dict.fromkeys(result.split[0] for result in results)
    tables = {
        design: paired_table(results, design)
        for design in designs
        if any(result.scores for result in results if result.split[0] == design)
    }
    if not tables:
        paired_table(results, next(iter(designs)))  # says why
    files = {name: tuple(one for one, _ in takes) for name, takes in read.primitives.items()}
    return Comparison(tables, results, files, tuple(read.left_out), read.gathered_notes())


class _Reading:
    """Recordings as they are read: the person is scaled to the first that can be used."""

    def __init__(
        self, subject: Subject, hand: Hand, base: Base, accept: Sequence[str], rate_hz: float
    ) -> None:
        self._subject, self._hand, self._base = subject, hand, base
        self._accept, self._rate_hz = accept, rate_hz
        self.chain: Chain | None = None
        self.primitives: dict[str, list[tuple[str, Demonstrations]]] = {}
        self.left_out: list[LeftOut] = []
        self.notes: dict[str, list[str]] = {}
        self.seen = 0

    def add(self, primitive: str, take: Take) -> None:
        """Takes a recording in, or says why not.

        Raises:
            InvalidRequest: It is of another person.
        """
        name = take.motion.name
        self.seen += 1
        known = None if self.chain is None else self.chain.model
        try:
            found = motions_of([take], self._subject, self._accept, known)
            chain = self.chain or led_chain(found.model, self._hand, self._base)
            demonstrations = demonstrations_from_motion(
                chain, found.motions[0], rate_hz=self._rate_hz
            )
            unseen = unseen_finding(chain, found.unobserved[0])
            findings = check_demonstrations(chain, demonstrations) + ((unseen,) if unseen else ())
        except (Unreadable, HumanError, DemonstrationError) as error:
            self.left_out.append(LeftOut(name, str(error).removeprefix(f"{name}: ")))
            return
        self.chain = chain
        self.primitives.setdefault(primitive, []).append((name, demonstrations))
        for note in (*found.notes, *findings):
            self.notes.setdefault(note.removeprefix(f"{name}: "), []).append(name)

    def gathered_notes(self) -> tuple[str, ...]:
        """Returns each note once, with the recordings it is of unless it is of all."""
        count = sum(len(takes) for takes in self.primitives.values())
        return tuple(
            note if len(set(names)) == count else f"{', '.join(dict.fromkeys(names))}: {note}"
            for note, names in self.notes.items()
        )
