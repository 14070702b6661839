"""How the hand obeys: Sigma_x from demonstrations whose commanded hand velocity is known.

The paper has two covariances under one symbol. Sigma_x of its eq. 8 is the scatter of the hand
velocity about the commanded one, rad/s and m/s, learned from the demonstrations: it is here. That
of its section V-C is the robot's repeatability, a scatter of positions, measured on the robot
alone: that is `HandNoise`. A demonstration without its command says nothing of either, since
``J dq`` is then the only hand velocity there is.
"""

import numpy as np
from numpy.typing import NDArray

from prediction.demonstrations import Demonstrations
from prediction.errors import DemonstrationError

Array = NDArray[np.float64]

#: Fewest samples for each row of the task.
_SAMPLES_PER_ROW = 10
#: Least deviation of a row: below it the command is ``J dq`` itself, and there is no density.
_LEAST = 1e-9


def learned_sigma_x(demonstrations: Demonstrations, commanded: Array) -> Array:
    """Returns the most likely Sigma_x, ``(m, m)`` (m/s)^2 and (rad/s)^2.

    Pass it as ``sigma_x`` to `Predictor.log_prob`, `Prediction.covariance` and `train_operator`.

    Args:
        demonstrations: All joints.
        commanded: Hand velocity as commanded, ``(N, m)``, rows as in the Jacobian, base axes.

    Raises:
        DemonstrationError: The command does not fit the demonstrations, is too short, or is the
            hand velocity itself.

    Source: Vianello et al. 2021, eq. 8, "learned from the data". Derived here: the task term of the
        log density is ``log N(J dq; xdot, Sigma_x)``, whose maximum is at the second moment of
        ``J dq - xdot`` about zero.
    """
    commanded = np.asarray(commanded, dtype=np.float64)
    rows = demonstrations.jacobian.shape[1]
    if commanded.shape != (len(demonstrations), rows):
        raise DemonstrationError(
            f"commanded has shape {commanded.shape}, expected {(len(demonstrations), rows)}: one "
            "hand velocity per sample, rows as in the Jacobian"
        )
    if not np.isfinite(commanded).all():
        row = int(np.argwhere(~np.isfinite(commanded))[0, 0])
        raise DemonstrationError(f"commanded is not finite at sample {row}: cut the gap out")
    if len(commanded) < _SAMPLES_PER_ROW * rows:
        raise DemonstrationError(
            f"{len(commanded)} samples for {rows} rows of Sigma_x: at least "
            f"{_SAMPLES_PER_ROW * rows} are needed; give Sigma_x instead"
        )
    missed = demonstrations.xdot - commanded
    moment = missed.T @ missed / len(missed)
    if np.linalg.eigvalsh(moment)[0] < _LEAST**2:
        raise DemonstrationError(
            "the commanded hand velocity is that of the demonstrations in some direction, so that "
            "Sigma_x is zero there and no density exists: give Sigma_x instead"
        )
    return np.asarray(moment)


def checked_sigma_x(sigma_x: Array, rows: int) -> Array:
    """Returns a given Sigma_x if it is a covariance of that many rows.

    Raises:
        DemonstrationError: It is not.
    """
    given = np.asarray(sigma_x, dtype=np.float64)
    if given.shape != (rows, rows):
        raise DemonstrationError(f"sigma_x has shape {given.shape}, expected {(rows, rows)}")
    if not np.isfinite(given).all() or not np.allclose(given, given.T, rtol=1e-9, atol=0.0):
        raise DemonstrationError("sigma_x is not a finite symmetric matrix")
    if np.linalg.eigvalsh(given)[0] <= 0.0:
        raise DemonstrationError("sigma_x is not positive definite")
    return given
