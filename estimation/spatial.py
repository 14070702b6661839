"""Six-dimensional vectors and matrices, linear first, in whole batches."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]

#: What a kilogram at rest weighs, N: that of `human.dynamics.GRAVITY`.
GRAVITY_MS2 = 9.81


def skew(vector: Array) -> Array:
    """Returns the cross-product matrices ``(..., 3, 3)`` of vectors ``(..., 3)``."""
    out = np.zeros((*vector.shape, 3))
    out[..., 0, 1], out[..., 0, 2] = -vector[..., 2], vector[..., 1]
    out[..., 1, 0], out[..., 1, 2] = vector[..., 2], -vector[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -vector[..., 1], vector[..., 0]
    return out


def cross(left: Array, right: Array) -> Array:
    """Returns the cross products ``(..., 3)``; several times as fast as `numpy.cross` here."""
    out = np.empty(np.broadcast_shapes(left.shape, right.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., i] = left[..., j] * right[..., k] - left[..., k] * right[..., j]
    return out


def transposed(matrix: Array) -> Array:
    """Returns the transposes of matrices ``(..., m, n)``."""
    return np.asarray(matrix.swapaxes(-1, -2))


def symmetric(matrix: Array) -> Array:
    """Returns the symmetric parts of matrices ``(..., n, n)``: rounding leaves them askew."""
    return np.asarray(0.5 * (matrix + transposed(matrix)))


def inverse(matrix: Array) -> Array:
    """Returns the inverses of matrices ``(..., n, n)``."""
    return np.asarray(np.linalg.inv(matrix), dtype=np.float64)


def times(matrix: Array, vector: Array) -> Array:
    """Returns matrices ``(..., m, n)`` times vectors ``(..., n)``."""
    return np.asarray((matrix @ vector[..., None])[..., 0])


def motion_transform(rotation: Array, position: Array) -> Array:
    """Returns the matrices ``(..., 6, 6)`` that carry accelerations from one point to another.

    Args:
        rotation: ``(..., 3, 3)`` new axes in the old ones (columns).
        position: ``(..., 3)`` m, the new point in the old axes, from the old point.

    Returns:
        ``X = [R', -R' S(p); 0, R']``; its transpose carries wrenches back.

    Source: Latella et al. 2019, eq. 16, in the form that holds for classical accelerations.
    """
    turned = transposed(rotation)
    out = np.zeros((*np.broadcast_shapes(rotation.shape[:-2], position.shape[:-1]), 6, 6))
    out[..., :3, :3] = turned
    out[..., 3:, 3:] = turned
    out[..., :3, 3:] = -turned @ skew(position)
    return out


def spatial_inertia(mass: float, center: Array, inertia: Array) -> Array:
    """Returns the ``(6, 6)`` inertia of a body about its link's origin.

    Args:
        mass: kg.
        center: ``(3,)`` m, centre of mass in link axes.
        inertia: ``(3, 3)`` kg m^2 about the centre of mass, link axes.

    Source: Tirupachuri et al. 2021, below eq. 15.
    """
    lever = skew(center)
    out = np.empty((6, 6))
    out[:3, :3] = mass * np.eye(3)
    out[:3, 3:] = -mass * lever
    out[3:, :3] = mass * lever
    out[3:, 3:] = inertia - mass * lever @ lever
    return out
