"""Which joints' moments can be told, from the spread that is left of them."""

from collections.abc import Mapping

import numpy as np

from estimation.estimate_record import Estimate
from estimation.run.run_records import Balance
from estimation.run.run_sensors import FEET
from estimation.spatial import Array, BoolArray, IntArray
from estimation.tree import EstimationTree


def levers(tree: EstimationTree) -> Array:
    """Returns ``(n_links - 1,)`` m: from each joint along the body to the farthest end beyond it.

    A segment at an end is taken to be twice as long as its centre of mass is far.
    """
    beyond = np.zeros(tree.n_links)
    for link in range(tree.n_links - 1, -1, -1):
        mass = tree.inertias[link, 0, 0]
        if mass > 0.0:
            lower = tree.inertias[link, 3:, :3] / mass
            center = np.linalg.norm([lower[2, 1], lower[0, 2], lower[1, 0]])
            beyond[link] = max(beyond[link], 2.0 * float(center))
        if link > 0:
            parent = tree.parents[link]
            reach = float(np.linalg.norm(tree.offsets[link])) + beyond[link]
            beyond[parent] = max(beyond[parent], reach)
    return beyond[1:]


def joints_known(
    estimate: Estimate,
    balance: IntArray,
    propped: BoolArray,
    unseen: Mapping[str, BoolArray],
    known_within_n: float,
) -> BoolArray:
    """Returns ``(n, n_links - 1)`` whether each joint's moment is known.

    Args:
        estimate: with bands that hold noise and what is open, not errors of the model.
        balance: ``(n,)`` a `Balance` each.
        propped: ``(n,)`` whether a seat or the like bears a part of the person, on the pelvis or
            the thighs, so that the hips are not known.
        unseen: segments to the frames ``(n,)`` on which nothing measured their posture.
        known_within_n: a force at the far end of the limb; a moment less well known than its
            moment is not.
    """
    tree = estimate.tree
    out = np.ones((len(balance), tree.n_links - 1), dtype=np.bool_)
    if estimate.bands == "uncertainty" and estimate.joint_moment_covariance is not None:
        total = np.trace(estimate.joint_moment_covariance, axis1=-2, axis2=-1)
        out &= np.sqrt(total) <= known_within_n * levers(tree)
    else:
        out &= (balance != Balance.UNKNOWN)[:, None]
    for link, name in enumerate(tree.link_names[1:], 1):
        if name in unseen:
            out[unseen[name], link - 1] = False
    for foot in FEET:
        out[propped, tree.path(tree.link_names.index(foot))[-2] - 1] = False
    split = balance == Balance.SPLIT_UNKNOWN
    for foot in FEET:
        for link in tree.path(tree.link_names.index(foot))[:-1]:
            out[split, link - 1] = False
    return out
