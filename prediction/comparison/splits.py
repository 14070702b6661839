"""What is trained on and what is held out, of one person's recordings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prediction.comparison.reaches import Reaches, find_reaches
from prediction.demonstrations import Demonstrations, join
from prediction.errors import DemonstrationError

#: Parts that a recording, or the takes of a primitive, are cut into.
PARTS = 4
#: Vertical axis of the base; a reach rises or sinks along it.
_UP = 2

Named = tuple[str, Demonstrations]


@dataclass(frozen=True, slots=True)
class Split:
    """What is trained on and what is tested on.

    Attributes:
        design: The question asked. Much the same motion was seen: ``part``, a contiguous part of
            all recordings is held out; ``same``, a part of one primitive, trained on the rest of
            it (the paper's EXP1); ``block`` and ``interleaved``, whole reaches. Other motion was
            seen: ``recording``, one of them is held out; ``other``, a primitive, trained on the
            other primitives (EXP2); ``direction``, trained on reaches upwards, tested on those
            downwards, and the other way round.
        name: What is held out.
        train: Demonstrations.
        test: Held-out demonstrations.
    """

    design: str
    name: str
    train: Demonstrations
    test: Demonstrations


def splits_of(takes: Sequence[Named], parts: int = PARTS) -> list[Split]:
    """Cuts recordings of one person, whatever they show.

    Args:
        takes: Name and demonstrations of each recording.
        parts: Contiguous parts of the design ``part``.

    Returns:
        Each part of all recordings held out in turn, then each recording if there are several.

    Raises:
        DemonstrationError: No recordings.
    """
    whole = join([take for _, take in takes])
    out = _parts("part", "", whole, parts)
    if len(takes) > 1:
        out += _one_out("recording", [(name, [take]) for name, take in takes])
    return out


def splits_by_primitive(
    primitives: Mapping[str, Sequence[Named]], parts: int = PARTS
) -> list[Split]:
    """Cuts takes of several primitives by whether the same motion was seen.

    Args:
        primitives: Takes by what they show: reaching up, turning, ...
        parts: Parts the takes of a primitive are cut into: whole takes if there are as many, else
            contiguous parts.

    Returns:
        For each primitive its parts, each held out and trained on the rest of the primitive
        (``same``); then each primitive, trained on all others (``other``).

    Raises:
        DemonstrationError: A primitive without takes, or fewer than two primitives.
    """
    if len(primitives) < 2:
        raise DemonstrationError(
            f"{len(primitives)} primitive(s): to train on other motion takes of at least two are "
            "needed"
        )
    out = []
    for name, takes in primitives.items():
        out += _parts("same", f"{name}, ", join([take for _, take in takes]), parts)
    groups = [(name, [take for _, take in takes]) for name, takes in primitives.items()]
    return out + _one_out("other", groups)


def splits_by_reach(
    takes: Sequence[Named], parts: int = PARTS, *, neighbours: int = 1
) -> list[Split]:
    """Cuts recordings by the reaches in them, so that no reach is both trained and tested on.

    Args:
        takes: Name and demonstrations of each recording.
        parts: Parts the reaches are dealt into.
        neighbours: Reaches before and after a held-out block that are left out of both.

    Returns:
        ``block``: contiguous reaches of a recording held out, with neighbours left out.
        ``interleaved``: every so-manieth reach held out, trained on those between: the nearest a
        single recording comes to repetitions of a primitive. ``direction``: trained on reaches
        upwards and tested on those downwards, and the other way round, where there are at least
        ``parts`` of each. ``recording``: each recording held out, if there are several. A
        recording with fewer reaches than ``parts`` is cut into as many parts as it has reaches.

    Raises:
        DemonstrationError: No recordings, or no reach in any of them.
    """
    if not takes:
        raise DemonstrationError("no demonstrations: give at least one")
    found = [(name, find_reaches(take)) for name, take in takes]
    if not any(len(reaches) for _, reaches in found):
        raise DemonstrationError(
            "the hand makes no reach: record motion in which it travels at least 0.1 m at a time"
        )
    out: list[Split] = []
    for name, reaches in found:
        label = f"{name}, " if len(takes) > 1 else ""
        numbers = np.arange(len(reaches))
        count = min(parts, len(reaches))
        if count < 2:
            continue
        for part in np.array_split(numbers, count):
            out += _reach_split("block", label, reaches, part, neighbours)
        for first in range(count):
            out += _reach_split("interleaved", label, reaches, numbers[first::count], 0)
        rises = reaches.displacement[:, _UP] > 0.0 if reaches.displacement.shape[1] > _UP else None
        if rises is not None and min(rises.sum(), (~rises).sum()) >= parts:
            for direction, held in (("upwards", rises), ("downwards", ~rises)):
                where = f"{label}{direction}: "
                out += _reach_split("direction", where, reaches, np.flatnonzero(held), 0)
    if len(takes) > 1:
        groups = [(name, reaches) for name, reaches in found if len(reaches)]
        for name, reaches in groups:
            others = [other.demonstrations for label, other in groups if label != name]
            if others:
                all_reaches = slice(int(reaches.start[0]), int(reaches.stop[-1]))
                test = reaches.demonstrations.take(all_reaches)
                out.append(Split("recording", name, join(others), test))
    return out


def _reach_split(
    design: str, label: str, reaches: Reaches, held: NDArray[np.int64], neighbours: int
) -> list[Split]:
    try:
        train, test = reaches.holding_out(held.tolist(), neighbours)
    except DemonstrationError:
        return []  # three reaches: with its neighbours, the middle one leaves nothing
    if len(held) == held[-1] - held[0] + 1 and len(held) > 1:
        shown = f"reaches {held[0] + 1} to {held[-1] + 1}"
    elif len(held) == 1:
        shown = f"reach {held[0] + 1}"
    else:
        shown = f"reaches {', '.join(str(one + 1) for one in held)}"
    return [Split(design, f"{label}{shown} of {len(reaches)}", train, test)]


def _parts(design: str, label: str, whole: Demonstrations, parts: int) -> list[Split]:
    out = []
    for number, block in enumerate(whole.blocks(parts)):
        if not block.all():
            name = f"{label}part {number + 1} of {parts}"
            out.append(Split(design, name, whole.take(~block), whole.take(block)))
    return out


def _one_out(design: str, groups: Sequence[tuple[str, Sequence[Demonstrations]]]) -> list[Split]:
    out = []
    for number, (name, takes) in enumerate(groups):
        others = [one for k, (_, group) in enumerate(groups) if k != number for one in group]
        out.append(Split(design, name, join(others), join(list(takes))))
    return out
