"""Poses as smooth functions of time: what a hand, a box, a pelvis or a foot is led along.

A path can be asked for any time, and answers with the pose and its exact derivative, so that a
simulated person can be led along it without the error of differentiating samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline, make_interp_spline
from scipy.spatial.transform import Rotation

from human.simulate.errors import SimulationError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PoseSamples:
    """Poses and their derivatives at some times.

    Attributes:
        position: ``T x 3`` [m], in the axes of the path (world, or the pelvis if said so).
        rotation: ``T x 3 x 3``, maps body axes to the axes of the path.
        linear: velocity of the point, ``T x 3`` [m/s], axes of the path.
        angular: angular velocity, ``T x 3`` [rad/s], axes of the path.
    """

    position: Array
    rotation: Array
    linear: Array
    angular: Array

    @staticmethod
    def joined(pieces: "Sequence[PoseSamples]") -> "PoseSamples":
        """Returns pieces one after another as one."""
        return PoseSamples(
            np.concatenate([p.position for p in pieces]),
            np.concatenate([p.rotation for p in pieces]),
            np.concatenate([p.linear for p in pieces]),
            np.concatenate([p.angular for p in pieces]),
        )

    @property
    def twist(self) -> Array:
        """Linear then angular velocity, ``T x 6``, of the point and in the axes of the path."""
        return np.concatenate((self.linear, self.angular), axis=-1)

    def seen_from(self, frame: "PoseSamples") -> "PoseSamples":
        """Returns the same motion in the axes of a moving frame, as one who rides on it sees it.

        Derived here: with ``p = R_f' (x - x_f)`` and ``R_f' dR_f/dt = [R_f' w_f]``, the derivative
        is ``R_f' (v - v_f - w_f x (x - x_f))``; angular velocities subtract.
        """
        R = np.swapaxes(frame.rotation, -1, -2)
        arm = self.position - frame.position
        drift = self.linear - frame.linear - np.cross(frame.angular, arm)

        def turn(vector: Array) -> Array:
            return np.asarray(np.einsum("...ij,...j->...i", R, vector))

        return PoseSamples(
            turn(arm), R @ self.rotation, turn(drift), turn(self.angular - frame.angular)
        )

    def carried_by(self, frame: "PoseSamples") -> "PoseSamples":
        """Returns the motion of one who moves like this on a moving frame; undoes ``seen_from``."""

        def turn(vector: Array) -> Array:
            return np.asarray(np.einsum("...ij,...j->...i", frame.rotation, vector))

        arm = turn(self.position)
        return PoseSamples(
            frame.position + arm,
            frame.rotation @ self.rotation,
            frame.linear + np.cross(frame.angular, arm) + turn(self.linear),
            frame.angular + turn(self.angular),
        )


class PosePath(Protocol):
    """Anything that gives a pose for every time within its span; it rests outside of it."""

    @property
    def start_s(self) -> float:
        """First time [s]."""
        ...

    @property
    def end_s(self) -> float:
        """Last time [s]."""
        ...

    def sample(self, time_s: ArrayLike) -> PoseSamples:
        """Returns pose and velocity at times ``T`` [s]."""
        ...


def minimum_jerk(phase: ArrayLike) -> tuple[Array, Array]:
    """Returns the minimum-jerk share of the way and its derivative by the phase.

    Args:
        phase: share of the duration, ``...``; clipped to 0..1.

    Returns:
        ``10 s^3 - 15 s^4 + 6 s^5`` and ``30 s^2 (1 - s)^2``, each ``...``.

    Source: Flash and Hogan 1985, J. Neuroscience 5(7), eq. 7 (rest to rest).
    """
    s = np.clip(np.asarray(phase, dtype=np.float64), 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s), 30.0 * s * s * (1.0 - s) ** 2


@dataclass(frozen=True, slots=True)
class MinimumJerkPath:
    """Goes from pose to pose, at rest in each, straight or in a bow, with minimum jerk.

    Use it for movements one makes by intention; use ``SplinePath`` to follow given samples.

    Attributes:
        time_s: when each pose is met, ``K`` [s], increasing.
        position: ``K x 3`` [m].
        rotation: ``K x 3 x 3``; the turn from one to the next is about one axis.
        bow: by how much the middle of each way leaves the straight line, ``K-1 x 3`` [m].
        tilt: by how much the body is turned about its own y axis in the middle, ``K-1`` [rad].
    """

    time_s: Array
    position: Array
    rotation: Array
    bow: Array
    tilt: Array

    @property
    def start_s(self) -> float:
        """First time [s]."""
        return float(self.time_s[0])

    @property
    def end_s(self) -> float:
        """Last time [s]."""
        return float(self.time_s[-1])

    def sample(self, time_s: ArrayLike) -> PoseSamples:
        """Returns pose and velocity at times ``T`` [s]; exact derivatives."""
        t = np.atleast_1d(np.asarray(time_s, dtype=np.float64))
        i = np.clip(np.searchsorted(self.time_s, t, side="right") - 1, 0, self.time_s.size - 2)
        length = np.diff(self.time_s)[i]
        share, slope = minimum_jerk((t - self.time_s[i]) / length)
        rate = (slope / length)[:, None]
        share = share[:, None]
        way = self.position[i + 1] - self.position[i]
        # 64 s^3 (1-s)^3 is a bump of height one whose slope vanishes at both ends.
        bump = 64.0 * (share * (1.0 - share)) ** 3
        bump_slope = 192.0 * (share * (1.0 - share)) ** 2 * (1.0 - 2.0 * share)
        turn = Rotation.from_matrix(
            np.swapaxes(self.rotation[:-1], -1, -2) @ self.rotation[1:]
        ).as_rotvec()[i]
        level = self.rotation[i] @ Rotation.from_rotvec(share * turn).as_matrix()
        tilt = self.tilt[i][:, None] * np.array([0.0, 1.0, 0.0])
        return PoseSamples(
            position=self.position[i] + share * way + bump * self.bow[i],
            rotation=level @ Rotation.from_rotvec(bump * tilt).as_matrix(),
            linear=rate * (way + bump_slope * self.bow[i]),
            angular=rate * np.einsum("tij,tj->ti", level, turn + bump_slope * tilt),
        )


def minimum_jerk_path(
    time_s: ArrayLike,
    position: ArrayLike,
    rotation: ArrayLike,
    bow: ArrayLike | None = None,
    tilt: ArrayLike | None = None,
) -> MinimumJerkPath:
    """Makes a ``MinimumJerkPath`` after checking what it is made from.

    Args:
        time_s: when each pose is met, ``K`` [s].
        position: ``K x 3`` [m].
        rotation: ``K x 3 x 3``, or one ``3 x 3`` for all.
        bow: ``K-1 x 3`` [m]; straight if not given.
        tilt: ``K-1`` [rad]; none if not given.

    Raises:
        SimulationError: fewer than two poses, times that do not increase, or shapes that disagree.
    """
    t = np.asarray(time_s, dtype=np.float64)
    p = np.asarray(position, dtype=np.float64)
    if t.ndim != 1 or t.size < 2 or not np.all(np.diff(t) > 0.0):
        raise SimulationError(f"a path needs two or more increasing times, got {t}")
    if p.shape != (t.size, 3) or not np.all(np.isfinite(p)):
        raise SimulationError(
            f"a path of {t.size} times needs finite positions {t.size} x 3, got shape {p.shape}"
        )
    R = np.broadcast_to(np.asarray(rotation, dtype=np.float64), (t.size, 3, 3))
    b = np.zeros((t.size - 1, 3)) if bow is None else np.asarray(bow, dtype=np.float64)
    if b.shape != (t.size - 1, 3):
        raise SimulationError(f"bow: expected shape {(t.size - 1, 3)}, got {b.shape}")
    y = np.zeros(t.size - 1) if tilt is None else np.asarray(tilt, dtype=np.float64)
    if y.shape != (t.size - 1,):
        raise SimulationError(f"tilt: expected shape {(t.size - 1,)}, got {y.shape}")
    return MinimumJerkPath(t, p, R, b, y)


@dataclass(frozen=True, slots=True)
class RidingPath:
    """A path given in the axes of another one, which moves.

    Attributes:
        frame: what it rides on, world axes.
        local: its own motion, in the axes of ``frame``.
    """

    frame: PosePath
    local: PosePath

    @property
    def start_s(self) -> float:
        """First time [s]."""
        return self.local.start_s

    @property
    def end_s(self) -> float:
        """Last time [s]."""
        return self.local.end_s

    def sample(self, time_s: ArrayLike) -> PoseSamples:
        """Returns pose and velocity at times ``T`` [s], in the axes that ``frame`` is given in."""
        return self.local.sample(time_s).carried_by(self.frame.sample(time_s))


@dataclass(frozen=True, slots=True)
class SplinePath:
    """Follows given poses with position and orientation of continuous fourth derivative.

    It starts and ends at rest, without acceleration. Made by ``spline_path``.

    Derived here: the orientation is the direction of a quintic spline Q(t) through the
    quaternions, so its rate is the vector part of ``2 dQ/dt Q* / |Q|^2``.
    """

    time_s: Array
    _position: BSpline
    _quaternion: BSpline

    @property
    def start_s(self) -> float:
        """First time [s]."""
        return float(self.time_s[0])

    @property
    def end_s(self) -> float:
        """Last time [s]."""
        return float(self.time_s[-1])

    def sample(self, time_s: ArrayLike) -> PoseSamples:
        """Returns pose and velocity at times ``T`` [s]."""
        t = np.clip(np.atleast_1d(time_s), self.start_s, self.end_s)
        Q, dQ = np.asarray(self._quaternion(t)), np.asarray(self._quaternion(t, nu=1))
        vector = dQ[:, 3:] * -Q[:, :3] + Q[:, 3:] * dQ[:, :3] - np.cross(dQ[:, :3], Q[:, :3])
        return PoseSamples(
            position=np.asarray(self._position(t)),
            rotation=Rotation.from_quat(Q).as_matrix(),
            linear=np.asarray(self._position(t, nu=1)),
            angular=2.0 * vector / np.sum(Q * Q, axis=-1, keepdims=True),
        )


def spline_path(time_s: ArrayLike, position: ArrayLike, orientation_xyzw: ArrayLike) -> SplinePath:
    """Makes a ``SplinePath`` through samples of a pose.

    Args:
        time_s: ``K`` [s], increasing, two or more.
        position: ``K x 3`` [m].
        orientation_xyzw: unit quaternions, ``K x 4``, or one for all.

    Raises:
        SimulationError: fewer than two samples, times that do not increase, or a turn of 90 degrees
            or more between neighbours, where the way between them is not clear.
    """
    t = np.asarray(time_s, dtype=np.float64)
    if t.ndim != 1 or t.size < 2 or not np.all(np.diff(t) > 0.0):
        raise SimulationError(f"a path needs two or more increasing times, got {t}")
    Q = np.array(np.broadcast_to(np.asarray(orientation_xyzw, dtype=np.float64), (t.size, 4)))
    dot = np.sum(Q[1:] * Q[:-1], axis=-1)
    Q[1:] *= np.cumprod(np.where(dot < 0.0, -1.0, 1.0))[:, None]
    if np.any(np.abs(dot) <= np.cos(np.pi / 4.0)):
        worst = int(np.argmin(np.abs(dot)))
        raise SimulationError(
            f"samples {worst} and {worst + 1} are turned against each other by "
            f"{np.rad2deg(2.0 * np.arccos(abs(dot[worst]))):.0f} degrees; "
            "give samples under 90 apart"
        )
    return SplinePath(
        t,
        _through(t, np.asarray(position, dtype=np.float64)),
        _through(t, Q),
    )


def _through(time_s: Array, values: Array) -> BSpline:
    rest = [(1, np.zeros(values.shape[1])), (2, np.zeros(values.shape[1]))]
    return make_interp_spline(time_s, values, k=5, bc_type=(rest, rest))
