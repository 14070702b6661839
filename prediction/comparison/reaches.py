"""Reaches: the pieces of a recording in which the hand goes from one place to another.

Recordings seldom come cut into the led motions a model is asked about. The hand slows down between
one purpose and the next, so the recording is cut where its speed has a minimum that is deep beside
the peaks on both sides. Whole reaches are then what is held out, never half of one.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prediction.demonstrations import Demonstrations
from prediction.errors import DemonstrationError

Array = NDArray[np.float64]

#: Deviation of the Gaussian that hand speed is smoothed with before minima are looked for, s.
SMOOTH_S = 0.05
#: A minimum is a cut if its speed is at most this share of the lesser of the peaks beside it.
SLOWING = 0.5
#: Below this speed the hand rests, m/s; rest at the ends of a reach is not part of it.
REST_M_S = 0.05
#: Shortest reach in time, s, and in way of the hand, m; what is shorter is fidgeting.
LEAST_S = 0.3
LEAST_M = 0.1


@dataclass(frozen=True, slots=True)
class Reaches:
    """Reaches of one person, in the order of the recording.

    Attributes:
        demonstrations: What they were found in.
        start: First sample of each, ``(R,)``.
        stop: One past its last, ``(R,)``.
        nearest: The reach each sample belongs to or is nearest to within its run, ``(N,)``; -1 in
            runs without a reach.
        displacement: Where the hand ends from where it began, base axes, ``(R, p)`` m.
        way_m: Length of the hand's way, ``(R,)`` m.
    """

    demonstrations: Demonstrations
    start: NDArray[np.int64]
    stop: NDArray[np.int64]
    nearest: NDArray[np.int64]
    displacement: Array
    way_m: Array

    def __len__(self) -> int:
        """Number of reaches."""
        return len(self.start)

    @property
    def duration_s(self) -> Array:
        """Time from first to last sample of each, ``(R,)`` s."""
        time_s = self.demonstrations.time_s
        return np.asarray(time_s[self.stop - 1] - time_s[self.start])

    def holding_out(
        self, held: Sequence[int], neighbours: int = 0
    ) -> tuple[Demonstrations, Demonstrations]:
        """Splits the recording by whole reaches.

        Args:
            held: Numbers of the reaches to hold out.
            neighbours: How many reaches before and after each held one, in its take, are left out
                of both: they begin or end in its postures.

        Returns:
            What is trained on: all samples that are not nearest to a reach held or left out. And
            what is tested on: the held reaches, with the rest between two that follow each other.

        Raises:
            DemonstrationError: Nothing is held out, or nothing remains to train on.
        """
        held = sorted(set(held))
        if not held:
            raise DemonstrationError("no reach is held out: name at least one")
        take = self.demonstrations.trajectory_id[self.start]
        left_out = {
            other
            for one in held
            for other in range(one - neighbours, one + neighbours + 1)
            if 0 <= other < len(self) and take[other] == take[one]
        }
        train = ~np.isin(self.nearest, sorted(left_out))
        test = np.zeros(len(train), dtype=np.bool_)
        for one in held:
            test[self.start[one] : self.stop[one]] = True
        for one, following in itertools.pairwise(held):
            between = slice(int(self.stop[one]), int(self.start[following]))
            if following == one + 1 and take[one] == take[following]:
                test[between] = True
        if not train.any():
            raise DemonstrationError(
                f"{len(self)} reaches, of which {len(left_out)} are held out or beside one held "
                "out: nothing remains to train on; give a longer recording or hold out fewer"
            )
        return self.demonstrations.take(train), self.demonstrations.take(test)


def find_reaches(demonstrations: Demonstrations) -> Reaches:
    """Cuts demonstrations into reaches.

    In each run without a hole, hand speed (linear, in base axes; of two hands, of the point between
    them) is smoothed and cut at its minima.
    The shallowest minimum goes first, until each left is at most `SLOWING` of the lesser of the two
    peaks beside it. Of each piece, samples at rest at either end are dropped; what then is shorter
    than `LEAST_S` or leads the hand less than `LEAST_M` is no reach.

    Args:
        demonstrations: Motion in time order, all joints.

    Returns:
        The reaches; none if the hand hardly moves.

    Derived here: a point-to-point motion has one peak of speed; minima are judged beside the peaks
    and not in m/s, so the same motion at half the speed has the same cuts. The thresholds were set
    by eye on recordings of handling, punching, squatting and sitting down.
    """
    linear = _led_velocity(demonstrations)
    speed, time_s = np.linalg.norm(linear, axis=1), demonstrations.time_s
    found: list[tuple[int, int, Array, float]] = []
    nearest = np.full(len(demonstrations), -1, dtype=np.int64)
    for run in demonstrations.runs():
        first, begin = len(found), int(run[0])
        smooth = _smoothed(speed[run], time_s[run])
        for left, right in _pieces(smooth):
            moving = np.flatnonzero(smooth[left:right] > REST_M_S)
            if len(moving) < 2:
                continue
            piece = slice(begin + left + int(moving[0]), begin + left + int(moving[-1]) + 1)
            step = np.diff(time_s[piece])
            way = float((0.5 * (speed[piece][1:] + speed[piece][:-1]) * step).sum())
            if step.sum() >= LEAST_S and way >= LEAST_M:
                mean = 0.5 * (linear[piece][1:] + linear[piece][:-1])
                found.append((piece.start, piece.stop, (mean * step[:, None]).sum(axis=0), way))
        edges = [(found[k][1] + found[k + 1][0]) // 2 for k in range(first, len(found) - 1)]
        if len(found) > first:
            nearest[run] = first + np.searchsorted(edges, run, side="right")
    return Reaches(
        demonstrations,
        np.array([one[0] for one in found], dtype=np.int64),
        np.array([one[1] for one in found], dtype=np.int64),
        nearest,
        np.array([one[2] for one in found]).reshape(len(found), linear.shape[1]),
        np.array([one[3] for one in found]),
    )


def _led_velocity(demonstrations: Demonstrations) -> Array:
    """Returns the velocity of the led hand, or of the middle between two, ``(N, p)`` m/s."""
    size = min(demonstrations.linear_rows, 3)
    tips = demonstrations.xdot[:, : demonstrations.linear_rows].reshape(
        len(demonstrations), -1, size
    )
    return np.asarray(tips[:, demonstrations.held_tips :].mean(axis=1))


def _smoothed(speed: Array, time_s: Array) -> Array:
    """Returns speed smoothed by a Gaussian of `SMOOTH_S`, its ends mirrored."""
    if len(speed) < 3:
        return speed
    step = float(np.median(np.diff(time_s)))
    half = min(int(np.ceil(3.0 * SMOOTH_S / step)), len(speed) - 1)
    weight = np.exp(-0.5 * (np.arange(-half, half + 1) * step / SMOOTH_S) ** 2)
    padded = np.pad(speed, half, mode="reflect")
    return np.asarray(np.convolve(padded, weight / weight.sum(), mode="valid"))


def _pieces(speed: Array) -> list[tuple[int, int]]:
    """Returns first sample and one past the last of each piece between deep minima."""
    falling = speed[1:-1] <= speed[:-2]
    cuts = [0, *(np.flatnonzero(falling & (speed[1:-1] < speed[2:])) + 1).tolist(), len(speed)]
    while len(cuts) > 2:
        peaks = [speed[a:b].max() for a, b in itertools.pairwise(cuts)]
        depth = [
            speed[cut] / max(min(peaks[k], peaks[k + 1]), 1e-12) for k, cut in enumerate(cuts[1:-1])
        ]
        shallowest = int(np.argmax(depth))
        if depth[shallowest] <= SLOWING:
            break
        del cuts[shallowest + 1]
    return list(itertools.pairwise(cuts))
