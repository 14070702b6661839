"""Whose foot stands on which plate, decided for a whole stance at once."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.errors import MeasurementError
from estimation.feet.foot_force_record import PlateStance
from estimation.feet.likeliest_path import likeliest_path
from estimation.feet.plate_faults import loaded_runs
from estimation.feet.plate_smoothing import resampled
from estimation.feet.soles import Soles
from estimation.spatial import Array
from human.marker_recording import PlateForces

Mask = NDArray[np.bool_]

#: States of a loaded plate.
FEET = ("right", "left", "both", "none")
BOTH, NONE = 2, 3
#: The force enters this far outside of the model's sole as a matter of course, m, and sd, m.
_SOLE_MARGIN_M, _SOLE_SD_M = 0.02, 0.03
#: A standing sole's lowest corner is below this height, m, and its sd, m.
_LOW_M, _LOW_SD_M = 0.05, 0.03
#: No cue alone counts for more than this many nats an instant.
_MOST = 12.0
#: Costs of an instant under neither foot; of both feet; of changing feet amid a load; of one foot
#: where the other one stands on the same plate, or of both where one is beside it; of a foot that
#: by its movement is in the air.
_NEITHER, _PAIR, _SWITCH, _MISPLACED, _IN_THE_AIR = 8.0, 1.0, 6.0, 4.0, 3.0
#: Instants so far apart, s, are taken to be independent of each other.
_INDEPENDENT_S = 0.05
#: A sole is on a plate from this share of it on.
_ON_PLATE = 0.5
#: Without corners, a plate reaches this far beyond where more than so many N entered, m.
_REACH_M, _SURE_N = 0.1, 50.0
#: A foot is visited by the force from this share of the time on.
_NOW_AND_THEN = 0.05
#: Forces are smoothed over this time before their point of entry is looked at, s.
_POINT_WINDOW_S = 0.04


@dataclass(frozen=True, slots=True)
class LoadedTime:
    """A time that one plate was loaded, and by which foot.

    Attributes:
        plate: index.
        foot: index in ``FEET``.
        start_s: the plate's clock put on the motion's.
        end_s: the same.
        distance_m: median distance of the force from the sole.
        given: whether the caller said so.
    """

    plate: int
    foot: int
    start_s: float
    end_s: float
    distance_m: float
    given: bool

    def record(self, plates: PlateForces) -> PlateStance:
        """Returns what the user is shown."""
        return PlateStance(
            plates.plates[self.plate].name,
            FEET[self.foot],
            self.start_s,
            self.end_s,
            self.distance_m,
            self.given,
        )


@dataclass(frozen=True, slots=True)
class Standing:
    """The feet at the motion's frames.

    Attributes:
        time_s: ``(frames,)`` s.
        soles: their corners.
        down: ``(frames, 2)`` whether each foot stands, by its movement alone.
        floor_m: ``(2,)`` height of each sole when it stands.
    """

    time_s: Array
    soles: Soles
    down: Mask
    floor_m: Array


def loaded_times(
    plates: PlateForces, standing: Standing, assign: Mapping[str, str] | None = None
) -> list[LoadedTime]:
    """Gives every load of every plate to a foot, to both, or to none.

    Args:
        plates: put right, their times on the motion's clock.
        standing: the feet.
        assign: plate name to ``right``, ``left`` or ``both``, where the caller knows.

    Raises:
        MeasurementError: ``assign`` names no such plate or no such foot.

    Derived here: costs are negative log likelihoods, of how far outside of each sole the force
    enters and how high that sole is; changing feet during one load costs as much as a tenth of a
    second of clear evidence against it, so a stance is decided as a whole.
    """
    names = [plate.name for plate in plates.plates]
    for plate, foot in (assign or {}).items():
        if plate not in names or foot not in FEET[:NONE]:
            raise MeasurementError(
                f"assign: expected one of the plates {', '.join(names)} to be right, left or both, "
                f"got {plate!r}: {foot!r}"
            )
    out = []
    nearest = np.searchsorted(
        0.5 * (standing.time_s[1:] + standing.time_s[:-1]), plates.time_s, side="right"
    )
    for k, name in enumerate(names):
        on = stood_on(plates, k, standing)
        occupied = np.asarray(on.any(axis=1))[nearest]
        spans = loaded_runs(plates.time_s, plates.force[:, k, 2], occupied)
        point, bears = force_points(plates, k, standing.time_s)
        outside = standing.soles.outside_m(point)
        cost = _costs(standing, np.where(bears[:, None], outside, 0.0), on)
        for first, last in spans:
            start, end = plates.time_s[first], plates.time_s[last - 1]
            frames = np.flatnonzero((standing.time_s >= start) & (standing.time_s <= end))
            if not np.any(bears[frames]):
                continue
            if assign and name in assign:
                path = np.full(len(frames), FEET.index(assign[name]))
            else:
                path = likeliest_path(cost[frames], _SWITCH * (1.0 - np.eye(len(FEET))))
            distance = np.where(bears[:, None], outside, np.nan)
            given = bool(assign) and name in (assign or {})
            out += _pieces(k, frames, path, (start, end), standing.time_s, distance, given)
    return sorted(out, key=lambda load: (load.start_s, load.plate))


def stood_on(plates: PlateForces, k: int, standing: Standing) -> Mask:
    """Returns when a standing foot is on a plate ``(frames, 2)``, whether or not it bears.

    Of a plate whose corners are not known each foot knows what forces entered under it. Where
    this plate alone bears, and the force enters between two standing feet, both are on it.
    """
    area = plates.plates[k].corners
    if area is not None:
        return np.asarray(standing.down & (standing.soles.share_inside([area]) >= _ON_PLATE))
    point, bears = force_points(plates, k, standing.time_s, _SURE_N)
    outside = standing.soles.outside_m(point)
    near = outside < _SOLE_MARGIN_M
    on = np.zeros_like(standing.down)
    for foot in (0, 1):
        under = bears & near[:, foot] & ~near[:, 1 - foot]
        if np.any(under):
            on[:, foot] = _within(point[under], _REACH_M, standing)[:, foot]
    for other in range(len(plates.plates)):
        if other != k:
            bears &= ~force_points(plates, other, standing.time_s, _SURE_N)[1]
    between: Mask = bears & near[:, BOTH] & ~near[:, 0] & ~near[:, 1] & standing.down.all(axis=1)
    # For most of that time, or on the way from one foot to the other: the force of a light foot
    # enters anywhere for a moment.
    times = np.array([np.count_nonzero(bears & near[:, foot]) for foot in (0, 1)])
    alone, share = np.count_nonzero(bears), np.count_nonzero(between)
    if 2 * share > alone or (share and np.all(times > _NOW_AND_THEN * alone)):
        ground = standing.soles.corners[between][..., :2].reshape(-1, 2)
        on |= _within(ground, 0.0, standing) & bears[:, None]
    return on


def _within(points: Array, reach_m: float, standing: Standing) -> Mask:
    """Returns when a standing foot is in the box about most of some points ``(frames, 2)``."""
    low, high = np.percentile(points, (2, 98), axis=0)
    (x0, y0), (x1, y1) = low - reach_m, high + reach_m
    area = np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])
    return np.asarray(standing.down & (standing.soles.share_inside([area]) >= _ON_PLATE))


def force_points(
    plates: PlateForces, k: int, time_s: Array, least_n: float = 5.0
) -> tuple[Array, Mask]:
    """Returns where a plate's force enters, ``(frames, 2)`` m, and where it bears ``least_n``."""
    origin = plates.plates[k].origin
    height = plates.plates[k].surface_height_m - origin[2]
    wrench = resampled(
        plates.time_s,
        np.concatenate([plates.force[:, k], plates.moment[:, k]], axis=1),
        time_s,
        _POINT_WINDOW_S,
    )
    bears = wrench[:, 2] > least_n
    up = np.where(bears, wrench[:, 2], 1.0)
    x = origin[0] + (height * wrench[:, 0] - wrench[:, 4]) / up
    y = origin[1] + (height * wrench[:, 1] + wrench[:, 3]) / up
    return np.stack([x, y], axis=-1), bears


def _costs(standing: Standing, outside: Array, on: Mask) -> Array:
    """Returns what each state of a plate costs at each frame, ``(frames, 4)``."""
    away = np.minimum(0.5 * (np.maximum(outside - _SOLE_MARGIN_M, 0.0) / _SOLE_SD_M) ** 2, _MOST)
    height = standing.soles.corners[..., 2].min(axis=2) - standing.floor_m
    lifted = np.minimum(0.5 * (np.maximum(height - _LOW_M, 0.0) / _LOW_SD_M) ** 2, _MOST)
    lifted = lifted + _IN_THE_AIR * ~standing.down
    cost = np.full((len(outside), len(FEET)), _NEITHER)
    cost[:, :2] = away[:, :2] + lifted
    cost[:, BOTH] = away[:, 2] + lifted.sum(axis=1) + _PAIR
    cost[:, 0] += _MISPLACED * on[:, 1]
    cost[:, 1] += _MISPLACED * on[:, 0]
    cost[:, BOTH] += _MISPLACED * np.any(~on, axis=1)
    step = float(np.median(np.diff(standing.time_s))) if len(standing.time_s) > 1 else 1.0
    return cost * min(1.0, step / _INDEPENDENT_S)


def _pieces(
    plate: int,
    frames: NDArray[np.intp],
    path: NDArray[np.intp],
    span: tuple[float, float],
    time_s: Array,
    outside: Array,
    given: bool,
) -> list[LoadedTime]:
    """Cuts one load where the foot changes; the outer ends are the force's own."""
    cuts = np.flatnonzero(np.diff(path)) + 1
    times = [span[0], *(0.5 * (time_s[frames[cuts]] + time_s[frames[cuts - 1]])), span[1]]
    out = []
    for part, start, end in zip(
        np.split(np.arange(len(path)), cuts), times[:-1], times[1:], strict=True
    ):
        foot = int(path[part[0]])
        there = outside[frames[part]]
        there = there[np.isfinite(there[:, 0])]
        away = there.min(axis=1) if foot == NONE else there[:, foot]
        distance = float(np.median(away)) if len(away) else 0.0
        out.append(LoadedTime(plate, foot, float(start), float(end), distance, given))
    return out
