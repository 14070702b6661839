"""Simulated people over simulated plates, as a reader would hand them over."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from human import HumanModel, Motion
from human.marker_recording import ForcePlate, PlateForces
from human.recording import ReadingReport
from human.simulate import (
    Plate,
    SensorNoise,
    SimulatedMotion,
    Stance,
    operator,
    simulate_plates,
    simulate_walking,
)

#: Plates are sampled so often, Hz, and every so many samples is a frame of the motion.
RATE_HZ, EVERY = 500.0, 5


@dataclass(frozen=True)
class PlateScene:
    """A motion, what plates recorded of it, and the truth at the motion's frames."""

    model: HumanModel
    fast: SimulatedMotion
    motion: Motion
    truth: np.ndarray  # (2, frames, 6)
    contact: np.ndarray  # (frames, 2)

    def plates(
        self, plates: Sequence[Plate], rng: np.random.Generator, noise: SensorNoise | None = None
    ) -> PlateForces:
        recorded = simulate_plates(self.fast, plates, rng, noise=noise or SensorNoise())
        return recorded.as_read(self.fast.motion.time_s)


def plate_forces(time_s, plates: Sequence[Plate], wrench_world: np.ndarray) -> PlateForces:
    """Plates of wrenches ``(samples, plates, 6)`` about the world's origin."""
    origins = np.array([plate.center for plate in plates])
    force = wrench_world[..., :3]
    moment = wrench_world[..., 3:] - np.cross(origins, force)
    records = tuple(
        ForcePlate(plate.name, plate.center, float(plate.center[2]), plate.corners())
        for plate in plates
    )
    return PlateForces(np.array(time_s), records, force, moment, ReadingReport())


def floor_plate(name: str, x: float, y: float, size=(0.6, 0.4)) -> Plate:
    below = np.array([0.0, 0.0, -0.04])
    return Plate(name, np.array([x, y, 0.0]), np.eye(3), size, below)


def walking_scene(model: HumanModel, seed: int = 0, metres: float = 2.0) -> PlateScene:
    rng = np.random.default_rng(seed)
    fast = simulate_walking(
        model,
        operator("average", rng, model),
        rng,
        route=(Stance(), Stance(x=metres)),
        rate_hz=RATE_HZ,
    )
    truth = fast.truth
    return PlateScene(
        model,
        fast,
        fast.motion.select(slice(None, None, EVERY)),
        truth.dynamics.feet[:, ::EVERY],
        np.stack([truth.contact_right, truth.contact_left], axis=-1)[::EVERY],
    )
