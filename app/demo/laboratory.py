"""A laboratory's files: markers of a person on two plates who takes a box in both hands."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human import HumanModel
from human.marker_recording import ForcePlate, PlateForces
from human.readers import write_plates, write_trc
from human.recording import ReadingReport
from human.simulate import (
    MarkerNoise,
    Operator,
    Posture,
    SensorNoise,
    SimulatedMotion,
    plate_pair,
    simulate_markers,
    simulate_plates,
    simulate_postures,
    wear_markers,
)

BOX_KG = 5.0
RATE_HZ = 50.0
#: When the box is in the hands and nothing moves, s.
HELD_S = (3.2, 4.8)
#: When the hands are empty, s.
EMPTY_S = (0.2, 1.3)
#: How the sensors err: markers m; plates N, N m.
MARKER_SD_M, FORCE_SD_N, MOMENT_SD_NM = 2e-4, 1.0, 0.15
_ARMS = {"jRightElbow_rotz": 1.4, "jLeftElbow_rotz": -1.4}
_STANDING_S = 1.0


@dataclass(frozen=True, slots=True)
class Laboratory:
    """The truth, and the files.

    Attributes:
        truth: What the person did and bore.
        static: Markers of the person standing.
        motion: Markers of the lift.
        grf: What the plates felt meanwhile.
    """

    truth: SimulatedMotion
    static: Path
    motion: Path
    grf: Path


def simulate_lift(
    model: HumanModel, operator: Operator, rng: np.random.Generator, seconds: float = 2.5
) -> SimulatedMotion:
    """Stands, takes a box in both hands, holds it for so long, puts it down."""
    postures = [
        Posture(hold_s=1.5),
        Posture(move_s=1.0, hold_s=seconds, angles=_ARMS, load=1.0, drop_m=0.05),
        Posture(move_s=1.0, hold_s=1.0),
    ]
    each = {"RightHandCOM": 0.5 * BOX_KG, "LeftHandCOM": 0.5 * BOX_KG}
    return simulate_postures(model, operator, rng, postures, load_kg=each, rate_hz=RATE_HZ)


def plates_of(simulated: SimulatedMotion, rng: np.random.Generator) -> PlateForces:
    """Returns what a plate under each foot reads, in world axes."""
    pair = plate_pair()
    noise = SensorNoise(sd=np.r_[np.full(3, FORCE_SD_N), np.full(3, MOMENT_SD_NM)])
    read = simulate_plates(simulated, pair, rng, noise=noise)
    wrench = np.stack([reading.world() for reading in read.readings], axis=1)
    places = tuple(ForcePlate(str(k + 1), one.center, 0.0) for k, one in enumerate(pair))
    origin = np.array([one.center for one in pair])
    moment = wrench[..., 3:] - np.cross(origin, wrench[..., :3])
    return PlateForces(simulated.motion.time_s, places, wrench[..., :3], moment, ReadingReport())


def write_laboratory(
    folder: Path, model: HumanModel, operator: Operator, rng: np.random.Generator
) -> Laboratory:
    """Writes a static trial, the lift and its plates into a folder."""
    simulated = simulate_lift(model, operator, rng)
    body = wear_markers(model, "cgm")
    motion = simulated.motion
    noise = MarkerNoise(position=SensorNoise(sd=np.full(3, MARKER_SD_M)))
    static, moving, grf = (folder / name for name in ("static.trc", "lift.trc", "lift_grf.mot"))
    still = motion.time_s < _STANDING_S
    write_trc(static, simulate_markers(body, motion.time_s[still], motion.q[still], rng))
    write_trc(moving, simulate_markers(body, motion.time_s, motion.q, rng, noise=noise))
    write_plates(grf, plates_of(simulated, rng))
    return Laboratory(simulated, static, moving, grf)
