"""Covariances between unknowns of different links, by walking up to where their paths meet."""

import numpy as np

from estimation.elimination import LinkGains, Spreads
from estimation.problem import Problem
from estimation.spatial import Array, transposed


def wrench_covariance(
    problem: Problem, gains: list[LinkGains | None], spreads: Spreads, links: list[int]
) -> Array:
    """Returns the joint covariance of the external wrenches on some links.

    Args:
        problem: the frames' problem.
        gains: what the sweep up found.
        spreads: what the sweep down found.
        links: ``m`` indices of different links.

    Returns:
        ``(frames, 6 m, 6 m)`` N^2, (N m)^2, link axes and origins, in the order of ``links``.

    Derived here: with ``z_c`` and ``a_c`` affine in the parent's ``z_p`` and ``a_p``, any
    functional ``ra a + rz z`` moves up with one gain a link; the pseudo-covariance of ``z`` makes
    siblings independent given their parent.
    """
    frames = spreads.B.shape[1]
    out = np.empty((frames, 6 * len(links), 6 * len(links)))
    for m, first in enumerate(links):
        for n, second in enumerate(links[m:], m):
            block = (
                spreads.Cfx[first] if m == n else _between(problem, gains, spreads, first, second)
            )
            out[:, 6 * m : 6 * m + 6, 6 * n : 6 * n + 6] = block
            out[:, 6 * n : 6 * n + 6, 6 * m : 6 * m + 6] = transposed(block)
    return out


def _between(
    problem: Problem,
    gains: list[LinkGains | None],
    spreads: Spreads,
    first: int,
    second: int,
) -> Array:
    """Covariance ``(frames, 6, 6)`` of the external wrenches on two different links."""
    if spreads.F is not None:
        left, right = problem.Px[first] @ spreads.F[first], problem.Px[second] @ spreads.F[second]
        return np.asarray(-left @ transposed(right))
    above = set(problem.tree.path(first))
    meeting = next(link for link in problem.tree.path(second) if link in above)
    a1, z1 = _moved(problem, gains, first, meeting)
    a2, z2 = _moved(problem, gains, second, meeting)
    Ca, Caz, B = spreads.Ca[meeting], spreads.Caz[meeting], spreads.B[meeting]
    return np.asarray(
        a1 @ Ca @ transposed(a2)
        + a1 @ Caz @ transposed(z2)
        + z1 @ transposed(Caz) @ transposed(a2)
        + z1 @ B @ transposed(z2)
    )


def _moved(
    problem: Problem, gains: list[LinkGains | None], link: int, ancestor: int
) -> tuple[Array, Array]:
    """Writes a link's external wrench in an ancestor's acceleration and multiplier."""
    frames = problem.fbar.shape[1]
    ra = np.zeros((frames, 6, 6))
    rz = np.broadcast_to(-problem.Px[link], (frames, 6, 6))
    while link != ancestor:
        gain, X = gains[link], problem.kinematics.X[link]
        assert gain is not None
        w = ra @ gain.G + rz
        ra = ra @ gain.E
        rz = w @ X
        if gain.U is not None and gain.T is not None:
            ra = ra - w @ gain.U
            rz = w @ gain.T @ X
        link = problem.tree.parents[link]
    return ra, rz
