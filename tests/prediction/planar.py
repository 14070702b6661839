"""The planar arm of the simulator as a chain, and demonstrations of a known operator."""

from dataclasses import dataclass, field

import numpy as np

from human.simulate import simulate_planar
from human.simulate.planar import PlanarArm, PlanarDemonstrations
from prediction import Demonstrations, demonstrations_from_samples

JOINTS = ("one", "two", "three", "four", "five")


@dataclass(frozen=True)
class PlanarChain:
    arm: PlanarArm = field(default_factory=PlanarArm)
    dof_names: tuple[str, ...] = JOINTS
    lower: np.ndarray = field(default_factory=lambda: np.full(5, -4.0))
    upper: np.ndarray = field(default_factory=lambda: np.full(5, 4.0))

    def forward_and_jacobian(self, q):
        position = self.arm.forward(q)
        rotation = np.broadcast_to(np.eye(3), (*position.shape[:-1], 3, 3))
        return position, rotation, self.arm.jacobian(q)


def planar_demonstrations(
    seed: int, samples: int = 400
) -> tuple[PlanarDemonstrations, Demonstrations]:
    raw = simulate_planar(np.random.default_rng(seed), samples=samples)
    return raw, demonstrations_from_samples(
        PlanarChain(), raw.q, raw.qdot, raw.time_s, raw.trajectory_id
    )
