"""Articular stress: how hard each joint works, in newton metres.

Two measures, named apart because they differ away from the neutral posture:

* ``moment_norm``: length of the moment vector that the parent exerts on the child. It does not
  depend on how the joint's axes are chosen: prefer it.
* ``effort_l2``: root of the sum of squares of the joint's three torques, as published. Successive
  revolutes have oblique axes once the joint is turned, so this depends on their order.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import PostureError

Floats = NDArray[np.float64]

#: Moments that put the joints on one scale when a cost weighs them against one another. Round
#: figures of ours, of the order of what published tables give as static strength of the joint
#: in mid-range; they are no limits and say nothing of what a person can bear.
REFERENCE_MOMENT_NM: Mapping[str, float] = MappingProxyType(
    {
        "jL5S1": 200.0,
        "jL4L3": 200.0,
        "jL1T12": 200.0,
        "jT9T8": 200.0,
        "jRightC7Shoulder": 90.0,
        "jRightShoulder": 90.0,
        "jRightElbow": 70.0,
        "jRightWrist": 15.0,
        "jLeftC7Shoulder": 90.0,
        "jLeftShoulder": 90.0,
        "jLeftElbow": 70.0,
        "jLeftWrist": 15.0,
    }
)


def moment_norm(moment: ArrayLike) -> Floats:
    """Returns the length of joint moments.

    Args:
        moment: ``(..., joints, 3)`` N m, in any one frame.

    Raises:
        PostureError: If the last axis is not 3 or a value is not finite.
    """
    vector = _finite("moment", moment)
    if vector.ndim < 1 or vector.shape[-1] != 3:
        raise PostureError("moment", f"expected (..., 3), got {vector.shape}")
    norm: Floats = np.sqrt(np.einsum("...i,...i->...", vector, vector))
    return norm


def effort_l2(torque: ArrayLike) -> Floats:
    """Returns the effort of each spherical joint from the torques of its three revolutes.

    Args:
        torque: ``(..., 3 joints)`` N m, the three revolutes of a joint side by side.

    Returns:
        ``(..., joints)`` N m.

    Raises:
        PostureError: If the torques do not come in threes or a value is not finite.

    Source: Tirupachuri et al. 2021, articular stress in the results: the 2-norm over a joint's
        three torques.
    """
    tau = _finite("torque", torque)
    if tau.ndim < 1 or tau.shape[-1] % 3:
        raise PostureError("torque", f"expected three per joint, got {tau.shape}")
    return moment_norm(tau.reshape(*tau.shape[:-1], -1, 3))


def effort_share(
    effort_nm: ArrayLike,
    joint_names: Sequence[str],
    reference_nm: Mapping[str, float] = REFERENCE_MOMENT_NM,
) -> Floats:
    """Returns efforts as shares of a reference moment, so that joints can be compared.

    Args:
        effort_nm: ``(..., joints)`` N m.
        joint_names: Names along the last axis.
        reference_nm: Reference by joint; replace it by measured strengths where there are any.

    Raises:
        PostureError: If a joint has no reference or the shapes do not fit.
    """
    effort = _finite("effort_nm", effort_nm)
    if effort.ndim < 1 or effort.shape[-1] != len(joint_names):
        raise PostureError("effort_nm", f"expected (..., {len(joint_names)}), got {effort.shape}")
    missing = [name for name in joint_names if not reference_nm.get(name, 0.0) > 0.0]
    if missing:
        raise PostureError("reference_nm", f"expected a moment above 0 for {', '.join(missing)}")
    share: Floats = effort / np.array([reference_nm[name] for name in joint_names])
    return share


def effort_quantiles(
    effort: ArrayLike, probabilities: Sequence[float] = (0.05, 0.5, 0.95)
) -> Floats:
    """Returns quantiles over samples.

    Args:
        effort: ``(samples, ...)``.
        probabilities: ``(p,)`` from 0 to 1.

    Returns:
        ``(p, ...)``.

    Raises:
        PostureError: If there are no samples or a value is not finite.
    """
    samples = _finite("effort", effort)
    if samples.ndim < 1 or not samples.shape[0]:
        raise PostureError("effort", f"expected (samples, ...), got {samples.shape}")
    quantiles: Floats = np.quantile(samples, probabilities, axis=0)
    return quantiles


def _finite(name: str, value: ArrayLike) -> Floats:
    array = np.asarray(value, dtype=np.float64)
    if not np.isfinite(array).all():
        bad = tuple(map(int, np.argwhere(~np.isfinite(array))[0]))
        raise PostureError(name, "expected a finite value", bad)
    return array
