"""Footsteps: where and when each foot goes, and where the weight is meant to be meanwhile."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from human.simulate.errors import SimulationError
from human.simulate.legs import Leg
from human.simulate.paths import MinimumJerkPath, minimum_jerk_path
from human.simulate.stance import Stance, sole_center

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Cadence:
    """How a person walks.

    Attributes:
        step_s: from one landing to the next [s].
        double_s: part of it with both feet on the floor [s].
        shift_s: time to bring the weight over one foot before the first step, and back after [s].
        step_m: longest way of the body in one step [m].
        step_rad: largest turn of the body in one step [rad].
        clearance_m: height of the ankle over where it stands, in mid swing [m].
        tilt_rad: how far the toes point down in mid swing [rad].
    """

    step_s: float = 0.6
    double_s: float = 0.1
    shift_s: float = 0.7
    step_m: float = 0.45
    step_rad: float = 0.5
    clearance_m: float = 0.1
    tilt_rad: float = 0.3


@dataclass(frozen=True, slots=True)
class Footfalls:
    """The feet over time.

    Attributes:
        feet: ankle paths of right and left foot, flat, world.
        contacts: intervals of standing of right and left foot, ``K x 2`` each [s].
        weight: where the center of pressure is meant to be; z is zero.
        end_s: when the last weight shift is over [s].
    """

    feet: tuple[MinimumJerkPath, MinimumJerkPath]
    contacts: tuple[Array, Array]
    weight: MinimumJerkPath
    end_s: float


@dataclass
class _Foot:
    """One foot while the steps are being laid."""

    leg: Leg
    times: list[float]
    ankles: list[Array]
    rotations: list[Array]
    bows: list[Array]
    tilts: list[float]
    contacts: list[tuple[float, float]]
    down_since: float = -np.inf

    def stand(self, until_s: float) -> None:
        self._append(until_s, self.ankles[-1], self.rotations[-1], 0.0, 0.0)

    def swing(self, lift_s: float, land_s: float, stance: Stance, cadence: Cadence) -> None:
        self.stand(lift_s)
        self.contacts.append((self.down_since, lift_s))
        ankle = stance.ankle(self.leg)
        self._append(land_s, ankle, stance.rotation, cadence.clearance_m, cadence.tilt_rad)
        self.down_since = land_s

    def _append(
        self, time_s: float, ankle: Array, rotation: Array, bow: float, tilt: float
    ) -> None:
        self.times.append(time_s)
        self.ankles.append(ankle)
        self.rotations.append(rotation)
        self.bows.append(np.array([0.0, 0.0, bow]))
        self.tilts.append(tilt)

    def path(self) -> MinimumJerkPath:
        return minimum_jerk_path(
            self.times,
            np.array(self.ankles),
            np.array(self.rotations),
            np.array(self.bows),
            np.array(self.tilts),
        )

    def sole(self) -> Array:
        return sole_center(self.leg, self.ankles[-1], self.rotations[-1])


def cadence_of(legs: tuple[Leg, Leg]) -> Cadence:
    """Returns an easy walk for these legs: steps of half their length."""
    return Cadence(step_m=0.5 * min(leg.reach for leg in legs))


def lay_footsteps(
    legs: tuple[Leg, Leg],
    walks: Sequence[tuple[float, Sequence[Stance]]],
    *,
    start: Stance,
    begin_s: float,
    cadence: Cadence | None = None,
) -> Footfalls:
    """Lays the steps of one or more walks, with standing in between.

    Args:
        legs: right and left.
        walks: for each, when the weight begins to shift [s] and the stances to walk through; the
            feet come together in the last one.
        start: where the person stands first.
        begin_s: first time [s].
        cadence: how they walk.

    Returns:
        Paths of both feet. A foot rests exactly between its swings; the swings overlap never.

    Raises:
        SimulationError: a walk begins before the last one is over.
    """
    cadence = cadence or cadence_of(legs)
    feet = [_Foot(leg, [begin_s], [start.ankle(leg)], [start.rotation], [], [], []) for leg in legs]
    middle = 0.5 * (feet[0].sole() + feet[1].sole())
    weight_times, weights = [begin_s], [middle]

    def bring(time_s: float, point: Array) -> None:
        weight_times.append(time_s)
        weights.append(point)

    now, here = begin_s, start
    for shift_s, stances in walks:
        if shift_s <= now:
            raise SimulationError(
                f"a walk begins at {shift_s:.2f} s, before {now:.2f} s, when the last one is over"
            )
        bring(shift_s, weights[-1])
        places = _places(here, stances, cadence)
        first = 1 if len(places) > 0 and _turns_left(here, stances[-1]) else 0
        lift = shift_s + cadence.shift_s
        for k, place in enumerate(places):
            swing, stand = feet[(first + k) % 2], feet[(first + k + 1) % 2]
            # The weight is over the standing foot from the moment the other one lifts.
            bring(lift, stand.sole())
            land = lift + cadence.step_s - cadence.double_s
            swing.swing(lift, land, place, cadence)
            bring(land, stand.sole())
            now, lift = land, land + cadence.double_s
        if places:
            now += cadence.shift_s
            bring(now, 0.5 * (feet[0].sole() + feet[1].sole()))
            here = stances[-1]
    end = now + 1.0
    bring(end, weights[-1])
    for foot in feet:
        foot.stand(end)
        foot.contacts.append((foot.down_since, np.inf))
    flat = np.column_stack((np.array(weights), np.zeros(len(weights))))
    return Footfalls(
        feet=(feet[0].path(), feet[1].path()),
        contacts=(np.array(feet[0].contacts), np.array(feet[1].contacts)),
        weight=minimum_jerk_path(weight_times, flat, np.eye(3)),
        end_s=now,
    )


def walk_duration_s(here: Stance, stances: Sequence[Stance], cadence: Cadence) -> float:
    """Returns how long a walk takes from the first weight shift to the last [s]."""
    count = len(_places(here, stances, cadence))
    if not count:
        return 0.0
    return 2.0 * cadence.shift_s + count * cadence.step_s - cadence.double_s


def _places(here: Stance, stances: Sequence[Stance], cadence: Cadence) -> list[Stance]:
    """Returns the stance that each step takes its foot to; the last is taken by both feet."""
    places: list[Stance] = []
    for goal in stances:
        way = np.hypot(goal.x - here.x, goal.y - here.y)
        turn = np.arctan2(np.sin(goal.heading - here.heading), np.cos(goal.heading - here.heading))
        count = int(np.ceil(max(way / cadence.step_m, abs(turn) / cadence.step_rad) - 1e-9))
        for k in range(1, count + 1):
            share = k / count
            places.append(
                Stance(
                    here.x + share * (goal.x - here.x),
                    here.y + share * (goal.y - here.y),
                    here.heading + share * float(turn),
                )
            )
        here = goal
    return [*places, places[-1]] if places else []


def _turns_left(here: Stance, goal: Stance) -> bool:
    """Whether the left foot goes first, so that the feet do not cross."""
    turn = np.sin(goal.heading - here.heading)
    aside = -np.sin(here.heading) * (goal.x - here.x) + np.cos(here.heading) * (goal.y - here.y)
    return bool(turn + aside > 1e-9)
