"""What all the ground and the hands together must do to a person for a motion to be possible."""

import numpy as np

from estimation.spatial import Array, cross, times
from human import HumanModel, Motion, inverse_dynamics
from human.rotations import quaternion_to_matrix


def required_wrench(model: HumanModel, motion: Motion) -> Array:
    """Returns the sum of all external wrenches that a motion needs, without gravity.

    Returns:
        ``(frames, 6)`` N, N m, world axes, about the world's origin.

    Source: Latella et al. 2019, eq. 17 for the base, with every acceleration.
    """
    held = inverse_dynamics(model, motion.q, motion.v, motion.a)[:, :6]
    R = quaternion_to_matrix(motion.q[:, 3:7])
    force = times(R, np.asarray(held[:, :3]))
    moment = times(R, np.asarray(held[:, 3:])) + cross(motion.q[:, :3], force)
    return np.concatenate([force, moment], axis=-1)
