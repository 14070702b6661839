"""What the ground does to each foot, and where that is not known."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from estimation.spatial import Array, skew, transposed

IntArray = NDArray[np.intp]
Frames = NDArray[np.bool_] | NDArray[np.intp] | slice


#: Columns of everything that has one for each side.
SIDES = ("right", "left")


class FootState(IntEnum):
    """What is known of a foot's wrench at a frame."""

    #: It touches nothing; the wrench is zero, but for what the smoothing carries over.
    OFF_GROUND = 0
    #: Plates bear all of it.
    MEASURED = 1
    #: It stands beside the plates, or half on one: the wrench is not known.
    UNMEASURED = 2
    #: A plate reached its limit: the true wrench is larger.
    SATURATED = 3
    #: Both feet share one plate: only the sum of the two is known, how it splits is a guess.
    SHARED = 4


#: States whose wrench may be used, together with the other foot's.
USABLE = (FootState.OFF_GROUND, FootState.MEASURED, FootState.SHARED)


@dataclass(frozen=True, slots=True)
class FootForce:
    """The wrench under one foot at the motion's frames.

    Attributes:
        wrench: ``(frames, 6)`` N, N m, force first: what acts on the person, world axes, about the
            world's origin. Zero where the state is ``UNMEASURED``.
        state: ``(frames,)`` a `FootState` each.
        point: ``(frames, 3)`` m, world: where the noise of force and moment are independent.
        variance: ``(frames, 6)`` N^2, (N m)^2, world axes, about that point; wide open where the
            wrench is not known.
    """

    wrench: Array
    state: IntArray
    point: Array
    variance: Array

    @property
    def covariance(self) -> Array:
        """``(frames, 6, 6)`` of the wrench about the world's origin; built anew at each call.

        Derived here: about the origin the moment is that about the point plus ``p x F``, so the
        covariance is ``T diag(variance) T'`` with ``T = [1, 0; S(p), 1]``.
        """
        carry = np.zeros((len(self.point), 6, 6))
        carry[:, range(6), range(6)] = 1.0
        carry[:, 3:, :3] = skew(self.point)
        return (carry * self.variance[:, None, :]) @ transposed(carry)

    @property
    def usable(self) -> NDArray[np.bool_]:
        """``(frames,)`` where the wrench may be used, for a shared plate with the other foot's."""
        return np.isin(self.state, USABLE)

    def select(self, frames: Frames) -> "FootForce":
        """Returns some of the frames, by mask, index or slice."""
        return FootForce(
            self.wrench[frames], self.state[frames], self.point[frames], self.variance[frames]
        )


@dataclass(frozen=True, slots=True)
class PlateStance:
    """One time that a plate was stood on, and by whom.

    Attributes:
        plate: its name.
        foot: ``right``, ``left``, ``both``, or ``none`` where the force enters under neither foot.
        start_s: first instant, on the motion's clock.
        end_s: last instant.
        distance_m: how far outside of the sole the force enters, median; zero is under it.
        given: whether the caller said whose foot it is.
    """

    plate: str
    foot: str
    start_s: float
    end_s: float
    distance_m: float
    given: bool = False


@dataclass(frozen=True, slots=True)
class PlateZero:
    """What a plate read when nobody stood on it.

    Attributes:
        time_s: when, on the motion's clock.
        reading: ``(6,)`` N, N m, world axes, about the plate's origin.
    """

    time_s: float
    reading: Array


@dataclass(frozen=True, slots=True)
class FootForces:
    """The wrenches under both feet at the motion's frames.

    Attributes:
        time_s: ``(frames,)`` s, the motion's.
        right: under the right foot.
        left: under the left foot.
        stances: which plate was given to which foot, and when.
        clock_offset_s: seconds added to the plates' times.
        assumed: what was assumed or mended, in words.
        findings: what does not fit, in words with times.
        missing_n: ``(frames,)`` N, upward force that the motion needs and no plate bears: what a
            chair, a handrail or the floor beside the plates does; a load in the hands makes it
            negative. None where nobody worked it out.
        zeros: plate name to the last zero seen, for a stretch that follows.
    """

    time_s: Array
    right: FootForce
    left: FootForce
    stances: tuple[PlateStance, ...]
    clock_offset_s: float
    assumed: tuple[str, ...]
    findings: tuple[str, ...]
    missing_n: Array | None = None
    zeros: Mapping[str, PlateZero] = field(default_factory=dict)

    @property
    def known(self) -> NDArray[np.bool_]:
        """``(frames,)`` where all that the ground does to the person is known."""
        return self.right.usable & self.left.usable

    def select(self, frames: Frames) -> "FootForces":
        """Returns some of the frames, by mask, index or slice; what was found stays whole."""
        return FootForces(
            self.time_s[frames],
            self.right.select(frames),
            self.left.select(frames),
            self.stances,
            self.clock_offset_s,
            self.assumed,
            self.findings,
            None if self.missing_n is None else self.missing_n[frames],
            self.zeros,
        )
