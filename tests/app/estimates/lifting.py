"""A simulated person who takes a box in both hands on two plates, as files of a laboratory."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from human import HumanModel, Subject, generate_model
from human.marker_recording import ForcePlate, PlateForces
from human.readers import write_plates, write_trc
from human.recording import ReadingReport
from human.simulate import (
    MarkerNoise,
    Posture,
    SensorNoise,
    SimulatedMotion,
    operator,
    plate_pair,
    simulate_markers,
    simulate_plates,
    simulate_postures,
    wear_markers,
)

PERSON = Subject(1.75, 72.0, "male")
BOX_KG = 5.0
RATE_HZ = 50.0
#: When the box is in the hands and nothing moves, s.
HELD_S = (3.2, 4.8)
#: When the hands are empty, s.
EMPTY_S = (0.2, 1.3)
#: How the sensors err: markers m; plates N, N m.
MARKER_SD_M, FORCE_SD_N, MOMENT_SD_NM = 2e-4, 1.0, 0.15
_ARMS = {"jRightElbow_rotz": 1.4, "jLeftElbow_rotz": -1.4}


@dataclass(frozen=True)
class Lifting:
    """The person, the truth, and the files."""

    model: HumanModel
    truth: SimulatedMotion
    static: Path
    motion: Path
    grf: Path


def simulate_lifting(seconds: float = 2.5, seed: int = 3) -> tuple[HumanModel, SimulatedMotion]:
    """Stands, takes a box, holds it for so long, puts it down."""
    model = generate_model(PERSON)
    postures = [
        Posture(hold_s=1.5),
        Posture(move_s=1.0, hold_s=seconds, angles=_ARMS, load=1.0, drop_m=0.05),
        Posture(move_s=1.0, hold_s=1.0),
    ]
    simulated = simulate_postures(
        model,
        operator("average", np.random.default_rng(seed)),
        np.random.default_rng(seed),
        postures,
        load_kg={"RightHandCOM": 0.5 * BOX_KG, "LeftHandCOM": 0.5 * BOX_KG},
        rate_hz=RATE_HZ,
    )
    return model, simulated


def plates_of(simulated: SimulatedMotion, seed: int = 4) -> PlateForces:
    """What a plate under each foot reads, in world axes."""
    pair = plate_pair()
    noise = SensorNoise(sd=np.r_[np.full(3, FORCE_SD_N), np.full(3, MOMENT_SD_NM)])
    read = simulate_plates(simulated, pair, np.random.default_rng(seed), noise=noise)
    wrench = np.stack([reading.world() for reading in read.readings], axis=1)
    places = tuple(ForcePlate(str(k + 1), one.center, 0.0) for k, one in enumerate(pair))
    origin = np.array([one.center for one in pair])
    moment = wrench[..., 3:] - np.cross(origin, wrench[..., :3])
    return PlateForces(simulated.motion.time_s, places, wrench[..., :3], moment, ReadingReport())


def write_lifting(folder: Path, seed: int = 3) -> Lifting:
    """Writes a static trial, the motion and its plates into a folder."""
    model, simulated = simulate_lifting(seed=seed)
    body = wear_markers(model, "cgm")
    motion = simulated.motion
    rng = np.random.default_rng(seed + 1)
    noise = MarkerNoise(position=SensorNoise(sd=np.full(3, MARKER_SD_M)))
    static, moving, grf = (folder / name for name in ("static.trc", "lift.trc", "lift_grf.mot"))
    still = motion.time_s < 1.0
    write_trc(static, simulate_markers(body, motion.time_s[still], motion.q[still], rng))
    write_trc(moving, simulate_markers(body, motion.time_s, motion.q, rng, noise=noise))
    write_plates(grf, plates_of(simulated, seed))
    return Lifting(model, simulated, static, moving, grf)
