"""Non-collocated wrench estimation: external wrenches from the balance of the whole body alone."""

import numpy as np

from estimation.momentum import center_of_mass, transforms_from_base
from estimation.spatial import Array, inverse, motion_transform, symmetric, times, transposed
from estimation.tree import EstimationTree
from estimation.tree_kinematics import TreeKinematics


def external_wrenches(
    tree: EstimationTree,
    kinematics: TreeKinematics,
    Px: list[Array],
    fbar: Array,
    rate: Array,
    rate_variance: float,
    *,
    diagonal_at: str = "com",
    spreads: bool = True,
) -> tuple[Array, Array | None]:
    """Shares out what the measured wrenches lack to make up the rate of change of momentum.

    The problem has six unknowns a link and is solved by one 6x6 system a frame.

    Args:
        tree: the links.
        kinematics: of the same frames.
        Px: for each link, ``(frames or 1, 6, 6)`` covariance of its external wrench.
        fbar: ``(n_links, frames, 6)`` its mean.
        rate: ``(frames, 6)`` rate of change of momentum less weight, base axes and origin.
        rate_variance: of each of its components, N^2 and (N m)^2.
        diagonal_at: ``com`` where that covariance is diagonal about the centre of mass, as in the
            paper; ``base`` where it is about the base, as in its software.
        spreads: whether to compute covariances.

    Returns:
        ``(n_links, frames, 6)`` external wrenches, link axes and origins, and their covariances
        ``(n_links, frames, 6, 6)``, or None.

    Source: Tirupachuri et al. 2021, eq. 17-19; the closed form is derived here (the matrix
    inversion lemma on the normal matrix).
    """
    frames, count = len(rate), tree.n_links
    X = np.moveaxis(transforms_from_base(kinematics), 0, 1)
    shape = np.broadcast_shapes(*(block.shape for block in Px))
    weights = np.stack([np.broadcast_to(block, shape) for block in Px], axis=1)
    noise = rate_variance * np.eye(6)[None]
    if diagonal_at == "com":
        # Carries wrenches at the centre of mass to the base's origin.
        carry = transposed(motion_transform(np.eye(3)[None], center_of_mass(tree, kinematics)))
        noise = symmetric(carry @ noise @ transposed(carry))
    # All links stacked: one tall matrix a frame.
    gain = weights @ X
    back = transposed(X.reshape(frames, 6 * count, 6))
    S_inv = symmetric(inverse(symmetric(noise + back @ gain.reshape(frames, 6 * count, 6))))
    measured = np.moveaxis(fbar, 0, 1)
    missing = rate - times(back, measured.reshape(frames, 6 * count))
    share = times(S_inv, missing)
    out = np.moveaxis(measured + times(gain, share[:, None]), 1, 0)
    if not spreads:
        return out, None
    left = weights - gain @ S_inv[:, None] @ transposed(gain)
    return out, symmetric(np.moveaxis(left, 1, 0))
