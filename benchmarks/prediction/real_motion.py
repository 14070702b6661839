"""Every method on real recordings of people, cut into reaches, paired split by split.

Run ``python -m benchmarks.prediction.real_motion [FOLDER] [--full] [--out PICTURE.png]``; without
FOLDER the recordings are those of the environment variable ``ERGOCAST_RECORDINGS``. The short form
leaves out the designs ``interleaved`` and ``direction``.

No recording here repeats one primitive often, and none is of a hand led by a robot. What stands in
for it: the recordings are cut into reaches (`prediction.find_reaches`), and whole reaches are held
out. The hand then goes where it was recorded, as if led; the pelvis moves as recorded.
"""

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from app.method_figure import draw
from app.problems import AppError
from app.takes import takes_of
from app.training import motions_of
from benchmarks.figure import Figure, shown
from benchmarks.prediction.real_motion_tables import pooled_tables, split_table
from human import Chain, HumanError, Subject
from prediction import (
    PAPERS_WAY,
    Demonstrations,
    Hand,
    PairedRow,
    PredictionError,
    Split,
    SplitScores,
    TrainingOptions,
    compare_on_splits,
    demonstrations_from_motion,
    find_reaches,
    paired_table,
    splits_by_reach,
)

SEED = 1
SAMPLES = 50
RATE_HZ = 30.0
#: Also trained by ``auto``, so that they cost nothing: MI-NsGP, LoCov-IK, CC-GP, Cov-IK.
METHODS = ("auto",)
#: The gradient reaches BIPOP's optimum in less time.
BY_GRADIENT = replace(PAPERS_WAY, optimizer="gradient")
HAND_BAR_MM = 0.2
SHORT_DESIGNS = ("block", "recording")


@dataclass(frozen=True, slots=True)
class Person:
    """One person's recordings.

    Attributes:
        name: Of the data set.
        files: In the folder of recordings; ``static:`` marks the trial that scales the person.
        subject: Height and mass.
        told: Where height and mass come from. Neither enters where bones are measured; the hand's
            place and segments without markers follow the height.
        hand: Which hand is taken for the led one, and why.
        shows: What can be read off this recording, and what cannot.
        wanted: What would have to be recorded to claim more.
        parts: Into how many the reaches of a recording are dealt.
    """

    name: str
    files: tuple[str, ...]
    subject: Subject
    told: str
    hand: Hand
    shows: str
    wanted: str
    parts: int = 2


PEOPLE = (
    Person(
        "xsens_bvh_box",
        ("xsens_bvh_box/MotionBox_XSens.bvh",),
        Subject(1.70, 70.0),
        "height and mass assumed; bones are the file's",
        "right",
        "a person carries a box for 19 s, both hands on it, walking: one session, each placement "
        "once; trunk angles are one measured angle spread over four joints",
        "ten repetitions of each placement, on two days",
    ),
    Person(
        "pyomeca_arm_box",
        ("pyomeca_arm_box/markers_analogs.c3d",),
        Subject(1.75, 75.0),
        "height and mass assumed; arm and trunk are scaled by markers",
        "right",
        "one lift of a box, 6 s, three reaches: says whether the methods work on markers of a "
        "right arm, and nothing of who wins",
        "twenty lifts of this person",
        parts=3,
    ),
    Person(
        "cmu_02_05",
        ("cmu_c3d/cmu_02_05.c3d",),
        Subject(1.75, 75.0),
        "height and mass assumed; scaled by markers",
        "right",
        "fast punches and steps, 15 s, up to 2.8 m/s: repeats of much the same motion, faster than "
        "any robot leads a hand",
        "the same person led at 0.1 to 0.5 m/s",
    ),
    Person(
        "xsens_mvnx",
        ("xsens_mvnx/test_mocap.mvnx",),
        Subject(1.75, 75.0),
        "height and mass assumed; bones are the file's",
        "left",
        "1.8 s of upper body, two reaches of the left hand: too short to train on; kept here to "
        "see that it is refused",
        "a minute of the same",
    ),
    Person(
        "opencap_subject4",
        (
            "static:opencap_subject4/static1.trc",
            "opencap_subject4/squats1.trc",
            "opencap_subject4/STS1.trc",
        ),
        Subject(1.70, 60.1),
        "mass from the plates of the static trial, height assumed; scaled by markers",
        "right",
        "five squats and five times up from a chair and down, arms swinging along: repetitions of "
        "two primitives by one person. No marker on the hand: the wrist is not seen. Arms are not "
        "led, they follow the trunk",
        # The walk beside them is 1.3 s long, less than a split needs.
        "the same squats and rises with the hand led to a target",
    ),
)


@dataclass(frozen=True, slots=True)
class Result:
    """What one person's recordings gave.

    Attributes:
        person: Whose.
        reaches: How many were found, by recording.
        scores: By split; empty if nothing could be trained.
        problem: Why nothing could.
    """

    person: Person
    reaches: dict[str, int]
    scores: list[SplitScores]
    problem: str | None = None


Tell = Callable[[str], None]


def demonstrations_of(
    folder: Path, person: Person
) -> tuple[Chain, list[tuple[str, Demonstrations]]]:
    """Reads a person's recordings.

    Raises:
        AppError, HumanError, PredictionError: They cannot be read or hold nothing to learn from.
    """
    paths = [_placed(folder, file) for file in person.files]
    takes = takes_of(paths)
    recorded = motions_of(takes, person.subject)
    chain = Chain(recorded.model, tip=f"{person.hand.capitalize()}HandCOM")
    return chain, [
        (take.motion.path.stem, demonstrations_from_motion(chain, motion, rate_hz=RATE_HZ))
        for take, motion in zip(takes, recorded.motions, strict=True)
    ]


def _placed(folder: Path, file: str) -> str:
    role, colon, rest = file.rpartition(":")
    return f"{role}{colon}{folder / rest}"


def splits_for(
    person: Person, takes: Sequence[tuple[str, Demonstrations]], full: bool
) -> list[Split]:
    """Returns the splits of a person: all designs, or two of each of the short ones.

    ``direction`` is asked only where there is no other recording to train on.
    """
    splits = splits_by_reach(takes, person.parts)
    if full:
        return [s for s in splits if s.design != "direction" or len(takes) == 1]
    return [
        split
        for design in SHORT_DESIGNS
        for split in [one for one in splits if one.design == design][:2]
    ]


def compared(folder: Path, person: Person, full: bool, tell: Tell) -> Result:
    """Compares the methods on one person's recordings."""
    try:
        chain, takes = demonstrations_of(folder, person)
        reaches = {name: len(find_reaches(take)) for name, take in takes}
        splits = splits_for(person, takes, full)
    except (AppError, HumanError, PredictionError) as error:
        return Result(person, {}, [], str(error))
    if not splits:
        few = "with its neighbours left out, no reach can be held out: nothing remains to train on"
        return Result(person, reaches, [], few)
    scores = []
    for number, split in enumerate(splits):
        tell(f"{person.name}: {split.design}, {split.name} ({number + 1} of {len(splits)})")
        scores += compare_on_splits(
            chain,
            [split],
            METHODS,
            seed=SEED,
            options=TrainingOptions(optimizer="gradient"),
            also={"paper": BY_GRADIENT},
            samples=SAMPLES,
        )
    if scores and not any(one.scores for one in scores):
        return Result(person, reaches, [], scores[0].problem)
    return Result(person, reaches, scores)


def results(folder: Path, full: bool, tell: Tell) -> list[Result]:
    """Compares the methods on everyone's recordings."""
    return [compared(folder, person, full, tell) for person in PEOPLE]


def pooled(found: Sequence[Result]) -> dict[str, list[PairedRow]]:
    """Returns the paired table of each design, over the splits of all people."""
    scores = [one for result in found for one in result.scores]
    designs = dict.fromkeys(one.split[0] for one in scores if one.scores)
    return {design: paired_table(scores, design) for design in designs}


def figures(folder: Path, full: bool = False, picture: Path | None = None) -> Iterator[Figure]:
    """Prints the tables, draws the picture if asked to, and yields the figures."""
    found = results(folder, full, lambda what: print(f"  {what}", file=sys.stderr, flush=True))
    for result in found:
        print(_said(result))
        if result.scores:
            print(split_table(result.scores))
    tables = pooled(found)
    print(pooled_tables(tables))
    if picture is not None:
        headings = {
            design: f"{design} ({rows[0].splits} splits)" for design, rows in tables.items()
        }
        draw(tables, headings, {one.person.name: one.scores for one in found}, picture)
    scores = [score for one in found for split in one.scores for score in split.scores.values()]
    for name in ("auto", "minimum-norm"):
        hands = [
            1e3 * score.rollout_hand_mean_m
            for score in scores
            if score.method == name and score.rollout_hand_mean_m is not None
        ]
        # The bar is for what is shipped; minimum-norm, which knows no person, is shown beside it.
        yield Figure(
            f"real recordings: {name}, mean hand error of roll-outs, worst split", max(hands), "mm",
            most=HAND_BAR_MM if name == "auto" else None,
            beside="1.2-1.9 mm without the correction",
        )  # fmt: skip
    for design, rows in tables.items():
        by_name = {row.method: row for row in rows}
        for name in ("auto", "mi-nsgp"):
            row = by_name[name]
            for horizon in ("0.5", "1"):
                if horizon in row.rollout_ratio:
                    wins, of = row.rollout_wins[horizon]
                    yield Figure(
                        f"real recordings, {design}: {name}, joint error at {horizon} s",
                        row.rollout_ratio[horizon], "x", beside=f"of Cov-IK's; less in {wins}/{of}",
                    )  # fmt: skip
        yield Figure(
            f"real recordings, {design}: auto, log density more than Cov-IK's, median",
            by_name["auto"].nats_more, "nats", beside=f"more in {by_name['auto'].nats_wins}/"
            f"{by_name['auto'].splits}",
        )  # fmt: skip


def _said(result: Result) -> str:
    person = result.person
    lines = [
        f"\n{person.name}, {person.hand} hand ({person.told})",
        f"  shows:  {person.shows}",
        f"  wanted: {person.wanted}",
    ]
    if result.reaches:
        counts = ", ".join(f"{name} {count}" for name, count in result.reaches.items())
        lines.append(f"  reaches: {counts}")
    if result.problem:
        lines.append(f"  refused: {result.problem}")
    return "\n".join(lines)


def main() -> None:
    """Runs everything."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--full", action="store_true", help="every design and split")
    parser.add_argument("--out", type=Path, help="picture to write")
    options = parser.parse_args()
    folder = options.folder or os.environ.get("ERGOCAST_RECORDINGS")
    if not folder:
        parser.error("give the folder of recordings, or set ERGOCAST_RECORDINGS to it")
    sys.exit(shown(figures(Path(folder), options.full, options.out)))


if __name__ == "__main__":
    main()
