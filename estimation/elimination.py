"""The exact solution of the whole-body Gaussian problem, in one sweep up the tree and one down.

It costs a fixed number of 6x6 products a link, whatever the tree, and gives the mean of every
unknown and its covariance. Every frame is a problem of its own; numpy works on all of them at once.

Source: the problem is Latella et al. 2019, eq. 14-25. The recursion is derived here, see
``docs/theory/estimation.md``: leaves to root, each joint's wrench is written as an affine function
of its parent's acceleration with Gaussian noise, and each link's acceleration as information.
"""

from dataclasses import dataclass

import numpy as np

from estimation.errors import CovarianceError
from estimation.problem import Problem
from estimation.spatial import Array, inverse, symmetric, times, transposed

#: Information on the base's acceleration that is lost in double precision, beside the largest.
_LEAST_INFORMATION = 1e-16


@dataclass(slots=True)
class LinkGains:
    """What one link learned on the way up; nothing in it but ``e``, ``k``, ``u0`` depends on data.

    ``a_c = E a_p + e + G z_c`` (+ noise ``P``), ``f_c = K a_p + k`` (+ noise ``Pf``) and
    ``z_c = u0 - U a_p + T X z_p``; ``W`` and ``r`` give the joint's accelerations. ``K0``, ``S0``
    are the wrench's gain and covariance before the prior on joint wrenches. Without that prior
    ``U`` and ``T`` are None: zero and one.
    """

    P: Array
    E: Array
    e: Array
    G: Array
    K0: Array
    S0: Array
    K: Array
    k: Array
    Pf: Array
    JP: Array
    W: Array
    r: Array
    U: Array | None = None
    T: Array | None = None
    u0: Array | None = None
    Lam_inv: Array | None = None


@dataclass(slots=True)
class Root:
    """The base: its acceleration ``a``, multiplier ``z``, their covariances, and its residual.

    ``B`` is the covariance of ``z`` less ``R^-1``, negative; with it siblings need no extra terms.
    Where joint wrenches have no prior, ``B = -F F'`` for every link: beside a force that is all but
    free, products with ``F`` keep the digits that products with ``B`` lose.
    ``residual`` is what the equations of motion miss before they are imposed, and ``-B`` the
    inverse of its covariance.
    """

    a: Array
    z: Array
    Ca: Array
    Caz: Array
    B: Array
    F: Array
    residual: Array


@dataclass(slots=True)
class Means:
    """Posterior means, links first: acceleration, external wrench, joint wrench, multiplier."""

    a: Array
    fx: Array
    fj: Array
    z: Array
    s: Array
    tau: Array


@dataclass(slots=True)
class Spreads:
    """Posterior covariances, links first.

    Attributes:
        Ca: ``(n_links, frames, 6, 6)`` of the accelerations.
        Caz: of acceleration and multiplier.
        B: pseudo-covariances of the multipliers.
        F: their factors, ``B = -F F'``; None with a prior on joint wrenches.
        Cfx: of the external wrenches.
        Cfj: of the joint wrenches.
        s: ``(frames, n_dof)`` variances of the joint accelerations.
        tau: ``(frames, n_dof)`` variances of the torques.
    """

    Ca: Array
    Caz: Array
    B: Array
    F: Array | None
    Cfx: Array
    Cfj: Array
    s: Array
    tau: Array


def sweep_up(problem: Problem) -> tuple[list[LinkGains | None], Root]:
    """Eliminates links from the leaves to the base, and solves for the base.

    Raises:
        CovarianceError: nothing ties down some acceleration of the base.
    """
    tree, kinematics = problem.tree, problem.kinematics
    J, j = list(problem.J), [problem.j[link].copy() for link in range(tree.n_links)]
    M: list[Array] = [tree.inertias[link][None] for link in range(tree.n_links)]
    R = [problem.dynamics[link] + problem.Px[link] for link in range(tree.n_links)]
    b0 = [kinematics.gyro[link] - problem.fbar[link] for link in range(tree.n_links)]
    gains: list[LinkGains | None] = [None] * tree.n_links
    for link in range(tree.n_links - 1, 0, -1):
        gain, up = _eliminate(problem, link, J[link], j[link], M[link], R[link], b0[link])
        gains[link], parent = gain, tree.parents[link]
        X = kinematics.X[link]
        back = transposed(X)
        J[parent] = J[parent] + symmetric(back @ up.J)
        j[parent] = j[parent] + times(back, up.j)
        if gain.U is not None and gain.u0 is not None:
            J[parent] = J[parent] + symmetric(transposed(gain.K0) @ gain.U)
            j[parent] = j[parent] + times(transposed(gain.K0), gain.u0)
        M[parent] = M[parent] + back @ gain.K
        b0[parent] = b0[parent] + times(back, gain.k)
        R[parent] = R[parent] + symmetric(back @ gain.Pf @ X)
    return gains, _root(J[0], j[0], M[0], R[0], b0[0])


@dataclass(slots=True)
class _Up:
    """What a link adds to its parent's information, before its transform."""

    J: Array
    j: Array


def _eliminate(
    problem: Problem, link: int, J: Array, j: Array, M: Array, R: Array, b0: Array
) -> tuple[LinkGains, _Up]:
    """One link on the way up."""
    X, H = problem.kinematics.X[link], problem.kinematics.H[link]
    kinematic = problem.kinematic[link]
    variances = problem.Gs[link]
    b = problem.kinematics.bias[link] + times(H, problem.s_hat[:, problem.tree.dofs[link]])
    Q = kinematic + (H * variances[:, None, :]) @ transposed(H)
    # P = (J + Q^-1)^-1 and A = P Q^-1 without ever inverting Q, which may be all but singular.
    A = inverse(np.eye(6) + Q @ J)
    P = symmetric(A @ Q)
    E = A @ X
    e = times(A, b) + times(P, j)
    JA = J @ A
    up = _Up(JA @ X, times(transposed(A), j) - times(JA, b))
    G = P @ transposed(M)
    K0 = M @ E
    k0 = times(M, e) + b0
    S0 = symmetric(R + M @ G)
    # Q^-1 H Gs = SACC^-1 H (Gs^-1 + H' SACC^-1 H)^-1: nothing cancels, however loose the joint.
    weighted = inverse(kinematic) @ H
    inner = transposed(H) @ weighted + np.eye(H.shape[-1]) / variances[:, None, :]
    W = symmetric(inverse(inner)) if H.shape[-1] else inner
    gain = LinkGains(P, E, e, G, K0, S0, K0, k0, S0, J @ P, W, weighted @ W)
    if problem.Sf is not None:
        Lam_inv = symmetric(inverse(S0 + problem.Sf))
        gain.Lam_inv, gain.U, gain.T = Lam_inv, Lam_inv @ K0, Lam_inv @ problem.Sf
        gain.u0 = times(Lam_inv, problem.mu - k0)
        gain.K, gain.k = problem.Sf @ gain.U, k0 + times(S0, gain.u0)
        gain.Pf = symmetric(problem.Sf @ Lam_inv @ S0)
    return gain, up


def _root(J: Array, j: Array, M: Array, R: Array, b0: Array) -> Root:
    known = np.linalg.eigvalsh(J)
    if not np.all(known[..., 0] > _LEAST_INFORMATION * np.maximum(1.0, known[..., -1])):
        raise CovarianceError(
            "base acceleration",
            "expected accelerometers or angular accelerations that determine it, or a prior; "
            "least information",
            float(np.min(known)),
        )
    R_inv = symmetric(inverse(R))
    N = R_inv @ M
    Ca = symmetric(inverse(J + transposed(M) @ N))
    a = times(Ca, j - times(transposed(N), b0))
    before = times(inverse(J), j)
    residual = times(M, before) + b0
    z = -times(R_inv, times(M, a) + b0)
    F = _inverse_factor(R + symmetric(M @ inverse(J) @ transposed(M)))
    B = -symmetric(F @ transposed(F))
    return Root(a, z, Ca, -Ca @ transposed(N), B, F, residual)


def _inverse_factor(matrix: Array) -> Array:
    """Returns ``F`` with ``F F'`` the inverse of positive matrices ``(frames, 6, 6)``."""
    try:
        return transposed(inverse(np.asarray(np.linalg.cholesky(matrix), dtype=np.float64)))
    except np.linalg.LinAlgError as error:
        least = float(np.min(np.linalg.eigvalsh(matrix)))
        raise CovarianceError(
            "residual of the base", "expected a positive covariance; the least variance is", least
        ) from error


def sweep_down(problem: Problem, gains: list[LinkGains | None], root: Root) -> Means:
    """Goes from the base to the leaves and gives every unknown its posterior mean."""
    tree, kinematics = problem.tree, problem.kinematics
    a, fx, fj, z = np.zeros((4, tree.n_links, *root.a.shape))
    s, tau = np.empty((2, len(root.a[..., 0]), tree.n_dof))
    a[0], z[0] = root.a, root.z
    fx[0] = problem.fbar[0] - times(problem.Px[0], z[0])
    for link in range(1, tree.n_links):
        gain, parent, X = gains[link], tree.parents[link], kinematics.X[link]
        assert gain is not None
        above = times(X, z[parent])
        fj[link] = times(gain.K, a[parent]) + gain.k + times(gain.Pf, above)
        z[link] = above
        if gain.U is not None and gain.T is not None and gain.u0 is not None:
            z[link] = gain.u0 - times(gain.U, a[parent]) + times(gain.T, above)
        a[link] = times(gain.E, a[parent]) + gain.e + times(gain.G, z[link])
        fx[link] = problem.fbar[link] - times(problem.Px[link], z[link])
        dofs, H = tree.dofs[link], kinematics.H[link]
        rest = a[link] - times(X, a[parent]) - kinematics.bias[link]
        rest = rest - times(H, problem.s_hat[:, dofs])
        s[:, dofs] = problem.s_hat[:, dofs] + times(transposed(gain.r), rest)
        tau[:, dofs] = times(transposed(H), fj[link])
        for place, dof in enumerate(dofs):
            if place and np.any(problem.hinge[link]):
                passed = times(place * problem.hinge[link], z[link])
                tau[:, dof] -= np.einsum("fi,fi->f", H[..., place], passed)
    return Means(a, fx, fj, z, s, tau)


def sweep_down_spreads(problem: Problem, gains: list[LinkGains | None], root: Root) -> Spreads:
    """Goes from the base to the leaves and gives every unknown its posterior covariance.

    Raises:
        CovarianceError: cancellation left a negative variance; the message names the link.
    """
    tree, kinematics = problem.tree, problem.kinematics
    frames = len(root.a)
    shape = (tree.n_links, frames, 6, 6)
    Ca, Caz, B, Cfx = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
    Cfj = np.zeros(shape)
    F = np.empty(shape) if problem.Sf is None else None
    s, tau = np.empty((2, frames, tree.n_dof))
    Ca[0], Caz[0], B[0] = root.Ca, root.Caz, root.B
    if F is not None:
        F[0] = root.F
    Cfx[0] = _wrench_spread(problem.Px[0], B[0], None if F is None else F[0])
    for link in range(1, tree.n_links):
        gain, parent, X = gains[link], tree.parents[link], kinematics.X[link]
        assert gain is not None
        back = transposed(X)
        CX = Caz[parent] @ back
        Cw = CX
        if F is not None:
            F[link] = X @ F[parent]
            BX = -symmetric(F[link] @ transposed(F[link]))
            through = gain.Pf @ F[link]
            last = -through @ transposed(through)
        else:
            BX = symmetric(X @ B[parent] @ back)
            last = gain.Pf @ BX @ gain.Pf
        B[link] = BX
        if gain.U is not None and gain.T is not None and gain.Lam_inv is not None:
            Cw = CX @ transposed(gain.T) - Ca[parent] @ transposed(gain.U)
            mixed = gain.U @ CX @ transposed(gain.T)
            B[link] = symmetric(
                gain.T @ BX @ transposed(gain.T)
                - mixed
                - transposed(mixed)
                + gain.U @ Ca[parent] @ transposed(gain.U)
                - gain.Lam_inv
            )
        ECa = gain.E @ Ca[parent]
        ECw = gain.E @ Cw
        Caz[link] = ECw + gain.G @ B[link]
        Ca[link] = symmetric(
            gain.P
            + ECa @ transposed(gain.E)
            + ECw @ transposed(gain.G)
            + gain.G @ transposed(Caz[link])
        )
        Cfx[link] = _wrench_spread(problem.Px[link], B[link], None if F is None else F[link])
        crossed = gain.K @ CX @ gain.Pf
        Cfj[link] = symmetric(
            gain.Pf
            + gain.K @ Ca[parent] @ transposed(gain.K)
            + crossed
            + transposed(crossed)
            + last
        )
        dofs = tree.dofs[link]
        if len(dofs):
            s[:, dofs] = _joint_variance(gain, X, Ca[parent], Cw, B[link])
            tau[:, dofs] = _torque_variance(problem, link, gain, Cfj[link], Cw, B[link])
    for name, variances in (("joint acceleration", s), ("torque", tau)):
        if variances.size and float(np.min(variances)) < 0.0:
            worst = int(np.argmin(np.min(variances, axis=0)))
            _refuse(f"{name} of {problem.tree.dof_names[worst]}", float(np.min(variances)))
    for name, block in (("acceleration", Ca), ("external wrench", Cfx), ("joint wrench", Cfj)):
        _refuse_negative(problem, name, block)
    return Spreads(Ca, Caz, B, F, Cfx, Cfj, s, tau)


def _wrench_spread(Px: Array, B: Array, F: Array | None) -> Array:
    if F is None:
        return symmetric(Px + Px @ B @ Px)
    through = Px @ F
    return symmetric(Px - through @ transposed(through))


def _joint_variance(gain: LinkGains, X: Array, Ca: Array, Cw: Array, B: Array) -> Array:
    """Variances ``(frames, k)`` of a joint's accelerations: what is left, and what is passed on."""
    r1 = -transposed(X) @ (gain.JP @ gain.r)
    r2 = transposed(gain.G) @ gain.r
    spread = transposed(gain.r) @ gain.P @ gain.r + transposed(r1) @ Ca @ r1
    spread = spread + 2.0 * transposed(r1) @ Cw @ r2 + transposed(r2) @ B @ r2
    return np.asarray(np.diagonal(gain.W + spread, axis1=-2, axis2=-1))


def _torque_variance(
    problem: Problem, link: int, gain: LinkGains, Cfj: Array, Cw: Array, B: Array
) -> Array:
    """Variances ``(frames, k)`` of a joint's torques."""
    H, hinge = problem.kinematics.H[link], problem.hinge[link]
    out = np.einsum("fik,fij,fjk->fk", H, Cfj, H)
    if not np.any(hinge):
        return np.asarray(out)
    Cfz = gain.K0 @ Cw + np.eye(6) + gain.S0 @ B
    for place in range(1, H.shape[-1]):
        N = place * hinge
        F = Cfz @ N
        block = Cfj - F - transposed(F) + N + N @ B @ N
        out[:, place] = np.einsum("fi,fij,fj->f", H[..., place], block, H[..., place])
    return np.asarray(out)


def _refuse_negative(problem: Problem, name: str, blocks: Array) -> None:
    variances = np.diagonal(blocks, axis1=-2, axis2=-1)
    for link, per_link in enumerate(variances):
        least = float(np.min(per_link))
        if least < 0.0:
            _refuse(f"{name} of {problem.tree.link_names[link]}", least)


def _refuse(place: str, least: float) -> None:
    raise CovarianceError(
        place,
        "expected a positive variance; the covariances span too many decades, so give "
        "free wrenches a smaller standard deviation",
        least,
    )
