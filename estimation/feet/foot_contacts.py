"""Which foot is down, offline, from how the soles move and nothing else.

`ContactDetector` does it live. Offline, a switch can be looked at from both sides, so positions
alone suffice: no accelerations, no sensor on the foot.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation.errors import MeasurementError
from estimation.feet.foot_motion import SIDES, limb_motion, sole_points
from estimation.feet.likeliest_path import likeliest_path
from estimation.feet.plate_faults import runs
from estimation.spatial import Array
from human import HumanModel, LocalCubic, Motion

Mask = NDArray[np.bool_]
Meaning = Literal["rest", "load"]

#: Speeds are derived over this time, s: short, since feet stop within it.
_WINDOW_S = 0.07
#: A standing sole's speed, m/s, and height over its floor, m: standard deviations.
_SPEED_SD, _HEIGHT_SD = 0.15, 0.03
#: Cost of being in the air, and of a switch, in nats for each independent instant, s.
_IN_AIR, _SWITCH, _INDEPENDENT_S = 2.5, 5.0, 0.05
#: A sole slower than this, m/s, stands, to find how high the floor is.
_STANDING_M_S = 0.3
#: A loaded foot rolls: it leaves and reaches the floor at these shares of the swing's speed.
_LEAVES_AT, _LANDS_AT = 0.28, 0.15
#: Ways off the resting place, m, over which the onset of a movement is fitted.
_ONSET_M = (0.003, 0.05)
#: A way is clear of the noise from so many times its size on; it is followed to so many times that.
_CLEAR, _FAR = 2.5, 16.0
#: The resting place is the median over this time, s, so far from the switch, s.
_REST_S = (0.15, 0.35)
#: Points that start within this time, s, start together.
_TOGETHER_S = 0.08
#: An onset further than this from the switch it belongs to is none, s.
_ONSET_REACH_S = 0.2


@dataclass(frozen=True, slots=True)
class FootContacts:
    """Which foot is down.

    Attributes:
        feet: ``(frames, 2)`` right and left.
        floor_m: ``(2,)`` m, height at which the lowest point of each sole stands.
    """

    feet: Mask
    floor_m: Array


def contacts_of_motion(
    model: HumanModel,
    motion: Motion,
    *,
    meaning: Meaning = "rest",
    belt_velocity: ArrayLike = (0.0, 0.0, 0.0),
) -> FootContacts:
    """Tells which foot is down, from a motion of the whole body.

    Args:
        model: the person.
        motion: what they do.
        meaning: see `contacts_of_tracks`.
        belt_velocity: ``(3,)`` m/s, world axes, what resting feet move at on a treadmill.

    Raises:
        human.UnknownNameError: the model lacks a foot.
    """
    still = np.zeros_like(motion.v)
    track = np.empty((len(motion), 2, 2, 3))
    for side, name in enumerate(SIDES):
        points = sole_points(model, name)
        bodies = limb_motion(model, [segment for segment, _ in points], motion.q, still, still)
        for k, (body, (_, local)) in enumerate(zip(bodies, points, strict=True)):
            track[:, side, k] = body.at(local).position
    return contacts_of_tracks(motion.time_s, track, meaning=meaning, belt_velocity=belt_velocity)


def contacts_of_tracks(
    time_s: ArrayLike,
    position: ArrayLike,
    *,
    meaning: Meaning = "rest",
    belt_velocity: ArrayLike = (0.0, 0.0, 0.0),
) -> FootContacts:
    """Tells which foot is down, from the paths of points of the soles.

    Args:
        time_s: ``(frames,)`` s.
        position: ``(frames, 2, points, 3)`` m, world, z up: heel and toes of the right and of the
            left foot.
        meaning: ``rest`` finds when a foot does not move, for `base_velocity`; ``load`` when it
            bears, which in real gait begins before the foot has come to rest and ends after the
            toes have begun to move.
        belt_velocity: ``(3,)`` m/s, world axes, what resting feet move at on a treadmill.

    Raises:
        MeasurementError: shapes do not fit, or a number is not finite.

    Derived here, in three steps. Which stretches are swings: the likeliest sequence of down and up,
    by speed and height of the slowest point over its own floor. When they begin and end, for load:
    where the slowest point crosses a share of that swing's own speed, since feet that swing slowly
    land slowly. For rest: a smooth start leaves the place as ``(t - t0)^3`` or, if it is abrupt,
    ``(t - t0)^2``; in the cube root of the way the time is a parabola, whose value at zero is
    ``t0``. So millimetres of noise do not hide the beginning.
    """
    time = np.asarray(time_s, dtype=np.float64)
    place = np.asarray(position, dtype=np.float64)
    if place.ndim != 4 or place.shape[:2] != (len(time), 2) or place.shape[3] != 3:
        raise MeasurementError(
            f"position: expected shape ({len(time)}, 2, points, 3), got {place.shape}"
        )
    bad = ~np.isfinite(place).all(axis=(1, 2, 3))
    if np.any(bad):
        raise MeasurementError("position: expected finite numbers", int(np.argmax(bad)))
    place = place - np.asarray(belt_velocity) * (time - time[0])[:, None, None, None]
    derived = LocalCubic(time, window_s=_WINDOW_S).derivatives(place.reshape(len(time), -1))
    speed = np.linalg.norm(derived.first.reshape(place.shape), axis=-1)
    place = derived.value.reshape(place.shape)
    height = place[..., 2]
    feet, floor = np.zeros((len(time), 2), dtype=np.bool_), np.zeros(2)
    for side in (0, 1):
        slow = speed[:, side] < _STANDING_M_S
        floors = np.array(
            [
                np.median(h[s]) if np.any(s) else h.min()
                for h, s in zip(height[:, side].T, slow.T, strict=True)
            ]
        )
        floor[side] = floors.min()
        down = _down(time, speed[:, side], height[:, side] - floors)
        slowest = speed[:, side].min(axis=1)
        feet[:, side] = True
        for start, end in runs(~down):
            if meaning == "load":
                first, last = _swing_by_share(time, slowest, start, end)
            else:
                first, last = _swing_by_onset(time, place[:, side], slowest, start, end)
            feet[(time > first) & (time < last), side] = False
    return FootContacts(feet, floor)


def _down(time_s: Array, speed: Array, height: Array) -> Mask:
    """Returns the likeliest sequence of down and up of one foot ``(frames,)``."""
    cost = 0.5 * (speed / _SPEED_SD) ** 2 + 0.5 * (np.maximum(height, 0.0) / _HEIGHT_SD) ** 2
    least = np.minimum(cost.min(axis=1), 12.0)
    step = float(np.median(np.diff(time_s))) if len(time_s) > 1 else _INDEPENDENT_S
    both = np.stack([np.full(len(least), _IN_AIR), least], axis=1)
    path = likeliest_path(both * min(1.0, step / _INDEPENDENT_S), _SWITCH * (1.0 - np.eye(2)))
    return np.asarray(path == 1)


def _swing_by_share(time_s: Array, slowest: Array, start: int, end: int) -> tuple[float, float]:
    """Returns when a swing begins and ends, by shares of its own greatest speed."""
    top = start + int(np.argmax(slowest[start:end]))
    most = slowest[top]
    before = np.flatnonzero(slowest[:top] < _LEAVES_AT * most)
    after = np.flatnonzero(slowest[top:] < _LANDS_AT * most)
    first = time_s[before[-1]] if len(before) else -np.inf
    last = time_s[top + after[0]] if len(after) else np.inf
    return float(first), float(last)


def _swing_by_onset(
    time_s: Array, place: Array, slowest: Array, start: int, end: int
) -> tuple[float, float]:
    """Returns when a swing begins and ends, by where its movement starts and comes to rest."""
    first, last = time_s[start - 1] if start else -np.inf, np.inf
    if start:
        ways = [_onset(time_s, place[:, k], time_s[start]) for k in range(place.shape[1])]
        known = [t for t in ways if t is not None and abs(t - first) < _ONSET_REACH_S]
        first = _last_of(known) if known else first
    if end < len(time_s):
        last = time_s[end]
        back = -time_s[::-1]
        ways = [_onset(back, place[::-1, k], -last) for k in range(place.shape[1])]
        known = [t for t in ways if t is not None and abs(t + last) < _ONSET_REACH_S]
        last = -_last_of(known) if known else last
    return float(first), float(last)


def _last_of(onsets: list[float]) -> float:
    """Returns when the last point moved; points that moved together are averaged."""
    return float(np.mean([t for t in onsets if t > max(onsets) - _TOGETHER_S]))


def _onset(time_s: Array, place: Array, about_s: float) -> float | None:
    """Returns when a point ``(frames, 3)`` left its resting place, or None if that is not clear."""
    resting = (time_s >= about_s - _REST_S[1]) & (time_s <= about_s - _REST_S[0])
    around = np.flatnonzero(
        (time_s >= about_s - _ONSET_REACH_S) & (time_s <= about_s + _ONSET_REACH_S)
    )
    if np.count_nonzero(resting) < 3:
        return None
    here = np.median(place[resting], axis=0)
    noise = float(np.mean(np.sum((place[resting] - here) ** 2, axis=1)))
    least = max(_ONSET_M[0], _CLEAR * np.sqrt(noise))
    # Noise adds its own square to that of a way.
    way = np.sqrt(np.maximum(np.sum((place[around] - here) ** 2, axis=1) - noise, 0.0))
    near = np.flatnonzero(way < least)
    first = int(near[-1]) + 1 if len(near) else 0
    far = np.flatnonzero(way[first:] > max(_ONSET_M[1], _FAR * least))
    past = first + max(int(far[0]) if len(far) else len(way) - first, 5)
    way, time = way[first:past], time_s[around[first:past]]
    if len(way) < 3:
        return None
    root = np.cbrt(way)
    degree = 2 if len(way) >= 5 else 1
    # An error of the way moves the time by its reciprocal speed, which goes as the root squared.
    return float(np.polyfit(root, time - about_s, degree, w=root**2)[-1]) + about_s
