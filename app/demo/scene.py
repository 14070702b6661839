"""The demonstration's person, the motions they were trained on, and the robot's candidates."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.training import Recorded, Trained, train
from human import HumanModel, Motion, Subject, generate_model
from human.simulate import (
    Operator,
    RobotScene,
    operator,
    robot_trajectories,
    simulate_following,
    simulate_reaching,
)
from prediction import TakeSource, TrainingOptions

Progress = Callable[[str, float], None]

#: Changes whenever the demonstration does, so that an older one is replaced.
REVISION = 3
_SUBJECT = Subject(1.72, 68.0, "female")
_SEED = 7
#: Ways the robot led her before, from which the model learns; and those it may choose from now.
_LED_BEFORE = 20
#: Enough for a demonstration that is made while someone waits; training on more is the default.
_SAMPLES = 350
_CANDIDATES = 6
_PAYLOAD_KG, _SHARE = 6.0, 0.5


@dataclass(frozen=True, slots=True)
class Person:
    """Who the demonstration is about, and how they move."""

    model: HumanModel
    operator: Operator


def person() -> Person:
    """Returns the demonstration's operator."""
    model = generate_model(_SUBJECT)
    return Person(model, operator("average", np.random.default_rng(_SEED)))


def demonstrations(who: Person) -> list[Motion]:
    """Returns what the model is trained on: led along other ways, and reaching about."""
    rng = np.random.default_rng(_SEED + 1)
    led = robot_trajectories(who.model, who.operator, rng, count=_LED_BEFORE)
    motions = [
        simulate_following(
            who.model, who.operator, way.path(), rng, q_start=led.q_start, rate_hz=30.0
        ).motion
        for way in led.trajectories
    ]
    motions.append(
        simulate_reaching(who.model, who.operator, rng, movements=8, rate_hz=30.0).motion
    )
    return motions


def trained(who: Person, progress: Progress | None = None) -> Trained:
    """Returns the operator model."""
    motions = tuple(demonstrations(who))
    sources = tuple(TakeSource(f"simulated {number}") for number in range(1, len(motions) + 1))

    def tell(what: str, done: float, _: float | None) -> None:
        if progress is not None:
            progress(what, done)

    return train(
        Recorded(who.model, motions, sources, ("simulated, not recorded",)),
        "right",
        seed=_SEED,
        options=TrainingOptions(
            method="mi-nsgp",
            optimizer="gradient",
            weights="diagonal",
            blocks=2,
            max_samples=_SAMPLES,
        ),
        progress=tell,
    )


def candidates(who: Person) -> RobotScene:
    """Returns what the robot might do now."""
    rng = np.random.default_rng(_SEED + 2)
    return robot_trajectories(who.model, who.operator, rng, count=_CANDIDATES)


def request(who: Person, scene: RobotScene) -> dict[str, Any]:
    """Returns the assessment request of the scene, but for the model's id."""
    q = scene.q_start
    names = who.model.dof_names
    return {
        "name": "Demo: six ways to hand over a 6 kg part",
        "hand": scene.hand,
        "start": {
            "T_world_pelvis": {
                "position_m": np.round(q[:3], 6).tolist(),
                "orientation_xyzw": np.round(q[3:7], 9).tolist(),
            },
            "joint_position": dict(zip(names, np.round(q[7:], 6).tolist(), strict=True)),
        },
        "grasp": "from_start",
        "payload_kg": _PAYLOAD_KG,
        "payload_share": _SHARE,
        "sigma_x": 0.002,
        "samples": 64,
        "seed": 1,
        "candidates": [
            {
                "id": one.id,
                "frame_id": "world",
                "time_s": np.round(one.time_s, 6).tolist(),
                "position_m": np.round(one.position_m, 6).tolist(),
                "orientation_xyzw": np.round(one.orientation_xyzw, 9).tolist(),
            }
            for one in scene.trajectories
        ],
    }
