"""Every prediction method on a folder of one person's recordings, paired split by split."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from app.problems import InvalidRequest
from app.takes import takes_of
from app.training import Progress, motions_of
from human import Chain, Subject
from human.readers import marker_format
from prediction import (
    Hand,
    PairedRow,
    SplitScores,
    TrainingOptions,
    compare_on_splits,
    demonstrations_from_motion,
    paired_table,
    splits_of,
)

#: What is compared unless something else is asked for.
METHODS = ("auto", "mi-nsgp", "locov-ik", "cc-gp", "nsgp", "w-ik", "promp", "gp", "sb-m")
_MOTIONS = (".mvnx", ".bvh", ".c3d", ".trc")
#: Share of the work spent on reading and fitting.
_READING = 0.1


@dataclass(frozen=True, slots=True)
class Comparison:
    """What came out.

    Attributes:
        tables: Rows by design: ``part``, and ``recording`` where there were several.
        results: Scores of every split.
        files: Recordings used.
        notes: What the fits said.
    """

    tables: dict[str, list[PairedRow]]
    results: list[SplitScores]
    files: tuple[str, ...]
    notes: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Returns JSON values."""
        return {
            "files": list(self.files),
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


def recordings_in(folder: Path) -> list[str]:
    """Returns the motions of a folder and, as ``static:FILE``, its static trial of markers.

    Raises:
        InvalidRequest: It is no folder, or holds no motion.
    """
    if not folder.is_dir():
        raise InvalidRequest(f"{folder}: expected a folder of recordings.")
    found = sorted(p for p in folder.iterdir() if p.suffix.lower() in _MOTIONS)
    static = [p for p in found if "static" in p.stem.lower() and marker_format(p) is not None]
    motions = [p for p in found if p not in static]
    if not motions:
        raise InvalidRequest(
            f"{folder}: expected recordings of motion ({', '.join(_MOTIONS)}), found none."
        )
    return [*(f"static:{p}" for p in static[:1]), *(str(p) for p in motions)]


def compare_folder(
    folder: Path,
    subject: Subject,
    hand: Hand,
    *,
    methods: Sequence[str] = METHODS,
    seed: int = 0,
    options: TrainingOptions | None = None,
    accept: Sequence[str] = (),
    progress: Progress | None = None,
    rate_hz: float = 30.0,
) -> Comparison:
    """Compares the methods on the recordings of a folder, all of one person.

    Args:
        folder: The recordings.
        subject: The person.
        hand: The hand that is led.
        methods: What to compare; Cov-IK and minimum-norm are always there.
        seed: Seed of everything.
        options: How to train.
        accept: Codes of findings to go on in spite of.
        progress: Told what is being done and the share done.
        rate_hz: Demonstrations are thinned to at most this rate.

    Raises:
        InvalidRequest: The folder holds nothing that can be used, or different people.
        HumanError: A recording cannot be read or fitted.
        PredictionError: No split could be scored, or a method is not known.
    """
    takes = takes_of(recordings_in(folder))
    if progress is not None:
        progress("reading", 0.0)
    recorded = motions_of(takes, subject, accept)
    chain = Chain(recorded.model, tip=f"{hand.capitalize()}HandCOM")
    names = tuple(take.motion.name for take in takes)
    demonstrations = [
        (name, demonstrations_from_motion(chain, motion, trajectory_id=k, rate_hz=rate_hz))
        for k, (name, motion) in enumerate(zip(names, recorded.motions, strict=True))
    ]

    def tell(what: str, done: float, _: float) -> None:
        if progress is not None:
            progress(what, _READING + (1.0 - _READING) * done)

    results = compare_on_splits(
        chain, splits_of(demonstrations), methods, seed=seed, options=options, progress=tell
    )
    designs = dict.fromkeys(result.split[0] for result in results)
    tables = {design: paired_table(results, design) for design in designs}
    return Comparison(tables, results, names, recorded.notes)
