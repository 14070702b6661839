"""What a method does on motion it was not fitted on: roll-outs from measured starts."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from prediction.chain import JointReduction, Task, TaskChain
from prediction.demonstrations import Demonstrations
from prediction.following.familiarity import Familiarity, widening
from prediction.following.hand_path import HandPath
from prediction.following.joint_limits import JointLimits
from prediction.following.posture_band import PostureBand, fit_band
from prediction.following.propagation import Noise, Propagation, propagate
from prediction.following.rollout import Follower
from prediction.laws.memory import NullSpaceMemory
from prediction.laws.predictor import Predictor, ShouldStop, check_stop
from prediction.laws.student_t import DEGREES, NINETY, most_likely_tails

Array = NDArray[np.float64]

#: Longest horizon of a held-out roll-out, s, and fastest rate it is stepped at, 1/s.
HORIZON_S = 2.0
RATE_HZ = 30.0
#: Fewest points of a stretch worth rolling out.
MIN_POINTS = 6
#: Most stretches a held-out block is cut into.
MAX_STRETCHES = 8


@dataclass(frozen=True, slots=True)
class Stretches:
    """Pieces of recorded motion of equal length, each with a measured start.

    Attributes:
        index: Samples of each piece, ``(C, T)``.
    """

    index: NDArray[np.int64]

    @classmethod
    def of(
        cls,
        demonstrations: Demonstrations,
        horizon_s: float = HORIZON_S,
        *,
        overlap: float = 0.5,
        at_most: int = MAX_STRETCHES,
    ) -> "Stretches":
        """Cuts takes into pieces of a horizon, or of the shortest half take if takes are shorter.

        Args:
            demonstrations: Samples in time order.
            horizon_s: Length of a piece, s.
            overlap: Share of a piece that the next one repeats, in [0, 1).
            at_most: Most pieces; they are spread evenly.

        Returns:
            The pieces; none if every take is too short.
        """
        pieces = []
        ids, time_s = demonstrations.trajectory_id, demonstrations.time_s
        within = np.diff(time_s)[np.diff(ids) == 0]
        if len(within) == 0:
            return cls(np.empty((0, 0), dtype=np.int64))
        typical = float(np.median(within))
        # A hole in a take (a block left out of its middle) ends a piece as well.
        runs = demonstrations.runs()
        stride = max(1, int(np.floor(1.0 / (RATE_HZ * typical) + 1e-6)))
        points = round(horizon_s / (stride * typical)) + 1
        longest = max((len(run) - 1) // stride + 1 for run in runs)
        points = min(points, longest)
        if points < MIN_POINTS:
            return cls(np.empty((0, 0), dtype=np.int64))
        hop = max(1, round(points * (1.0 - overlap))) * stride
        for run in runs:
            last = len(run) - (points - 1) * stride
            for start in range(0, max(last, 0), hop):
                pieces.append(run[start : start + (points - 1) * stride + 1 : stride])
        if len(pieces) > at_most:
            chosen = np.unique(np.linspace(0, len(pieces) - 1, at_most).round().astype(int))
            pieces = [pieces[i] for i in chosen]
        return cls(np.array(pieces, dtype=np.int64))

    @classmethod
    def by_length(cls, demonstrations: Demonstrations) -> list["Stretches"]:
        """Cuts every run: pieces of `HORIZON_S`, half overlapping, or the whole of a shorter run.

        Unlike `of`, which takes pieces of one length, this leaves no run out for being short.

        Args:
            demonstrations: Samples in time order.

        Returns:
            Pieces of equal length together, the longest first.
        """
        by_length: dict[int, list[NDArray[np.int64]]] = {}
        for run in demonstrations.runs():
            found = cls.of(demonstrations.take(run), at_most=len(run))
            for index in found.index:
                by_length.setdefault(len(index), []).append(run[index])
        out = []
        for length in sorted(by_length, reverse=True):
            pieces = by_length[length]
            spread = np.linspace(0, len(pieces) - 1, min(MAX_STRETCHES, len(pieces)))
            out.append(cls(np.array([pieces[k] for k in spread.round().astype(int)])))
        return out


def recorded_paths(
    chain: TaskChain, demonstrations: Demonstrations, stretches: Stretches, task: Task
) -> list[HandPath]:
    """Returns the recorded hand paths of the stretches (all joints in ``demonstrations``)."""
    return [
        HandPath.recorded(chain, demonstrations.q[index], demonstrations.time_s[index], task)
        for index in stretches.index
    ]


@dataclass(frozen=True, slots=True)
class HeldOutRun:
    """Roll-outs on recorded stretches, and what the person did.

    Attributes:
        run: The roll-outs.
        truth: Recorded postures, all joints, ``(C, T, n)`` rad.
        elapsed_s: Time since each start, ``(C, T)`` s.
    """

    run: Propagation
    truth: Array
    elapsed_s: Array

    @property
    def error(self) -> Array:
        """Central path minus recorded posture, ``(C, T, n)`` rad."""
        return np.asarray(self.run.q[:, 0] - self.truth)


def run_held_out(
    follower: Follower,
    demonstrations: Demonstrations,
    stretches: Stretches,
    samples: int,
    rng: np.random.Generator,
    *,
    noise: Noise = "coherent",
) -> HeldOutRun:
    """Rolls out on the recorded hand path of every stretch.

    Args:
        follower: The fitted law.
        demonstrations: Recorded motion it was not fitted on, all joints.
        stretches: Pieces of it.
        samples: Sampled postures a piece.
        rng: Randomness.
        noise: See `Follower.rollout`.

    Returns:
        The roll-outs beside the truth.
    """
    paths = recorded_paths(follower.chain, demonstrations, stretches, follower.task)
    truth = demonstrations.q[stretches.index]
    run = propagate(follower, paths, truth[:, 0], samples, rng, noise=noise)
    time_s = demonstrations.time_s[stretches.index]
    return HeldOutRun(run, truth, time_s - time_s[:, :1])


def sampled_interval(samples: Array, axis: int = 0) -> tuple[Array, Array]:
    """Returns the ends of the 90 % interval that samples of a law give.

    A further draw falls between them with probability .9 however few samples there are (19 at
    least): the distance of the i-th smallest and the j-th of S covers ``(j - i) / (S + 1)`` on
    average, so the ends stand at ranks ``.05 (S + 1)`` and ``.95 (S + 1)``. Quantiles of the
    samples themselves would hold .86 with 50 of them.
    """
    low, high = np.quantile(samples, [0.05, 0.95], axis=axis, method="weibull")
    return low, high


@dataclass(frozen=True, slots=True)
class Calibration:
    """What held-out demonstrations say about the width of a method's bands.

    Attributes:
        band: Coherent deviation of posture.
        variance_factor: What the one-step variance was multiplied by.
        degrees: Degrees of freedom of the one-step law; infinite if it is Gaussian, or the method
            has tails of its own.
        coverage_one_step: Share of held-out joint velocities in the 90 % interval, before and
            after.
        coverage_rollout: Share of held-out postures in the sampled 90 % band, before the last
            scaling; None if they were too short to roll out on.
        rollout_rmse_deg: Joint error of the central paths on the held-out parts, or None as above.
        null_log_likelihood: Held-out density of the null-space velocity, nats, with the factor.
        memory: What the step before tells, or None if it tells nothing.
    """

    band: PostureBand
    variance_factor: float
    degrees: float
    coverage_one_step: tuple[float, float]
    coverage_rollout: float | None
    rollout_rmse_deg: float | None
    null_log_likelihood: float
    memory: NullSpaceMemory | None


def calibrate(
    predictor: Predictor,
    demonstrations: Demonstrations,
    chain: TaskChain,
    reduction: JointReduction,
    limits: JointLimits,
    task: Task,
    rng: np.random.Generator,
    *,
    blocks: int = 4,
    samples: int = 16,
    refit: Callable[[Demonstrations], Predictor] | None = None,
    should_stop: ShouldStop | None = None,
) -> Calibration:
    """Measures a method's bands on contiguous blocks of its demonstrations, each left out in turn.

    Blocks, not single samples: neighbours in time repeat each other, and a band fitted on repeats
    is too narrow for anything new.

    Args:
        predictor: Fitted on all of them.
        demonstrations: All joints, task rows of ``task``.
        chain: The whole chain.
        reduction: Learned joints.
        limits: Bounds.
        task: Pose or position.
        rng: Randomness of the sampled check.
        blocks: Parts.
        samples: Sampled postures in the check.
        refit: Fits the method to a part, learned joints only; by default with the hyper-parameters
            of all, which flatters a method that has more than a handful of them.
        should_stop: Asked for each block.

    Returns:
        The calibration; with demonstrations too short to roll out on, the band is made from
        one-step scatter coherent over 0.3 s.
    """
    learned = demonstrations.reduced(reduction)
    familiarity = Familiarity.of(learned, blocks)
    moment = learned.qdot.T @ learned.qdot / len(learned)
    moment = moment + 0.1 * np.diag(np.diagonal(moment))
    folds: list[_Fold] = []
    parts: list[tuple[Predictor, Demonstrations]] = []
    white, inside = [], []
    for block in learned.blocks(blocks):
        check_stop(should_stop)
        fitted = (refit or predictor.refitted)(learned.take(~block))
        held = learned.take(block)
        parts.append((fitted, held))
        white.append(fitted.standardised_residuals(held))
        inside.append(_standardised_joints(fitted, held))
        follower = Follower(
            fitted,
            chain,
            reduction,
            limits,
            PostureBand(np.eye(len(moment)), 1.0, moment),
            familiarity.without(learned.take(~block)),
            task,
        )
        part = demonstrations.take(block)
        stretches = Stretches.of(part)
        if len(stretches.index):
            folds.append(_Fold(follower, part, stretches))
    degrees, factor = most_likely_tails(
        np.concatenate(white), DEGREES if predictor.fits_tails else ()
    )
    standard = np.concatenate(inside)
    one_step = (
        float((standard <= predictor.ninety).mean()),
        float((standard <= predictor.with_tails(degrees).ninety * np.sqrt(factor)).mean()),
    )
    nats = np.concatenate(
        [_null_density(f.rescaled(factor).with_tails(degrees), held) for f, held in parts]
    )
    density = float(nats.mean())
    memory = NullSpaceMemory.fit(parts)
    if not folds:
        scatter = np.sqrt(factor) * 0.3 * np.linalg.cholesky(0.5 * moment)
        band = PostureBand(scatter, 1.0, moment)
        return Calibration(band, factor, degrees, one_step, None, None, density, memory)
    band, error = _fit(folds, rng, reduction)
    covered, ratio = _sampled(folds, band, rng, samples, reduction)
    band = band.rescaled(ratio)
    return Calibration(band, factor, degrees, one_step, covered, error, density, memory)


@dataclass(frozen=True, slots=True)
class _Fold:
    follower: Follower
    demonstrations: Demonstrations
    stretches: Stretches


def _standardised_joints(predictor: Predictor, held: Demonstrations) -> Array:
    prediction = predictor.predict(held.q, held.xdot, held.jacobian)
    deviation = np.sqrt((prediction.null_factor**2).sum(-1))
    return np.asarray(np.abs(held.qdot - prediction.mean) / np.maximum(deviation, 1e-12))


def _null_density(predictor: Predictor, held: Demonstrations) -> Array:
    sigma_x = np.eye(held.jacobian.shape[1])  # of the task term, which is not asked for
    return predictor.log_prob(held.q, held.xdot, held.qdot, held.jacobian, sigma_x).null_space


def _fit(
    folds: list[_Fold], rng: np.random.Generator, reduction: JointReduction
) -> tuple[PostureBand, float]:
    """Returns the band of the central paths' errors, and their root mean square, deg."""
    errors, distance, elapsed, widened, squares = [], [], [], [], []
    for fold in folds:
        held = run_held_out(fold.follower, fold.demonstrations, fold.stretches, 0, rng)
        squares.append((held.error[:, 1:] ** 2).ravel())
        moved = held.elapsed_s > 0.0
        errors.append(held.error[..., reduction.kept][moved])
        distance.append(held.run.travelled[moved])
        elapsed.append(held.elapsed_s[moved])
        # The band is widened step by step along the way: its mean so far stands for it here.
        steps = np.arange(1, moved.shape[1] + 1)
        mean = np.cumsum(widening(held.run.familiarity), axis=1) / steps
        widened.append(mean[moved])
    band = folds[0].follower.band
    assert band is not None
    fitted = fit_band(
        np.concatenate(errors),
        np.concatenate(distance),
        np.concatenate(elapsed),
        np.concatenate(widened),
        band.rate_moment,
    )
    return fitted, float(np.degrees(np.sqrt(np.concatenate(squares).mean())))


def _sampled(
    folds: list[_Fold],
    band: PostureBand,
    rng: np.random.Generator,
    samples: int,
    reduction: JointReduction,
) -> tuple[float, float]:
    """Returns coverage of sampled 90 % bands and the factor that would make it .9.

    The deviation is pushed into the null space, where it also accumulates, so the sampled spread is
    not exactly the fitted one. Sixteen samples tell a deviation to 18 %: for the band's own process
    the factor is 1.07 and the coverage .88 (1.02 and .89 with 48). Bands stay that much too wide
    rather than too narrow: new motion is less like the held-out parts than they are like the rest.
    """
    ratios, covered = [], []
    for fold in folds:
        follower = replace(fold.follower, band=band)
        held = run_held_out(follower, fold.demonstrations, fold.stretches, samples, rng)
        learned = reduction.kept
        q = held.run.q[..., learned]
        deviation = np.sqrt(((q[:, 1:] - q[:, :1]) ** 2).mean(axis=1))
        error = np.abs(held.error[..., learned])
        moved = held.elapsed_s > 0.0
        ratio = (error / np.maximum(deviation, 1e-9))[moved]
        ratios.append(ratio.ravel())
        covered.append((ratio <= NINETY).ravel())
    ratio = np.concatenate(ratios)
    factor = float(np.clip(np.quantile(ratio, 0.9) / NINETY, 0.3, 3.0))
    return float(np.concatenate(covered).mean()), factor
