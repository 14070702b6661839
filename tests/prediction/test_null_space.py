import numpy as np
import pytest

from prediction.laws.null_space import (
    NullSpaceBasis,
    row_space,
    weighted_pseudo_inverse,
    weighted_solution,
)
from prediction.laws.small_systems import Cholesky, solve_spd


def smooth_jacobians(rng, count=40, task=3, joints=7):
    """A path of Jacobians: neighbours differ by little."""
    base, first, second = rng.normal(size=(3, task, joints))
    phase = np.linspace(0.0, 1.5, count)[:, None, None]
    return base + 0.4 * np.sin(phase) * first + 0.4 * np.cos(2 * phase) * second


def random_rotations(rng, count, size):
    q, _ = np.linalg.qr(rng.normal(size=(count, size, size)))
    return q


@pytest.mark.parametrize("full", [False, True])
def test_weighted_solution_is_the_cheapest_that_does_the_task(rng, full):
    J, x = rng.normal(size=(20, 3, 7)), rng.normal(size=(20, 3))
    W = rng.uniform(0.1, 3.0, 7)
    if full:
        root = rng.normal(size=(7, 7))
        W = root @ root.T + 0.1 * np.eye(7)
    dq = weighted_solution(W, J, x)
    np.testing.assert_allclose(np.einsum("tmn,tn->tm", J, dq), x, atol=1e-12)
    np.testing.assert_allclose((weighted_pseudo_inverse(W, J) @ x[..., None])[..., 0], dq)
    cost = np.linalg.inv(W if full else np.diag(W))
    null = NullSpaceBasis.around(J).frame(J).matrix()
    # first order: the cost gradient has no part along any motion that leaves the hand
    slope = np.einsum("tnk,nm,tm->tk", null, cost, dq)
    np.testing.assert_allclose(slope, 0.0, atol=1e-10)


def test_basis_is_orthonormal_and_spans_the_null_space(rng):
    J = smooth_jacobians(rng)
    V = NullSpaceBasis.around(J).frame(J).matrix()
    np.testing.assert_allclose(np.swapaxes(V, 1, 2) @ V, np.tile(np.eye(4), (40, 1, 1)), atol=1e-13)
    np.testing.assert_allclose(J @ V, 0.0, atol=1e-12)


def test_coordinates_and_compose_are_the_products_with_the_basis(rng):
    J = smooth_jacobians(rng)
    frame = NullSpaceBasis.around(J).frame(J)
    V = frame.matrix()
    y, velocity = rng.normal(size=(40, 4)), rng.normal(size=(40, 7))
    np.testing.assert_allclose(frame.compose(y), np.einsum("tnk,tk->tn", V, y), atol=1e-13)
    np.testing.assert_allclose(
        frame.coordinates(velocity), np.einsum("tnk,tn->tk", V, velocity), atol=1e-13
    )


def test_signs_and_rotations_of_any_decomposition_change_nothing(rng):
    J = smooth_jacobians(rng)
    basis = NullSpaceBasis.around(J)
    V = basis.frame(J).matrix()
    signs = np.sign(rng.normal(size=(40, 3)))[:, :, None] * np.eye(3)
    for turned in (random_rotations(rng, 40, 3) @ J, signs @ J):
        np.testing.assert_allclose(basis.frame(turned).matrix(), V, atol=1e-12)
        # the reference itself may come in other axes; the coordinates then turn by one constant
        other = NullSpaceBasis.around(turned)
        np.testing.assert_allclose(other.null @ other.null.T, basis.null @ basis.null.T, atol=1e-10)


def test_basis_follows_the_posture_smoothly_where_the_decomposition_jumps(rng):
    J = smooth_jacobians(rng, count=400)
    V = NullSpaceBasis.around(J).frame(J).matrix()
    own = np.abs(np.diff(V, axis=0)).max(axis=(1, 2))
    moved = np.abs(np.diff(J, axis=0)).max(axis=(1, 2))
    assert own.max() < 20 * moved.max()
    flipped = np.linalg.svd(random_rotations(rng, 400, 3) @ J)[2][:, 3:]
    assert np.abs(np.diff(flipped, axis=0)).max() > 20 * own.max()


def test_basis_at_the_reference_is_the_reference(rng):
    J = smooth_jacobians(rng)
    basis = NullSpaceBasis.around(J)
    np.testing.assert_allclose(basis.frame(basis.rows).matrix(), basis.null, atol=1e-13)
    assert basis.redundancy == 4


def test_log_volume_is_that_of_the_row_space(rng):
    J = rng.normal(size=(10, 3, 7))
    rows = row_space(J)
    log_volume = NullSpaceBasis.around(J).frame(J).log_volume
    singular = np.linalg.svd(J, compute_uv=False)
    np.testing.assert_allclose(log_volume, np.log(singular).sum(axis=1))
    np.testing.assert_allclose(
        rows @ np.swapaxes(rows, 1, 2), np.tile(np.eye(3), (10, 1, 1)), atol=1e-12
    )


@pytest.mark.parametrize(("kind", "close"), [(np.float64, 1e-10), (np.float32, 1e-3)])
def test_small_systems_solve_and_bound_what_is_singular(rng, kind, close):
    root = rng.normal(size=(2, 3, 4, 4))
    A = (root @ np.swapaxes(root, -1, -2) + 0.1 * np.eye(4)).astype(kind)
    b = rng.normal(size=(2, 3, 4, 2)).astype(kind)
    factor = Cholesky.of(A)
    C = factor.upper()
    np.testing.assert_allclose(np.swapaxes(C, -1, -2) @ C, A, atol=close)
    np.testing.assert_allclose(C, np.triu(C))
    np.testing.assert_allclose(np.swapaxes(C, -1, -2) @ factor.whiten(b), b, atol=close)
    np.testing.assert_allclose(C @ factor.unwhiten(b), b, atol=close)
    np.testing.assert_allclose(A @ factor.solve(b), b, atol=close)
    np.testing.assert_allclose(factor.half_log_det, 0.5 * np.linalg.slogdet(A)[1], atol=close)
    np.testing.assert_allclose(factor.shifted().upper(), C + np.eye(4), atol=close)
    exact = solve_spd(A, b)
    assert exact.dtype == kind
    alone = [solve_spd(A[0, 0], b[0, 0]) for _ in range(2)]  # nothing given is written to
    np.testing.assert_array_equal(alone, [exact[0, 0]] * 2)
    A[1, 0] = np.diag([1.0, 1.0, 1.0, 0.0])
    x = solve_spd(A, b)
    assert np.isfinite(x).all()
    others = np.arange(6).reshape(2, 3) != 3
    np.testing.assert_array_equal(x[others], exact[others])
    np.testing.assert_allclose(x[1, 0, :3], b[1, 0, :3], rtol=1e-3)
