"""Integration of many roll-outs side by side, one led step of the hand after another."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from prediction.following.familiarity import widening
from prediction.following.hand_noise import COHERENT_S, HandNoise
from prediction.following.hand_path import HandPath
from prediction.following.posture_batch import PostureBatch
from prediction.following.random_course import RandomCourse
from prediction.following.tip_targets import furthest

if TYPE_CHECKING:
    from prediction.following.rollout import Follower

Array = NDArray[np.float64]
Noise = Literal["coherent", "white", "none"]
NOISES: tuple[Noise, ...] = ("coherent", "white", "none")

#: Finest grid of a random function of travelled distance, s, and in correlation lengths.
CELL_S = 0.02
CELL_LENGTHS = 1.0 / 16.0
#: Longest way of one step that counts, correlation lengths: all is forgotten by then. At the edge
#: of reach the hardest direction makes any way endless.
LONGEST_STEP = 4.0


@dataclass(frozen=True, slots=True)
class Propagation:
    """Roll-outs of several paths at once; row 0 of each is its central path.

    Attributes:
        q: All joints, ``(C, 1 + S, T, n)``.
        hand_error_m: Of the tip, led or held, that is furthest off, ``(C, 1 + S, T)``.
        hand_error_rad: The same of orientation, ``(C, 1 + S, T)``.
        uncorrected_m: Hand error of the step to each point before it was corrected,
            ``(C, 1 + S, T)``.
        familiarity: ``(C, T)``.
        followed: ``(C, 1 + S, T)``.
        travelled: What the band's process runs in, along the central path, ``(C, T)`` s.
    """

    q: Array
    hand_error_m: Array
    hand_error_rad: Array
    uncorrected_m: Array
    familiarity: Array
    followed: NDArray[np.bool_]
    travelled: Array

    @classmethod
    def empty(cls, count: int, rows: int, points: int, joints: int) -> "Propagation":
        """Returns room for the roll-outs."""
        shape = (count, rows, points)
        return cls(
            np.empty((*shape, joints)),
            np.zeros(shape),
            np.zeros(shape),
            np.zeros(shape),
            np.zeros((count, points)),
            np.ones(shape, dtype=np.bool_),
            np.zeros((count, points)),
        )

    def store(self, point: int, batch: PostureBatch, familiarity: Array) -> None:
        """Writes the present postures at one point of the paths."""
        shape, linear = (batch.count, batch.rows), batch.linear
        self.q[:, :, point] = batch.all_joints().reshape(*shape, -1)
        self.hand_error_m[:, :, point] = furthest(batch.error[:, :linear]).reshape(shape)
        self.hand_error_rad[:, :, point] = furthest(batch.error[:, linear:]).reshape(shape)
        self.uncorrected_m[:, :, point] = furthest(batch.before[:, :linear]).reshape(shape)
        self.followed[:, :, point] = batch.followed.reshape(shape)
        self.familiarity[:, point] = familiarity


def propagate(
    follower: "Follower",
    paths: list[HandPath],
    q0: Array,
    samples: int,
    rng: np.random.Generator,
    *,
    hand: HandNoise | None = None,
    noise: Noise = "coherent",
    deviation: Array | None = None,
) -> Propagation:
    """Integrates several paths of equal length side by side.

    Args:
        follower: The law, in the precision to work in.
        paths: C checked paths of T points each.
        q0: All joints, ``(C, n)``, or ``(C, 1 + S, n)`` if every roll-out starts elsewhere.
        samples: Sampled roll-outs a path, S.
        rng: Randomness. It makes S persons, the same for every path however it is sampled.
        hand: The robot's repeatability; none if not given.
        noise: See `Follower.rollout`.
        deviation: How far the starts stray already, ``(C, 1 + S, r)`` rad; not at all if not given.

    Returns:
        The roll-outs. Nothing is raised for a hand that cannot follow: ``followed`` says so.
    """
    substeps = max(path.substeps() for path in paths)
    fine = [path.refined(substeps) for path in paths]
    times = np.stack([p.time_s for p in fine])
    count, points = len(paths), len(paths[0].time_s)
    if q0.ndim == 2:
        q0 = np.repeat(q0[:, None], samples + 1, axis=1)
    batch = PostureBatch(follower, q0)
    targets = batch.targets(fine)
    stray = _Stray(follower, count, samples, noise, rng, deviation)
    robot = _RobotError(HandNoise() if hand is None else hand, samples, noise, rng)
    out = Propagation.empty(count, samples + 1, points, q0.shape[-1])
    batch.correct_start(targets.at(0))
    familiarity = follower.familiarity.relative(batch.central(batch.q))
    out.store(0, batch, familiarity)
    for point in range(1, points):
        end = point * substeps
        if follower.band is not None:
            elapsed = times[:, end] - times[:, end - substeps]
            step, jacobian = batch.central_step(targets.at(end)), batch.central(batch.jacobian)
            moved = follower.band.travelled(step, jacobian, elapsed)
            moved = np.minimum(moved, LONGEST_STEP * follower.band.length)
            out.travelled[:, point] = out.travelled[:, point - 1] + moved
        change = stray.change(out.travelled[:, point], familiarity) / substeps
        white = stray.white()
        robot.advance()
        for index in range(end - substeps + 1, end + 1):
            share = index / substeps - (point - 1)
            offset = robot.at(times[:, index] - times[:, 0], share)
            dt = times[:, index] - times[:, index - 1]
            first = index == end - substeps + 1
            batch.advance(
                targets.at(index),
                offset,
                dt,
                change,
                white * substeps if first and white is not None else None,
            )
        familiarity = follower.familiarity.relative(batch.central(batch.q))
        out.store(point, batch, familiarity)
    return out


class _Stray:
    """How the samples stray from the central paths."""

    def __init__(
        self,
        follower: "Follower",
        count: int,
        samples: int,
        noise: Noise,
        rng: np.random.Generator,
        deviation: Array | None,
    ) -> None:
        kind, joints = follower.predictor.weights.dtype, len(follower.reduction.kept)
        self._deviation = np.zeros((count, samples + 1, joints), dtype=kind)
        if deviation is not None and noise == "coherent":
            self._deviation += deviation.astype(kind)
        self._rng = np.random.default_rng(rng.integers(2**63))
        self._white = noise == "white"
        self._course: RandomCourse | None = None
        band = follower.band
        if band is not None and noise == "coherent" and samples:
            cell = max(CELL_LENGTHS, CELL_S / band.length)
            self._course = RandomCourse(self._rng, samples, band.factor, cell)
            self._length = band.length
            self._place = np.zeros(count)
            self._value = self._course.at(self._place)

    def change(self, travelled: Array, familiarity: Array) -> Array:
        """Returns the change of the deviation on the way to a place, ``(C, 1 + S, r)`` rad.

        What is new of the random function is widened, what was there already fades:
        ``delta <- rho delta + widening (f(s) - rho f(s_before))``.
        """
        change = np.zeros_like(self._deviation)
        if self._course is not None:
            place = travelled / self._length
            value = self._course.at(place)
            kind = value.dtype
            rho = np.exp(self._place - place)[:, None, None].astype(kind)
            wide = widening(familiarity)[:, None, None].astype(kind)
            change[:, 1:] = (rho - 1) * self._deviation[:, 1:] + wide * (value - rho * self._value)
            self._deviation += change
            self._place, self._value = place, value
        return change

    def white(self) -> Array | None:
        """Returns normal numbers of one step, the same for every path, ``(C, 1 + S, r)``."""
        if not self._white:
            return None
        _, rows, joints = self._deviation.shape
        normal = np.zeros_like(self._deviation)
        normal[:, 1:] = self._rng.standard_normal((rows - 1, joints))
        return normal


class _RobotError:
    """Where the robot leads the hand, off its path."""

    def __init__(
        self, hand: HandNoise, samples: int, noise: Noise, rng: np.random.Generator
    ) -> None:
        self._scale = hand.deviation
        self._rng = np.random.default_rng(rng.integers(2**63))
        self._samples = samples
        self._none = noise == "none" or not self._scale.any() or samples == 0
        self._white = noise == "white"
        self._before = self._after = np.zeros((samples, 6))
        self._course = RandomCourse(self._rng, samples, np.diag(self._scale))

    def advance(self) -> None:
        """Goes on to the way to the next point."""
        if self._white and not self._none:
            normal = self._rng.standard_normal((self._samples, 6))
            self._before, self._after = self._after, normal * self._scale

    def at(self, elapsed_s: Array, share: float) -> Array | None:
        """Returns the error, ``(C, 1 + S, 6)`` m and rad, zero for the central path and at first.

        Args:
            elapsed_s: Time since the start, ``(C,)`` s.
            share: How much of the way between two points is done, 0 to 1.
        """
        if self._none:
            return None
        out = np.zeros((len(elapsed_s), self._samples + 1, 6))
        if not self._white:
            out[:, 1:] = self._course.at(elapsed_s / COHERENT_S)
            return out
        out[:, 1:] = (1 - share) * self._before + share * self._after
        return out
