"""When what a chain holds in place did stay in place: frames on which both feet stand."""

import numpy as np
from numpy.typing import NDArray

from human import Chain, Motion
from human.names import BASE_SEGMENT
from prediction.errors import DemonstrationError

#: Faster than this, a foot does not stand, m/s (of its ankle) and rad/s. Feet of real recordings
#: wobble at some cm/s; a heel that lifts or a foot that is set down is far above.
STILL_M_S = 0.1
STILL_RAD_S = 0.5
#: A foot stands for at least so long, s; shorter stretches are steps at their slowest.
STANDS_S = 0.3


def standing_frames(chain: Chain, motion: Motion) -> NDArray[np.bool_]:
    """Returns on which frames the chain's base and its held tips stood still in the world.

    All frames, if the chain starts from the pelvis and holds nothing.

    Args:
        chain: The chain.
        motion: A motion of its model.

    Returns:
        ``(T,)``.

    Raises:
        DemonstrationError: The motion does not say where the pelvis is in the world.

    Derived here: a point fixed to a segment moves with ``v + w x p + J dq`` as the pelvis sees it,
    ``(v, w)`` being the pelvis' twist in its own axes; its speed is the same in any axes.
    """
    standing = [tip for tip in (chain.base, *chain.held) if tip != BASE_SEGMENT]
    still = np.ones(len(motion.time_s), dtype=np.bool_)
    if not standing:
        return still
    if motion.base != "measured":
        raise DemonstrationError(
            "the recording does not say where the pelvis is in the world, so it cannot be told "
            "when the feet stand: train with the pelvis as base"
        )
    linear, angular = motion.v[:, :3], motion.v[:, 3:6]
    for tip in standing:
        leg = Chain(chain.model, tip)
        position, _, jacobian = leg.forward_and_jacobian(motion.joint_angles[:, leg.dof_indices])
        moved = np.einsum("tmn,tn->tm", jacobian, motion.joint_rates[:, leg.dof_indices])
        velocity = linear + np.cross(angular, position) + moved[:, :3]
        turning = angular + moved[:, 3:]
        still &= np.linalg.norm(velocity, axis=1) < STILL_M_S
        still &= np.linalg.norm(turning, axis=1) < STILL_RAD_S
    edges = np.flatnonzero(np.diff(still, prepend=False, append=False))
    for begin, end in edges.reshape(-1, 2):
        if motion.time_s[end - 1] - motion.time_s[begin] < STANDS_S:
            still[begin:end] = False
    return still
