"""Demonstrations out of a recorded motion: the joints of a chain, as seen from its base."""

import numpy as np

from human import Chain, Motion
from prediction.demonstrations import Demonstrations, demonstrations_from_samples
from prediction.errors import DemonstrationError
from prediction.training.standing import STANDS_S, STILL_M_S, STILL_RAD_S, standing_frames


def demonstrations_from_motion(
    chain: Chain, motion: Motion, *, trajectory_id: int = 0, rate_hz: float = 60.0
) -> Demonstrations:
    """Takes the chain's joints out of a motion of the same model.

    The pelvis may move: the chain is seen from it, so hand velocities are relative to it. A chain
    that starts from a foot learns from the frames on which both feet stand, see `standing_frames`.
    Frames flagged ``weak_derivative`` are left out: their velocities are not measured (a lone frame
    between gaps has zeros), and a person at rest is not what was seen.

    Args:
        chain: The chain.
        motion: A motion whose joints are those of the chain's model.
        trajectory_id: Number of the take.
        rate_hz: Frames are thinned evenly to at most this rate.

    Returns:
        The demonstrations.

    Raises:
        DemonstrationError: The motion lacks joints of the chain, is too short, or the feet that
            the chain holds never stand.
    """
    known = {name: index for index, name in enumerate(motion.model_dof_names)}
    missing = [name for name in chain.dof_names if name not in known]
    if missing:
        raise DemonstrationError(f"the motion lacks the joints {', '.join(missing)}")
    columns = [known[name] for name in chain.dof_names]
    if len(motion.time_s) < 2:
        raise DemonstrationError("the motion has fewer than two frames")
    typical = float(np.median(np.diff(motion.time_s)))
    stride = max(1, int(np.floor(1.0 / (rate_hz * typical) + 1e-6)))
    frames = np.arange(0, len(motion.time_s), stride)
    frames = frames[standing_frames(chain, motion)[frames]]
    if len(frames) == 0:
        raise DemonstrationError(
            f"the feet never both stand for {STANDS_S:g} s (slower than {STILL_M_S:g} m/s and "
            f"{STILL_RAD_S:g} rad/s): record somebody who does not step, or train with the pelvis "
            "as base"
        )
    weak = motion.flags.get("weak_derivative")
    if weak is not None:
        frames = frames[~weak[frames]]
        if len(frames) == 0:
            raise DemonstrationError(
                "no stretch of the motion is long enough between its gaps to tell velocities"
            )
    return demonstrations_from_samples(
        chain,
        motion.joint_angles[frames][:, columns],
        motion.joint_rates[frames][:, columns],
        motion.time_s[frames],
        np.full(len(frames), trajectory_id, dtype=np.int64),
    )
