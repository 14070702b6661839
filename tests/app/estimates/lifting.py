"""A simulated person who takes a box in both hands on two plates, as files of a laboratory."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.demo.laboratory import BOX_KG, EMPTY_S, HELD_S, plates_of, simulate_lift, write_laboratory
from human import HumanModel, Subject, generate_model
from human.marker_recording import PlateForces
from human.simulate import SimulatedMotion, operator

__all__ = ["BOX_KG", "EMPTY_S", "HELD_S", "PERSON", "Lifting", "lifting_plates", "write_lifting"]

PERSON = Subject(1.75, 72.0, "male")


@dataclass(frozen=True)
class Lifting:
    """The person, the truth, and the files."""

    model: HumanModel
    truth: SimulatedMotion
    static: Path
    motion: Path
    grf: Path


def simulate_lifting(seconds: float = 2.5, seed: int = 3) -> tuple[HumanModel, SimulatedMotion]:
    model, rng = generate_model(PERSON), np.random.default_rng(seed)
    return model, simulate_lift(model, operator("average", rng), rng, seconds)


def lifting_plates(simulated: SimulatedMotion, seed: int = 4) -> PlateForces:
    return plates_of(simulated, np.random.default_rng(seed))


def write_lifting(folder: Path, seed: int = 3) -> Lifting:
    """Writes a static trial, the motion and its plates into a folder."""
    model, rng = generate_model(PERSON), np.random.default_rng(seed)
    made = write_laboratory(folder, model, operator("average", rng), rng)
    return Lifting(model, made.truth, made.static, made.motion, made.grf)
