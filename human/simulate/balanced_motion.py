"""Motions whose pelvis keeps the balance: what those on their feet have in common."""

from collections.abc import Callable, Mapping

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from human.model import HumanModel
from human.motion import Motion, Provenance
from human.simulate.balance import Bearing, balanced_pelvis
from human.simulate.body import AngleCourse, BodyPaths, in_contact, refuse_beyond_limits, whole_body
from human.simulate.gait import Footfalls
from human.simulate.ground import center_of_pressure, solve_dynamics
from human.simulate.legs import Leg
from human.simulate.operators import Operator
from human.simulate.paths import PosePath
from human.simulate.records import SimulatedMotion, Truth
from human.simulate.stance import sole_center

Array = NDArray[np.float64]

#: The balance is measured on one grid point of so many; a knot of the pelvis path has five.
_SOME = 2


def unled_motion(
    model: HumanModel,
    operator: Operator,
    legs: tuple[Leg, Leg],
    footfalls: Footfalls,
    bearing: Bearing,
    hanging: AngleCourse,
    carried: Callable[[Array], Mapping[str, Array]],
    *,
    end_s: float,
    rate_hz: float,
    what: str,
) -> SimulatedMotion:
    """Moves a person whom nothing leads: feet and angles as told, the pelvis where they balance.

    Args:
        model: the person's body.
        operator: the person.
        legs: theirs.
        footfalls: where the feet are when.
        bearing: how the pelvis is meant to be held.
        hanging: angles of all joints but the legs', over time.
        carried: frame to the mass that hangs there, over time ``T`` [kg].
        end_s: last instant [s]; the first is 0.
        rate_hz: samples per second.
        what: they do, for the provenance.

    Raises:
        SimulationError: a joint beyond its limit.
    """
    grid = bearing.time_s
    provenance = Provenance(f"simulated: {what}", steps=(f"operator kind {operator.kind}",))

    def motion_of(pelvis: PosePath, t: Array) -> Motion:
        paths = BodyPaths(pelvis, footfalls.feet, footfalls.contacts)
        return whole_body(model, legs, paths, t, hanging, None, provenance)

    def pressure(pelvis: PosePath) -> Array:
        return on_grid(grid, lambda t: center_of_pressure(model, motion_of(pelvis, t), carried(t)))

    com = standing_com(model, hanging(np.zeros(1))[0], legs)
    pelvis = balanced_pelvis(legs, footfalls, bearing, com, pressure)
    time_s = np.arange(int(np.floor(end_s * rate_hz)) + 1, dtype=np.float64) / rate_hz
    motion = motion_of(pelvis, time_s)
    refuse_beyond_limits(model, motion)
    contact = in_contact(footfalls.contacts, time_s)
    truth = Truth(
        operator=operator,
        dof=np.zeros(0, dtype=np.intp),
        noise=np.zeros((time_s.size, 0)),
        hands={},
        segment_id=np.full(time_s.size, -1, dtype=np.int64),
        load_kg=carried(time_s),
        contact_right=contact[0],
        contact_left=contact[1],
        dynamics=solve_dynamics(
            model,
            motion,
            carried(time_s),
            feet=soles(legs, footfalls, time_s),
            contact=contact,
        ),
    )
    return SimulatedMotion(motion, truth)


def on_grid(grid: Array, measured: AngleCourse) -> Array:
    """Returns what a costly function of time gives on some grid points, and between them."""
    some = grid[::_SOME]
    return np.asarray(CubicSpline(some, measured(some))(grid))


def standing_com(model: HumanModel, angles: Array, legs: tuple[Leg, Leg]) -> Array:
    """Returns the center of mass from the pelvis, ``3`` [m], with straight legs."""
    q = model.neutral()
    q[7:] = angles
    for leg in legs:
        q[7 + leg.dof] = 0.0
    return np.asarray(pin.centerOfMass(model.pinocchio(), model.pinocchio().createData(), q)).copy()


def soles(legs: tuple[Leg, Leg], footfalls: Footfalls, time_s: Array) -> tuple[Array, Array]:
    """Returns the middle of the right and the left sole, ``T x 2`` [m] each."""
    right, left = (
        sole_center(leg, at.position, at.rotation)
        for leg, at in zip(legs, (f.sample(time_s) for f in footfalls.feet), strict=True)
    )
    return right, left
