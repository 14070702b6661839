"""How far the clock of the force plates is from that of the motion.

A person who squats or walks presses harder where their centre of mass is driven up: plates and
motion tell the same story, and it fits at one offset of the clocks only.
"""

from dataclasses import dataclass

import numpy as np

from estimation.errors import MeasurementError
from estimation.feet.plate_faults import mended_units, tared
from estimation.feet.plate_smoothing import resampled, smoothing_width_s
from estimation.feet.required_wrench import required_wrench
from estimation.spatial import GRAVITY_MS2, Array
from human import HumanModel, Motion
from human.marker_recording import PlateForces

#: Steps of the search, s.
_STEP_S = 0.002
#: Frames whose forces differ by more than this share of the weight are not compared: somebody
#: stands beside the plates there.
_COMPARED = 0.15
#: What the model itself leaves uncertain, s: nobody's skeleton is rigid.
_LEAST_SD_S = 0.003
#: A larger standard deviation than this, s, tells nothing.
_MOST_SD_S = 0.025
#: An offset is taken to differ from zero from so many standard deviations on.
_SURE = 3.0
#: Errors this far apart, s, have nothing to do with each other.
_MEMORY_S = 0.25
#: Another offset this far away, s, must leave this share of the movement more unexplained.
_APART_S, _WORSE = 0.1, 0.1
#: Plates must feel this share of the movement's variance.
_LEAST_EXPLAINED = 0.5
#: At least so many seconds must be comparable.
_LEAST_COMPARED_S = 0.5


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """What to add to the plates' times.

    Attributes:
        offset_s: the offset to use; zero where none was found, or none that differs from zero.
        estimated_s: what fits best, or None where the recording cannot tell.
        sd_s: its standard deviation, or None.
        words: what was found and what is used, for the user.
    """

    offset_s: float
    estimated_s: float | None
    sd_s: float | None
    words: str


def align(
    model: HumanModel,
    motion: Motion,
    plates: PlateForces,
    *,
    most_s: float = 0.5,
    window_s: float | None = None,
) -> ClockOffset:
    """Finds the offset at which plates and motion agree.

    Use it once for a recording, on a part in which the person moves with both feet on plates; give
    what it finds to `feet_from_plates`, or your own number if you know better.

    Args:
        model: the person.
        motion: what they do, with accelerations.
        plates: as read.
        most_s: largest offset looked for, either way, s.
        window_s: window that the accelerations were derived with, s; zero if they were measured,
            None takes what the motion's provenance says.

    Raises:
        MeasurementError: nothing to search, or no plates.

    Derived here: the offset minimizes the mean of ``min(|r|^2, c^2)``, ``r`` the difference between
    the plates' sum and the force the motion needs, over body weight; the bound leaves frames out in
    which a foot stands beside the plates. Its variance is ``sum_ij g_i g_j C_ij / (sum g_i^2)^2``,
    ``g`` the force's rate of change and ``C`` the covariance of the residuals over a quarter of a
    second, as they are; one ``g`` is the plates', one the motion's, to keep
    the noise of either out.
    """
    if not most_s > 0.0 or not plates.plates:
        raise MeasurementError(
            f"clocks: expected plates and a positive most_s, got {len(plates.plates)} plates and "
            f"{most_s:g} s"
        )
    weight = GRAVITY_MS2 * model.total_mass_kg
    needed = required_wrench(model, motion)[:, :3] / weight
    summed, clock = _sum_of_plates(plates, weight, smoothing_width_s(motion, window_s))
    reach = round(most_s / _STEP_S)
    offsets: Array = _STEP_S * np.arange(-reach, reach + 1, dtype=np.float64)
    bias = np.zeros(3)
    cost = np.empty(0)
    # Load and a wrong body mass are constant forces: the second round leaves them out.
    for _ in range(2):
        cost = np.array(
            [_cost(_difference(summed, clock, motion.time_s - s, needed) - bias) for s in offsets]
        )
        best = int(np.argmin(cost))
        left = _difference(summed, clock, motion.time_s - offsets[best], needed)
        close = np.linalg.norm(left, axis=1) < 2.0 * _COMPARED
        bias = np.median(left[close], axis=0) if np.any(close) else bias
    step = float(np.median(np.diff(motion.time_s))) if len(motion) > 1 else 0.0
    if step * np.count_nonzero(close) < _LEAST_COMPARED_S:
        return _untold("the plates never bear what the motion needs for long enough to compare")
    estimated = _lowest(offsets, cost, best)
    sd, explained, movement = _deviation(summed, clock, motion.time_s - estimated, needed, bias)
    if not sd <= _MOST_SD_S or explained < _LEAST_EXPLAINED:
        return _untold("the person moves too little, or too unlike what the plates feel")
    if best in (0, len(offsets) - 1):
        return _untold(f"what fits best lies at the edge of the {most_s:g} s looked at")
    apart = np.abs(offsets - estimated) > _APART_S
    dips = apart & (cost <= np.roll(cost, 1)) & (cost <= np.roll(cost, -1))
    if np.any(dips) and float(cost[dips].min()) < cost[best] + _WORSE * movement:
        other = float(offsets[dips][np.argmin(cost[dips])])
        return _untold(f"offsets of {estimated:+.3f} and {other:+.3f} s fit almost alike")
    told = f"plates' clock: {estimated:+.3f} s fits best (sd {sd:.3f} s)"
    if abs(estimated) <= max(_SURE * sd, 0.5 * step):
        return ClockOffset(0.0, estimated, sd, f"{told}, too near zero to count; left as it is")
    return ClockOffset(estimated, estimated, sd, f"{told}; added to the plates' times")


def _untold(why: str) -> ClockOffset:
    return ClockOffset(0.0, None, None, f"plates' clock: cannot be told ({why}); taken as it is")


def _sum_of_plates(plates: PlateForces, weight_n: float, width_s: float) -> tuple[Array, Array]:
    """Returns the plates' sum over body weight, smoothed, on an even grid of their own clock."""
    mended, _, _ = mended_units(plates, weight_n, lambda _: np.inf)
    nobody = np.zeros(mended.force.shape[:2], dtype=np.bool_)
    mended, *_ = tared(mended, weight_n, nobody)
    count = max(2, int(np.ceil((mended.time_s[-1] - mended.time_s[0]) / _STEP_S)) + 1)
    clock = mended.time_s[0] + _STEP_S * np.arange(count)
    total = mended.force.sum(axis=1) / weight_n
    return resampled(mended.time_s, total, clock, width_s), clock


def _difference(summed: Array, clock: Array, at_s: Array, needed: Array) -> Array:
    """Returns the plates' sum less what is needed ``(frames, 3)``, infinite beyond the plates."""
    out = np.stack([np.interp(at_s, clock, summed[:, k]) for k in range(3)], axis=1) - needed
    out[(at_s < clock[0]) | (at_s > clock[-1])] = np.inf
    return out


def _cost(difference: Array) -> float:
    """Returns the mean bounded square, of frames that the plates cover; the bound if few are."""
    inside = np.isfinite(difference[:, 0])
    if 2 * np.count_nonzero(inside) < len(inside):
        return _COMPARED**2
    return float(np.mean(np.minimum(np.sum(difference[inside] ** 2, axis=1), _COMPARED**2)))


def _lowest(offsets: Array, cost: Array, best: int) -> float:
    """Returns the lowest point of the parabola through the best offset and its neighbours."""
    if not 0 < best < len(cost) - 1:
        return float(offsets[best])
    before, here, after = cost[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(offsets[best] + shift * _STEP_S)


def _deviation(
    summed: Array, clock: Array, at_s: Array, needed: Array, bias: Array
) -> tuple[float, float, float]:
    """Returns the standard deviation of the offset, s, and what of the movement is explained.

    The latter as a share, and the movement itself as its mean square over all frames. What plates
    and motion change alike tells the offset; noise of either changes alone.
    """
    left = _difference(summed, clock, at_s, needed) - bias
    compared = np.linalg.norm(left, axis=1) < _COMPARED
    left[~compared] = 0.0
    step = float(np.median(np.diff(at_s)))
    rate = np.gradient(summed, _STEP_S, axis=0)
    by_plates = np.stack([np.interp(at_s, clock, rate[:, k]) for k in range(3)], axis=1)
    by_motion = np.gradient(needed, step, axis=0)
    by_plates[~compared] = 0.0
    power = float(np.sum(by_plates * by_motion))
    moves = float(np.sum((needed[compared] - needed[compared].mean(axis=0)) ** 2))
    explained = 1.0 - float(np.sum(left**2)) / max(moves, 1e-12)
    if not power > 0.0:
        return np.inf, explained, moves
    score = np.sum(by_motion * left, axis=1)
    variance = float(score @ score)
    lags = min(max(1, round(_MEMORY_S / step)), len(score) - 1)
    for lag in range(1, lags + 1):
        variance += 2.0 * (1.0 - lag / (lags + 1.0)) * float(score[lag:] @ score[:-lag])
    return (
        float(np.hypot(np.sqrt(max(variance, 0.0)) / power, _LEAST_SD_S)),
        explained,
        moves / len(at_s),
    )
