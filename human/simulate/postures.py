"""Going through postures on the spot: arms raised, balance on one foot, a load taken and held."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from human.model import HumanModel
from human.simulate.balance import Bearing, grid_of
from human.simulate.balanced_motion import unled_motion
from human.simulate.errors import SimulationError
from human.simulate.gait import Footfalls
from human.simulate.legs import Leg, legs_of
from human.simulate.operators import Operator
from human.simulate.paths import MinimumJerkPath, minimum_jerk, minimum_jerk_path
from human.simulate.records import SimulatedMotion
from human.simulate.stance import Stance, sole_center
from human.simulate.walking import arms_down, walking_angles

Array = NDArray[np.float64]

#: Share of a change of support in which the weight moves; in the rest the foot does.
_WEIGHT_SHARE = 0.6
#: How high a foot is lifted [m].
_LIFT_M = 0.12
#: Time to get anywhere within which the pelvis can follow [s].
_LEAST_S = 0.3


@dataclass(frozen=True, slots=True)
class Posture:
    """A posture to go to, and to hold.

    Attributes:
        move_s: time to get there from the one before [s]; of the first it does not matter.
        hold_s: time to hold it [s].
        feet: what stands: ``both``, ``right`` or ``left``.
        angles: degree of freedom to angle [rad]; all others are those of who stands at ease with
            hanging arms. Legs follow from pelvis and feet.
        load: share of the loads that is in the hands.
        drop_m: how far below standing height the pelvis is.
        pitch_rad: how far it leans forward.
    """

    move_s: float = 1.0
    hold_s: float = 1.0
    feet: str = "both"
    angles: Mapping[str, float] = field(default_factory=dict)
    load: float = 0.0
    drop_m: float = 0.0
    pitch_rad: float = 0.0


def simulate_postures(
    model: HumanModel,
    operator: Operator,
    rng: np.random.Generator,
    postures: Sequence[Posture],
    *,
    load_kg: Mapping[str, float] | None = None,
    rate_hz: float = 100.0,
) -> SimulatedMotion:
    """Simulates a person who goes through postures without leaving the spot, swaying a little.

    Between postures everything moves with minimum jerk; a foot is lifted after the weight has left
    it, and takes weight after it has landed. The pelvis keeps the center of pressure under what
    stands.

    Args:
        model: the person's body.
        operator: the person; their mobilities scale the sway.
        rng: source of all randomness.
        postures: two or more; the first on both feet.
        load_kg: frame, such as ``RightHandCOM``, to the mass that hangs there at ``load`` 1.
        rate_hz: samples per second.

    Returns:
        One recording. ``truth.segment_id`` is the number of the posture while it is held, -1 on the
        way.

    Raises:
        SimulationError: a change from one foot to the other without both in between, an unknown
            degree of freedom, or a joint beyond its limit.
    """
    _refuse_what_nobody_can_do(model, postures, rate_hz)
    legs = legs_of(model)
    begin, reached, left = _times(postures)
    footfalls = _footfalls(legs, postures, begin, reached, float(left[-1]))
    end_s = float(left[-1])
    rest = arms_down(model, operator)
    goals = np.tile(rest, (len(postures), 1))
    for goal, posture in zip(goals, postures, strict=True):
        for name, angle in posture.angles.items():
            goal[model.dof_names.index(name)] = angle
    led = _course(begin, reached, goals - rest, end_s)
    crouch = _course(
        begin, reached, np.array([[p.drop_m, p.pitch_rad, p.load] for p in postures]), end_s
    )
    sway = walking_angles(model, operator, rng, footfalls, end_s)

    def hanging(t: Array) -> Array:
        return np.asarray(sway(t) + led(t))

    grid = grid_of(-0.5, end_s + 0.5)
    bent = crouch(grid)
    bearing = Bearing(grid, bent[:, 0], bent[:, 1], np.zeros_like(grid))
    masses = dict(load_kg or {})

    def carried(t: Array) -> dict[str, Array]:
        share = crouch(t)[:, 2]
        return {name: kg * share for name, kg in masses.items()}

    simulated = unled_motion(
        model, operator, legs, footfalls, bearing, hanging, carried,
        end_s=end_s, rate_hz=rate_hz, what="postures",
    )  # fmt: skip
    time_s = simulated.motion.time_s
    held = np.full(time_s.size, -1, dtype=np.int64)
    for number, (start, stop) in enumerate(zip(reached, left, strict=True)):
        held[(time_s >= start) & (time_s <= stop)] = number
    return replace(simulated, truth=replace(simulated.truth, segment_id=held))


def _refuse_what_nobody_can_do(
    model: HumanModel, postures: Sequence[Posture], rate_hz: float
) -> None:
    if len(postures) < 2 or not rate_hz > 0.0:
        raise SimulationError(
            f"expected two or more postures and a positive rate, got {len(postures)} and {rate_hz}"
        )
    before = "both"
    for number, posture in enumerate(postures):
        if posture.feet not in ("both", "right", "left"):
            raise SimulationError(
                f"posture {number}: feet must be 'both', 'right' or 'left', got {posture.feet!r}"
            )
        if "both" not in (before, posture.feet) and before != posture.feet:
            raise SimulationError(
                f"posture {number}: from the {before} foot to the {posture.feet} one; stand on "
                "both in between"
            )
        if number == 0 and posture.feet != "both":
            raise SimulationError("posture 0: expected feet 'both', to stand at the start")
        if not posture.hold_s >= 0.0 or (number > 0 and not posture.move_s >= _LEAST_S):
            raise SimulationError(
                f"posture {number}: expected to move for {_LEAST_S} s or more and to hold for zero "
                f"or more, got {posture.move_s} and {posture.hold_s}"
            )
        unknown = sorted(set(posture.angles) - set(model.dof_names))
        if unknown:
            raise SimulationError(f"posture {number}: no such degree of freedom: {unknown}")
        before = posture.feet


def _times(postures: Sequence[Posture]) -> tuple[Array, Array, Array]:
    """Returns when each posture is begun, reached and left [s]; the first is there at zero."""
    move = np.array([0.0, *(posture.move_s for posture in postures[1:])])
    hold = np.array([posture.hold_s for posture in postures])
    left = np.cumsum(move + hold)
    return left - hold - move, left - hold, left


def _course(begin: Array, reached: Array, values: Array, end_s: float) -> "_Course":
    """Makes a path through values ``K x n`` that rests in each."""
    waypoints, times = [values[0]], [-1.0]
    for k in range(1, len(values)):
        for at, value in ((begin[k], values[k - 1]), (reached[k], values[k])):
            if at > times[-1]:
                times.append(at)
                waypoints.append(value)
    times.append(end_s + 1.0)
    waypoints.append(values[-1])
    return _Course(np.array(times), np.array(waypoints))


@dataclass(frozen=True, slots=True)
class _Course:
    """Many numbers that go from waypoint to waypoint with minimum jerk."""

    time_s: Array
    values: Array

    def __call__(self, time_s: Array) -> Array:
        """Returns the numbers at times ``T``, ``T x n``."""
        last = self.time_s.size - 2
        i = np.clip(np.searchsorted(self.time_s, time_s, side="right") - 1, 0, last)
        share, _ = minimum_jerk((time_s - self.time_s[i]) / np.diff(self.time_s)[i])
        way = self.values[i + 1] - self.values[i]
        return np.asarray(self.values[i] + share[:, None] * way)


def _footfalls(
    legs: tuple[Leg, Leg], postures: Sequence[Posture], begin: Array, reached: Array, end_s: float
) -> Footfalls:
    """Returns feet, contacts and weight for the supports asked for."""
    stance = Stance()
    ankles = [stance.ankle(leg) for leg in legs]
    centers = [
        sole_center(leg, ankle, stance.rotation) for leg, ankle in zip(legs, ankles, strict=True)
    ]
    right, left = (np.append(center, 0.0) for center in centers)
    over = {"both": 0.5 * (right + left), "right": right, "left": left}
    flat, up = np.zeros(3), np.array([0.0, 0.0, _LIFT_M])
    places = [[(-1.0, flat)], [(-1.0, flat)]]
    down = [-np.inf, -np.inf]
    contacts: list[list[tuple[float, float]]] = [[], []]
    weight = [(-1.0, over["both"])]
    before = "both"
    for k, posture in enumerate(postures):
        if posture.feet == before:
            continue
        swing = 1 if "right" in (posture.feet, before) else 0
        start, stop = float(begin[k]), float(reached[k])
        lifts = posture.feet != "both"
        share = _WEIGHT_SHARE if lifts else 1.0 - _WEIGHT_SHARE
        turn = start + share * (stop - start)
        if lifts:
            places[swing] += [(turn, flat), (stop, up)]
            contacts[swing].append((down[swing], turn))
            weight += [(start, over[before]), (turn, over[posture.feet])]
        else:
            places[swing] += [(start, up), (turn, flat)]
            down[swing] = turn
            weight += [(turn, over[before]), (stop, over["both"])]
        before = posture.feet
    for foot in (0, 1):
        if places[foot][-1][1] is flat:
            contacts[foot].append((down[foot], np.inf))
        places[foot].append((end_s + 1.0, places[foot][-1][1]))
    weight.append((end_s + 1.0, over[before]))

    def path(points: list[tuple[float, Array]], start: Array, R: Array) -> MinimumJerkPath:
        kept = _increasing(points)
        return minimum_jerk_path([t for t, _ in kept], start + [p for _, p in kept], R)

    return Footfalls(
        feet=(
            path(places[0], ankles[0], stance.rotation),
            path(places[1], ankles[1], stance.rotation),
        ),
        contacts=(np.array(contacts[0]), np.array(contacts[1])),
        weight=path(weight, flat, np.eye(3)),
        end_s=end_s,
    )


def _increasing(points: list[tuple[float, Array]]) -> list[tuple[float, Array]]:
    """Leaves out a point at the time of the one before, which says the same."""
    return [p for k, p in enumerate(points) if k == 0 or p[0] > points[k - 1][0]]
