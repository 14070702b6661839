"""Articular stress: how hard each joint works, with the band that the estimate gives it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.estimate_record import Estimate
from estimation.norm_quantiles import norm_quantiles
from estimation.spatial import Array, BoolArray

#: Above this share of the effort, the moment's spread makes the norm of its mean misleading.
UNSURE_SHARE = 0.3
PROBABILITIES = (0.05, 0.5, 0.95)


@dataclass(frozen=True, slots=True)
class JointEfforts:
    """Effort of every joint that turns.

    Attributes:
        joint_names: ``m`` joints.
        effort_nm: ``(n, m)`` norm of the moment's mean, N m, locked axes included.
        quantiles_nm: ``(n, m, p)`` of the norm's distribution; None without standard deviations.
        probabilities: ``p`` of them.
        unsure: ``(n, m)`` whether the moment's spread is over 0.3 of the effort: then the quantiles
            say more than ``effort_nm``, which is no longer near their middle.
        paper_l2_nm: ``(n, m)`` the 2021 paper's effort: root of the sum of squared torques.
    """

    joint_names: tuple[str, ...]
    effort_nm: Array
    quantiles_nm: Array | None
    probabilities: tuple[float, ...]
    unsure: BoolArray
    paper_l2_nm: Array


@dataclass(frozen=True, slots=True)
class JointLoad:
    """What one joint bears.

    Attributes:
        joint: its name.
        force: ``(n, 3)`` N, parent on child, child axes.
        moment: ``(n, 3)`` N m about the joint's centre.
        force_sd: ``(n, 3)`` N, or None.
        moment_sd: ``(n, 3)`` N m, or None.
    """

    joint: str
    force: Array
    moment: Array
    force_sd: Array | None
    moment_sd: Array | None


def joint_efforts(
    estimate: Estimate, probabilities: Sequence[float] = PROBABILITIES
) -> JointEfforts:
    """Computes the effort of every joint that turns.

    The norm of the whole moment, so that a joint modelled with fewer axes does not lose what its
    locked ones bear; the paper's, which does, stands beside it.

    Args:
        estimate: of any method, on the tree of real links.
        probabilities: of the quantiles wanted.

    Source: Tirupachuri et al. 2021, section IV-C1 (``paper_l2_nm``).
    """
    tree = estimate.tree
    turning = [index for index in range(tree.n_links - 1) if len(tree.dofs[index + 1])]
    moment = estimate.joint_wrench[:, turning, 3:]
    effort = np.linalg.norm(moment, axis=-1)
    quantiles, unsure = None, np.zeros(effort.shape, dtype=np.bool_)
    if estimate.joint_moment_covariance is not None:
        covariance = estimate.joint_moment_covariance[:, turning]
        quantiles = norm_quantiles(moment, covariance, probabilities)
        total = np.trace(covariance, axis1=-2, axis2=-1)
        unsure = total > (UNSURE_SHARE * effort) ** 2
    squares = [np.sum(estimate.torque[:, tree.dofs[index + 1]] ** 2, axis=1) for index in turning]
    return JointEfforts(
        joint_names=tuple(tree.joint_names[index] for index in turning),
        effort_nm=effort,
        quantiles_nm=quantiles,
        probabilities=tuple(probabilities),
        unsure=unsure,
        paper_l2_nm=np.sqrt(np.stack(squares, axis=1)),
    )


def joint_load(estimate: Estimate, joint: str = "jL5S1") -> JointLoad:
    """Returns force and moment at one joint; of the low back if none is named.

    At L5S1 the child's z axis runs up the spine, so ``force[:, 2]`` is what the trunk above weighs
    and drives along it. Muscles that pull across the joint press it much harder; their part is not
    in a rigid body's balance.

    Raises:
        UnknownLinkError: no such joint.
    """
    index = estimate.joint(joint)
    wrench, sd = estimate.joint_wrench[:, index], estimate.joint_wrench_sd
    return JointLoad(
        joint=joint,
        force=wrench[:, :3],
        moment=wrench[:, 3:],
        force_sd=None if sd is None else sd[:, index, :3],
        moment_sd=None if sd is None else sd[:, index, 3:],
    )
