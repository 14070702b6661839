"""Newton and Euler without uncertainty: joint wrenches, and the rate of change of momentum."""

import numpy as np

from estimation.spatial import Array, motion_transform, times, transposed
from estimation.tree import EstimationTree
from estimation.tree_kinematics import TreeKinematics


def newton_euler(
    tree: EstimationTree, kinematics: TreeKinematics, accelerations: Array, wrenches: Array
) -> tuple[Array, Array]:
    """Carries inertial less external wrenches from the leaves to the base.

    Args:
        tree: the links.
        kinematics: of the same frames.
        accelerations: ``(n_links, frames, 6)`` proper accelerations of the links.
        wrenches: ``(n_links, frames, 6)`` external wrenches on them, link axes and origins.

    Returns:
        ``(n_links, frames, 6)`` joint wrenches, parent on child, child axes (the base's is zero),
        and ``(frames, 6)`` what nothing bears: zero if motion and wrenches agree.

    Source: Latella et al. 2019, eq. 17.
    """
    out = kinematics.gyro - wrenches
    for link in range(tree.n_links):
        if np.any(tree.inertias[link]):
            out[link] += accelerations[link] @ tree.inertias[link].T
    for link in range(tree.n_links - 1, 0, -1):
        out[tree.parents[link]] += times(transposed(kinematics.X[link]), out[link])
    residual = out[0].copy()
    out[0] = 0.0
    return out, residual


def momentum_rate(tree: EstimationTree, kinematics: TreeKinematics, accelerations: Array) -> Array:
    """Returns the rate of change of momentum less weight ``(frames, 6)``, base axes and origin.

    It is what all external wrenches together must come to, with every term: accelerations,
    velocities and gravity.

    Source: Tirupachuri et al. 2021, eq. 14 and 16, about the base instead of the centre of mass.
    """
    nothing = np.zeros_like(accelerations)
    return newton_euler(tree, kinematics, accelerations, nothing)[1]


def transforms_from_base(kinematics: TreeKinematics) -> Array:
    """Returns ``(n_links, frames, 6, 6)``: base to link; transposed, they bring wrenches back."""
    back = transposed(kinematics.rotation[0])
    lever = times(back, kinematics.position - kinematics.position[0])
    return motion_transform(back @ kinematics.rotation, lever)


def center_of_mass(tree: EstimationTree, kinematics: TreeKinematics) -> Array:
    """Returns the centre of mass ``(frames, 3)`` m from the base's origin, base axes."""
    total = np.zeros_like(kinematics.position[0])
    for link in range(tree.n_links):
        mass = tree.inertias[link, 0, 0]
        if mass > 0.0:
            # The lower left block is mass times the cross-product matrix of the centre.
            lower = tree.inertias[link, 3:, :3]
            moment = np.array([lower[2, 1], lower[0, 2], lower[1, 0]])
            total += mass * kinematics.position[link] + kinematics.rotation[link] @ moment
    center = total / tree.mass_kg - kinematics.position[0]
    return times(transposed(kinematics.rotation[0]), center)
