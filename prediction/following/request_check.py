"""Whether a roll-out is asked for in the right units."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from prediction.errors import TrajectoryError
from prediction.following.joint_limits import JointLimits

Array = NDArray[np.float64]

#: Further beyond its range no joint begins, rad. Up to there what was measured is believed.
BEYOND_LIMIT_RAD = 1.0


def check_request(names: Sequence[str], limits: JointLimits, q0: Array, samples: int) -> None:
    """Refuses a start no body can take, and counts that are none.

    Args:
        names: Joint names, ``n``.
        limits: Their ranges, widened to what was demonstrated.
        q0: Start posture, ``(n,)`` or ``(C, n)`` rad.
        samples: Sampled postures.

    Raises:
        TrajectoryError: A joint is far beyond its range, or samples are fewer than none.
    """
    check_samples(samples)
    rows = q0.reshape(-1, len(names))
    beyond = np.abs(rows - np.clip(rows, limits.lower, limits.upper))
    row, joint = divmod(int(np.argmax(beyond)), len(names))
    if beyond[row, joint] > BEYOND_LIMIT_RAD:
        raise TrajectoryError(
            f"the start posture has {names[joint]} at {rows[row, joint]:.3g} rad, expected "
            f"{limits.lower[joint]:.2f} to {limits.upper[joint]:.2f}: angles are in rad"
        )


def check_samples(samples: int) -> None:
    """Refuses counts that are none.

    Raises:
        TrajectoryError: They are fewer than none.
    """
    if samples < 0:
        raise TrajectoryError(f"samples is {samples}, expected 0 (the central path alone) or more")
