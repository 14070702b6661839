"""Force plates under a simulated person, each in its own axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from human.marker_recording import ForcePlate, PlateForces
from human.recording import ReadingReport
from human.simulate.errors import SimulationError
from human.simulate.records import SimulatedMotion
from human.simulate.sensor_noise import (
    ALWAYS_THERE,
    PERFECT,
    Dropouts,
    SensorNoise,
    disturbed,
    frames_received,
    held,
)
from human.simulate.stance import Stance

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: Axes of a plate that measures downwards: x forward, y right, z down.
Z_DOWN = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True, slots=True)
class Plate:
    """A force plate in the floor.

    Attributes:
        name: what it is called.
        center: middle of its surface, ``3`` [m], world.
        rotation: its axes in the world, ``3 x 3``; z is up or down.
        size: of its surface along its x and y, ``2`` [m].
        sensor_origin: point that its moments are about, from the middle of the surface, in its
            axes, ``3`` [m]; most lie some centimeters below the surface.
    """

    name: str
    center: Array
    rotation: Array
    size: tuple[float, float]
    sensor_origin: Array

    def corners(self) -> Array:
        """Returns the corners of its surface in order around, ``4 x 3`` [m], world."""
        x, y = 0.5 * np.array(self.size)
        local = np.array([[x, y, 0.0], [-x, y, 0.0], [-x, -y, 0.0], [x, -y, 0.0]])
        return np.asarray(self.center + local @ self.rotation.T)

    def bears(self, point: Array) -> Mask:
        """Returns whether points of the floor ``T x 2`` [m], world, are on it."""
        floor = np.column_stack((point, np.full(len(point), self.center[2])))
        local = (floor - self.center) @ self.rotation
        return np.asarray(np.all(np.abs(local[:, :2]) <= 0.5 * np.array(self.size), axis=1))


@dataclass(frozen=True, slots=True)
class PlateReading:
    """What one plate recorded.

    Attributes:
        plate: which.
        wrench: what it does to the person, ``T x 6`` [N, N m], plate axes, about its sensor origin.
        received: frames that arrived, ``T``; in the others the last one is repeated.
        offset: the constant error in the wrench, ``6``.
    """

    plate: Plate
    wrench: Array
    received: Mask
    offset: Array

    def world(self) -> Array:
        """Returns the wrench in world axes about the world origin, ``T x 6`` [N, N m]."""
        plate = self.plate
        origin = plate.center + plate.rotation @ plate.sensor_origin
        force = self.wrench[:, :3] @ plate.rotation.T
        moment = self.wrench[:, 3:] @ plate.rotation.T + np.cross(origin, force)
        return np.concatenate((force, moment), axis=-1)

    def center_of_pressure(self, least_n: float = 10.0) -> tuple[Array, Mask]:
        """Returns where the force passes through the surface, and where that can be said.

        Returns:
            ``T x 2`` [m] from the middle of the surface in plate axes, zero where it is not
            defined; and ``T`` booleans, whether the plate bears ``least_n`` or more.
        """
        force, moment = self._at_surface()
        loaded = np.abs(force[:, 2]) >= least_n
        vertical = np.where(loaded, force[:, 2], 1.0)
        point = np.stack((-moment[:, 1], moment[:, 0]), axis=-1) / vertical[:, None]
        return np.where(loaded[:, None], point, 0.0), loaded

    def free_moment(self, least_n: float = 10.0) -> Array:
        """Returns the moment about the plate's z at the center of pressure, ``T`` [N m]."""
        force, moment = self._at_surface()
        point, loaded = self.center_of_pressure(least_n)
        turned = moment[:, 2] - point[:, 0] * force[:, 1] + point[:, 1] * force[:, 0]
        return np.where(loaded, turned, 0.0)

    def _at_surface(self) -> tuple[Array, Array]:
        force = self.wrench[:, :3]
        return force, self.wrench[:, 3:] + np.cross(self.plate.sensor_origin, force)


@dataclass(frozen=True, slots=True)
class PlateRecording:
    """What all plates recorded.

    Attributes:
        readings: one for each plate.
        beside: whether a foot pushed on no plate, ``T``: the plates then lack something.
    """

    readings: tuple[PlateReading, ...]
    beside: Mask

    def as_read(self, time_s: Array) -> PlateForces:
        """Returns what a reader makes of it: world axes, about each plate's middle.

        Args:
            time_s: the plates' own times, ``T`` [s].
        """
        plates = tuple(
            ForcePlate(
                reading.plate.name,
                reading.plate.center,
                float(reading.plate.center[2]),
                reading.plate.corners(),
            )
            for reading in self.readings
        )
        wrench = np.stack([reading.world() for reading in self.readings], axis=1)
        force = wrench[..., :3]
        moment = wrench[..., 3:] - np.cross([plate.origin for plate in plates], force)
        return PlateForces(np.array(time_s), plates, force, moment, ReadingReport())


def plate_pair(
    stance: Stance | None = None, *, size: tuple[float, float] = (0.6, 0.4), gap_m: float = 0.01
) -> tuple[Plate, Plate]:
    """Returns a plate under each foot of who stands at a stance: right, z up; left, z down.

    Long ones make an instrumented treadmill.

    Args:
        stance: between the plates' middles; the world origin if not given.
        size: along and across the heading [m].
        gap_m: between them.
    """
    stance = stance or Stance()
    aside = np.array([0.0, 0.5 * (size[1] + gap_m), 0.0])
    below = np.array([0.0, 0.0, -0.04])
    right = Plate("right", stance.origin - stance.rotation @ aside, stance.rotation, size, below)
    turned = stance.rotation @ Z_DOWN
    left = Plate("left", stance.origin + stance.rotation @ aside, turned, size, -below)
    return right, left


def simulate_plates(
    simulated: SimulatedMotion,
    plates: Sequence[Plate],
    rng: np.random.Generator,
    *,
    noise: SensorNoise = PERFECT,
    dropouts: Dropouts = ALWAYS_THERE,
) -> PlateRecording:
    """Records what plates feel of a simulated motion.

    A foot is borne by the plate that its center of pressure is on, whole: nobody stands half on
    two.

    Args:
        simulated: the motion and its truth.
        plates: where they are.
        rng: source of all randomness.
        noise: of the six channels, plate axes [N, N m].
        dropouts: of each plate on its own.

    Raises:
        SimulationError: the motion does not say what each foot bears.
    """
    feet = simulated.truth.dynamics.feet
    if feet is None:
        raise SimulationError("the motion was simulated without feet, so no plate can feel them")
    time_s = simulated.motion.time_s
    borne = np.zeros((len(plates), len(time_s), 6))
    beside = np.zeros(len(time_s), dtype=np.bool_)
    for foot in feet:
        pushes = foot[:, 2] > 0.0
        vertical = np.where(pushes, foot[:, 2], 1.0)
        free = pushes.copy()
        for k, plate in enumerate(plates):
            height = plate.center[2]
            x = height * foot[:, 0] - foot[:, 4]
            y = height * foot[:, 1] + foot[:, 3]
            here = free & plate.bears(np.stack((x, y), axis=-1) / vertical[:, None])
            borne[k] += np.where(here[:, None], foot, 0.0)
            free &= ~here
        beside |= free
    readings = []
    for plate, world in zip(plates, borne, strict=True):
        origin = plate.center + plate.rotation @ plate.sensor_origin
        moment = world[:, 3:] - np.cross(origin, world[:, :3])
        true = np.concatenate((world[:, :3] @ plate.rotation, moment @ plate.rotation), axis=-1)
        read, offset = disturbed(true, noise, rng)
        received = frames_received(time_s, dropouts, rng)
        readings.append(PlateReading(plate, held(read, received), received, offset))
    return PlateRecording(tuple(readings), beside)
