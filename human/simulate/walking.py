"""Walking: steps over flat ground, arms swinging against the legs."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from human.model import HumanModel
from human.simulate.balance import Bearing, grid_of, smoothed
from human.simulate.balanced_motion import unled_motion
from human.simulate.body import AngleCourse
from human.simulate.errors import SimulationError
from human.simulate.gait import Cadence, Footfalls, lay_footsteps
from human.simulate.legs import legs_of
from human.simulate.operators import Operator, coherent_noise
from human.simulate.records import SimulatedMotion
from human.simulate.stance import Stance

Array = NDArray[np.float64]

#: How far the arms swing for each metre that one foot is ahead of the other [rad/m].
_ARM_SWING = 0.9
#: How far pelvis and trunk turn, likewise [rad/m].
_PELVIS_TURN, _TRUNK_TURN = 0.12, 0.22
#: Arms of who walks with free hands: angle from the T-pose [degrees], right side.
_ARMS_DOWN = {"Shoulder_rotx": 82.0, "Shoulder_rotz": 2.0, "Elbow_rotz": 22.0}
#: sd of the sway of joints that nothing leads, for a mobility of one [rad].
_SWAY = 0.02


def simulate_walking(
    model: HumanModel,
    operator: Operator,
    rng: np.random.Generator,
    *,
    route: Sequence[Stance] = (Stance(), Stance(x=3.0)),
    cadence: Cadence | None = None,
    load_kg: float = 0.0,
    rate_hz: float = 100.0,
) -> SimulatedMotion:
    """Simulates a person who walks along a route with flat steps, from standing to standing.

    Standing feet rest exactly; both are on the floor for ``cadence.double_s`` between the steps.
    The pelvis moves so that the center of pressure is in the standing foot, as the ground reaction
    found by inverse dynamics has it.

    Args:
        model: the person's body.
        operator: the person; their mobilities scale the sway of the trunk and arms.
        rng: source of all randomness.
        route: where they stand first, and the places they walk through.
        cadence: how they walk.
        load_kg: carried, half in each hanging hand.
        rate_hz: samples per second.

    Raises:
        SimulationError: a route of one place, steps longer than the legs, or a joint beyond its
            limit.
    """
    if len(route) < 2 or not rate_hz > 0.0:
        raise SimulationError(
            f"expected two or more places and a positive rate, got {len(route)} and {rate_hz}"
        )
    legs = legs_of(model)
    footfalls = lay_footsteps(
        legs, [(0.5, route[1:])], start=route[0], begin_s=0.0, cadence=cadence
    )
    end_s = footfalls.end_s + 0.5
    hanging = walking_angles(model, operator, rng, footfalls, end_s)
    grid = grid_of(-0.5, end_s + 0.5)
    bearing = Bearing(grid, np.zeros_like(grid), np.zeros_like(grid), pelvis_yaw(footfalls, grid))
    loads = {f"{leg.side}HandCOM": 0.5 * load_kg for leg in legs} if load_kg else {}

    def carried(t: Array) -> dict[str, Array]:
        return {name: np.full(t.size, kg) for name, kg in loads.items()}

    return unled_motion(
        model, operator, legs, footfalls, bearing, hanging, carried,
        end_s=end_s, rate_hz=rate_hz, what="walking",
    )  # fmt: skip


def mean_heading(footfalls: Footfalls, time_s: Array) -> Array:
    """Returns the mean heading of the feet, ``T`` [rad], without jumps."""
    both = [np.unwrap(np.arctan2(R[:, 1, 0], R[:, 0, 0])) for R in _rotations(footfalls, time_s)]
    return np.asarray(0.5 * (both[0] + both[1]))


def ahead(footfalls: Footfalls, time_s: Array) -> Array:
    """Returns how far the right foot is ahead of the left, ``T`` [m]."""
    yaw = mean_heading(footfalls, time_s)
    right, left = (f.sample(time_s).position for f in footfalls.feet)
    way = right - left
    return np.asarray(np.cos(yaw) * way[:, 0] + np.sin(yaw) * way[:, 1])


def pelvis_yaw(footfalls: Footfalls, grid: Array) -> Array:
    """Returns the heading of the pelvis on the grid, ``N`` [rad]: it turns with the forward leg."""
    turn = _PELVIS_TURN * ahead(footfalls, grid)
    return smoothed(mean_heading(footfalls, grid), 0.6) + smoothed(turn, 0.3)


def arms_down(model: HumanModel, operator: Operator) -> Array:
    """Returns the angles of who stands at ease with hanging arms, ``n_dof`` [rad].

    Leg angles in it are to be replaced.
    """
    names = model.dof_names
    base = np.array(operator.comfort.neutral)
    for part, degrees in _ARMS_DOWN.items():
        base[names.index(f"jRight{part}")] = np.deg2rad(degrees)
        base[names.index(f"jLeft{part}")] = -np.deg2rad(degrees)
    for side in ("Right", "Left"):
        for axis in "xyz":
            base[names.index(f"j{side}BallFoot_rot{axis}")] = 0.0
    return base


def walking_angles(
    model: HumanModel,
    operator: Operator,
    rng: np.random.Generator,
    footfalls: Footfalls,
    end_s: float,
) -> AngleCourse:
    """Returns trunk, neck and arm angles of who walks with free hands, as a function of time.

    The arm swings with the opposite leg and the trunk turns with it; on top of that every joint
    sways a little, by its mobility. Leg angles in it are to be replaced.
    """
    names = model.dof_names
    base = arms_down(model, operator)
    swing = np.zeros(len(names))
    # Turning about z takes the right arm forward and the left one back.
    for side in ("Right", "Left"):
        swing[names.index(f"j{side}Shoulder_rotz")] = -_ARM_SWING
    swing[names.index("jT9T8_rotz")] = -_TRUNK_TURN
    swing[names.index("jL1T12_rotz")] = -0.5 * _TRUNK_TURN
    feet = [f"j{side}BallFoot" for side in ("Right", "Left")]
    sd = _SWAY * np.sqrt(operator.mobility)
    sd[[i for i, name in enumerate(names) if name.rsplit("_", 1)[0] in feet]] = 0.0
    sway = coherent_noise(rng, sd, start_s=-2.0, end_s=end_s + 2.0, memory_s=0.8, knot_s=0.2)
    grid = grid_of(-2.0, end_s + 2.0)
    phase = CubicSpline(grid, smoothed(ahead(footfalls, grid), 0.3))

    def angles(time_s: Array) -> Array:
        return np.asarray(base + phase(time_s)[:, None] * swing + sway(time_s))

    return angles


def _rotations(footfalls: Footfalls, time_s: Array) -> tuple[Array, Array]:
    right, left = (f.sample(time_s).rotation for f in footfalls.feet)
    return right, left
