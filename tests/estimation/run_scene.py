"""Simulated people on plates that feel everything, as a run takes them; truth by Pinocchio."""

from dataclasses import replace

import numpy as np

from estimation import FootForce, FootForces, FootState
from human import Motion
from human.rotations import quaternion_multiply, rotation_vector_to_quaternion

FOOT_SD = np.array([1.0, 1.0, 1.0, 0.15, 0.15, 0.15])


def feet_of(simulated, rng=None):
    """What the ground does to each foot, with noise where its force enters if there is an rng."""
    out, frames = [], len(simulated.motion)
    for wrench in simulated.truth.dynamics.feet:
        down = np.maximum(wrench[:, 2], 1.0)
        stands = wrench[:, 2] > 1.0
        point = simulated.motion.q[:, :3] * [1.0, 1.0, 0.0]
        point[stands, 0] = (-wrench[:, 4] / down)[stands]
        point[stands, 1] = (wrench[:, 3] / down)[stands]
        read = wrench.copy()
        if rng is not None:
            error = FOOT_SD * rng.normal(size=(frames, 6))
            read += error
            read[:, 3:] += np.cross(point, error[:, :3])
        state = np.full(frames, int(FootState.MEASURED))
        out.append(FootForce(read, state, point, np.tile(FOOT_SD**2, (frames, 1))))
    return FootForces(
        time_s=simulated.motion.time_s,
        right=out[0],
        left=out[1],
        missing_n=np.zeros(frames),
        stances=(),
        clock_offset_s=0.0,
        assumed=(),
        findings=(),
    )


def with_state(feet, side, frames, state):
    """The same, with other states of one foot at some frames."""
    foot = getattr(feet, side)
    states = foot.state.copy()
    states[frames] = state
    return replace(feet, **{side: replace(foot, state=states)})


def turned(motion, feet, angle, shift=(0.0, 0.0, 0.0)):
    """The whole scene turned about the world's vertical axis and put elsewhere."""
    turn = rotation_vector_to_quaternion(np.array([0.0, 0.0, angle]))
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    q = motion.q.copy()
    q[:, :3] = q[:, :3] @ R.T + shift
    q[:, 3:7] = quaternion_multiply(np.broadcast_to(turn, (len(q), 4)), q[:, 3:7])
    moved = Motion(motion.model_dof_names, motion.time_s, q, motion.v, motion.a)

    def foot(old):
        wrench = np.concatenate([old.wrench[:, :3] @ R.T, old.wrench[:, 3:] @ R.T], axis=1)
        wrench[:, 3:] += np.cross(shift, wrench[:, :3])
        return replace(old, wrench=wrench, point=old.point @ R.T + shift)

    return moved, replace(feet, right=foot(feet.right), left=foot(feet.left))
