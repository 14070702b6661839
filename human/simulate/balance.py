"""Carries the pelvis so that a person keeps their balance over the feet they stand on.

Source: Kajita et al. 2003, "Biped walking pattern generation by using preview control of
zero-moment point": the cart on a table, and a second pass on what it leaves out. Solved here as
one linear system over the whole time, since a simulation knows its future.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded
from scipy.ndimage import convolve1d, minimum_filter1d
from scipy.signal.windows import hann
from scipy.spatial.transform import Rotation

from human.simulate.errors import SimulationError
from human.simulate.gait import Footfalls
from human.simulate.legs import Leg
from human.simulate.paths import SplinePath, spline_path
from human.simulate.stance import standing_height

Array = NDArray[np.float64]

#: Grid of the balance computations [s]; the pelvis spline has a knot every ``_KNOT`` points.
GRID_S = 0.01
_KNOT = 5
#: Points at both ends of the grid within which the person stands.
_STILL = 30
#: The pelvis goes down before, and up after, a leg is out of reach, within this [s].
_EASE_S = 0.45
#: Part of the reach of a leg that the plan uses, so that the spline between knots cannot exceed it.
_SAFE = 0.993

#: Where the center of pressure really is, ``N x 2`` [m], for a pelvis path on the grid's times.
Pressure = Callable[[SplinePath], Array]


@dataclass(frozen=True, slots=True)
class Bearing:
    """How the pelvis is meant to be held, on the grid.

    Attributes:
        time_s: the grid, ``N`` [s].
        drop_m: how far below standing height it is wanted, ``N`` [m].
        pitch_rad: forward inclination, ``N`` [rad].
        yaw_rad: heading, ``N`` [rad].
    """

    time_s: Array
    drop_m: Array
    pitch_rad: Array
    yaw_rad: Array


def smoothed(values: Array, window_s: float) -> Array:
    """Returns a moving weighted mean of grid values ``N x ...``, of finite support, ends held."""
    weights = hann(2 * round(0.5 * window_s / GRID_S) + 3)
    return np.asarray(convolve1d(values, weights / weights.sum(), axis=0, mode="nearest"))


def grid_of(start_s: float, end_s: float) -> Array:
    """Returns the grid between two times, a whole number of pelvis knots [s]."""
    count = _KNOT * int(np.ceil((end_s - start_s) / (_KNOT * GRID_S)))
    return start_s + GRID_S * np.arange(count + 1, dtype=np.float64)


def cart_on_table(pressure: Array, height_m: float) -> Array:
    """Returns the course of a mass at a height whose center of pressure is given.

    Args:
        pressure: wanted center of pressure on the grid, ``N x 2`` [m]; at rest at both ends.
        height_m: of the mass over the floor [m].

    Returns:
        The mass's course, ``N x 2`` [m].

    Source: Kajita et al. 2003, eq. 1: ``p = c - (z / g) d2c/dt2``; here with second differences and
    both ends held, a symmetric tridiagonal system.
    """
    k = height_m / 9.81 / GRID_S**2
    N = len(pressure)
    bands = np.empty((2, N - 2))
    bands[0], bands[1] = -k, 1.0 + 2.0 * k
    right = pressure[1:-1].copy()
    right[0] += k * pressure[0]
    right[-1] += k * pressure[-1]
    return np.concatenate((pressure[:1], solveh_banded(bands, right), pressure[-1:]))


def balanced_pelvis(
    legs: tuple[Leg, Leg],
    footfalls: Footfalls,
    bearing: Bearing,
    com: Array,
    pressure: Pressure,
    *,
    passes: int = 3,
) -> SplinePath:
    """Returns the pelvis path that keeps the center of pressure where the footfalls want it.

    Args:
        legs: right and left.
        footfalls: the feet.
        bearing: height and turns of the pelvis.
        com: center of mass of who stands upright, from the pelvis, ``3`` [m].
        pressure: measures the center of pressure that a pelvis path leads to.
        passes: corrections by what was measured. Each takes away some nine tenths of the error.

    Raises:
        SimulationError: the feet are too far apart to stand over both.
    """
    t = bearing.time_s
    wanted = footfalls.weight.sample(t).position[:, :2]
    height = standing_height(legs) + float(com[2])
    cos, sin = np.cos(bearing.yaw_rad), np.sin(bearing.yaw_rad)
    ahead = np.stack((cos * com[0] - sin * com[1], sin * com[0] + cos * com[1]), axis=-1)
    place = cart_on_table(wanted, height) - ahead
    path = _path(legs, footfalls, bearing, place)
    for _ in range(passes):
        missed = smoothed(wanted - pressure(path), 0.1)
        # At both ends the person stands: what is missed there is a constant, and nothing else.
        missed[:_STILL], missed[-_STILL:] = missed[_STILL], missed[-_STILL - 1]
        # The feet and the led hands stay behind when the pelvis moves: some tenth of the mass.
        place = place + 1.1 * cart_on_table(missed, height)
        path = _path(legs, footfalls, bearing, place)
    return path


def _path(
    legs: tuple[Leg, Leg], footfalls: Footfalls, bearing: Bearing, place: Array
) -> SplinePath:
    rotation = Rotation.from_euler("ZY", np.column_stack((bearing.yaw_rad, bearing.pitch_rad)))
    R = rotation.as_matrix()
    highest = np.full(len(place), np.inf)
    for leg, foot in zip(legs, footfalls.feet, strict=True):
        ankle = foot.sample(bearing.time_s).position
        hip = R @ leg.hip
        apart = np.linalg.norm(place + hip[:, :2] - ankle[:, :2], axis=-1)
        if np.any(apart >= _SAFE * leg.reach):
            i = int(np.argmax(apart))
            raise SimulationError(
                f"{leg.side} foot: {apart[i]:.2f} m beside its hip at {bearing.time_s[i]:.2f} s, "
                f"the leg is {leg.reach:.2f} m long; take shorter steps"
            )
        up = np.sqrt((_SAFE * leg.reach) ** 2 - apart**2)
        highest = np.minimum(highest, ankle[:, 2] + up - hip[:, 2])
    wanted = np.minimum(standing_height(legs) - bearing.drop_m, highest)
    # The least over a window, then a mean over the same window, is never above the least.
    window = 2 * round(0.5 * _EASE_S / GRID_S) + 3
    z = smoothed(minimum_filter1d(wanted, window, mode="nearest"), _EASE_S)
    knots = slice(None, None, _KNOT)
    position = np.column_stack((place, z))
    return spline_path(bearing.time_s[knots], position[knots], rotation.as_quat()[knots])
