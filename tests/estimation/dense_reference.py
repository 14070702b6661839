"""The same Gaussian problem written down whole: one stack of whitened rows, one dense solution.

Shares nothing with the elimination: rows as in the papers' D and Y matrices, solved by QR; the
covariance is the inverse of the normal matrix.
"""

from dataclasses import dataclass

import numpy as np


def S(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0.0]])


@dataclass
class Dense:
    """Mean and covariance of d, and where each unknown stands in it."""

    mean: np.ndarray
    covariance: np.ndarray
    where: dict


def layout(tree):
    where, at = {}, 0
    for link in range(tree.n_links):
        for kind in ("a", "fx"):
            where[kind, link] = slice(at, at + 6)
            at += 6
    for link in range(1, tree.n_links):
        where["fj", link] = slice(at, at + 6)
        at += 6
    for dof in range(tree.n_dof):
        where["s", dof] = slice(at, at + 1)
        at += 1
    return where, at


def solve(problem, frame, covariance=True):
    """Stacks one frame's problem and solves it."""
    tree, kin = problem.tree, problem.kinematics
    where, size = layout(tree)
    rows, right = [], []

    def pick(block):
        return block[frame if len(block) > 1 else 0] if block.ndim == 3 else block

    def add(parts, y, cov):
        row = np.zeros((len(y), size))
        for key, matrix in parts.items():
            row[:, where[key]] += matrix
        white = np.linalg.inv(np.linalg.cholesky(cov))
        rows.append(white @ row)
        right.append(white @ y)

    eye = np.eye(6)
    for link, parent in enumerate(tree.parents):
        w = kin.omega[link][frame]
        M = tree.inertias[link]
        h = M @ np.r_[np.zeros(3), w]
        parts = {("a", link): M, ("fx", link): -eye}
        if link:
            parts["fj", link] = -eye
        for child in np.flatnonzero(np.array(tree.parents) == link):
            parts["fj", int(child)] = kin.X[child][frame].T
        add(parts, -np.r_[S(w) @ h[:3], S(w) @ h[3:]], problem.dynamics[link])
        if link:
            H = kin.H[link][frame]
            parts = {("a", link): -eye, ("a", parent): kin.X[link][frame]}
            for place, dof in enumerate(tree.dofs[link]):
                parts["s", int(dof)] = H[:, [place]]
            add(parts, -kin.bias[link][frame], problem.kinematic[link])
            if problem.Sf is not None:
                add({("fj", link): eye}, np.full(6, problem.mu), problem.Sf)
            gs = pick(np.atleast_2d(problem.Gs[link])[:, None, :])[0]
            for dof, var in zip(tree.dofs[link], gs, strict=True):
                add({("s", int(dof)): eye[:1, :1]}, problem.s_hat[frame, [dof]], var * eye[:1, :1])
        J = pick(problem.J[link])
        value, vector = np.linalg.eigh(J)
        root = (vector * np.sqrt(value)).T
        back = (vector / np.sqrt(value)).T
        row = np.zeros((6, size))
        row[:, where["a", link]] = root
        rows.append(row)
        right.append(back @ problem.j[link][frame])
        add({("fx", link): eye}, problem.fbar[link][frame], pick(problem.Px[link]))
    A, y = np.concatenate(rows), np.concatenate(right)
    scale = np.linalg.norm(A, axis=0)
    q, r = np.linalg.qr(A / scale)
    mean = np.linalg.solve(r, q.T @ y) / scale
    if not covariance:
        return Dense(mean, np.empty(0), where)
    inverse = np.linalg.inv(r) / scale[:, None]
    return Dense(mean, inverse @ inverse.T, where)
