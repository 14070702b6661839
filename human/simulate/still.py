"""Standing still: any posture held on one foot or two, with loads in the hands."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from human.kinematics import forward_kinematics
from human.model import Array, HumanModel
from human.motion import Motion, Provenance
from human.simulate.errors import SimulationError
from human.simulate.ground import solve_dynamics
from human.simulate.legs import legs_of
from human.simulate.operators import Operator
from human.simulate.records import SimulatedMotion, Truth
from human.simulate.stance import sole_center


def simulate_still(
    model: HumanModel,
    operator: Operator,
    *,
    q: ArrayLike | None = None,
    load_kg: Mapping[str, float] | None = None,
    on_right: bool = True,
    on_left: bool = True,
    duration_s: float = 1.0,
    rate_hz: float = 100.0,
) -> SimulatedMotion:
    """Simulates a person who holds a posture without moving at all.

    Args:
        model: the person's body.
        operator: who they are, for the record.
        q: the posture, ``7 + n_dof``; the T-pose at the world origin if not given. It is raised or
            lowered until the lowest standing sole is on the floor.
        load_kg: frame, such as ``RightHandCOM``, to the mass that hangs there.
        on_right: whether the right foot stands.
        on_left: whether the left foot stands.
        duration_s: how long.
        rate_hz: samples per second.

    Raises:
        SimulationError: no foot stands, or the posture has another length.
    """
    stands = np.array([on_right, on_left])
    posture = model.neutral() if q is None else np.array(q, dtype=np.float64)
    if posture.shape != (model.nq,) or not np.any(stands):
        raise SimulationError(
            f"expected a posture of {model.nq} numbers and a standing foot, got shape "
            f"{posture.shape} and {int(stands.sum())} feet"
        )
    legs = legs_of(model)
    poses = [forward_kinematics(model, posture).of(f"{leg.side}Foot") for leg in legs]
    height = [at[2] - leg.sole for (_, at), leg in zip(poses, legs, strict=True)]
    posture[2] -= np.min(np.array(height)[stands])
    count = int(np.floor(duration_s * rate_hz)) + 1
    still = np.zeros((count, model.nv))
    motion = Motion(
        model_dof_names=model.dof_names,
        time_s=np.arange(count) / rate_hz,
        q=np.tile(posture, (count, 1)),
        v=still,
        a=still,
        provenance=Provenance("simulated: standing still"),
    )
    loads: dict[str, Array] = {name: np.full(count, mass) for name, mass in (load_kg or {}).items()}
    contact = (np.full(count, on_right), np.full(count, on_left))
    right, left = (
        np.tile(sole_center(leg, at, R), (count, 1))
        for leg, (R, at) in zip(legs, poses, strict=True)
    )
    truth = Truth(
        operator=operator,
        dof=np.zeros(0, dtype=np.intp),
        noise=np.zeros((count, 0)),
        hands={},
        segment_id=np.full(count, -1, dtype=np.int64),
        load_kg=loads,
        contact_right=contact[0],
        contact_left=contact[1],
        dynamics=solve_dynamics(model, motion, loads, feet=(right, left), contact=contact),
    )
    return SimulatedMotion(motion, truth)
