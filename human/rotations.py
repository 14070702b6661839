"""Batched rotations: quaternions (``xyzw``), matrices, x-y-z angles, rotation vectors.

Every function takes any number of leading dimensions and broadcasts over them. A rotation acts on
column vectors: ``R_world_hand @ v_hand`` is the same vector in world axes. Angles are in radians.

Source: Sola, "Quaternion kinematics for the error-state Kalman filter" (2017), sections 1-2
(Hamilton convention); x-y-z angles derived here from ``R = Rx(a) Ry(b) Rz(c)``.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from human.errors import RotationError

Array = NDArray[np.float64]

#: Below this angle the exponential and logarithm use their series, exact there to the last bit.
_SMALL_ANGLE_RAD = 1e-5


def _finite(value: ArrayLike, last: tuple[int, ...], what: str) -> Array:
    array = np.asarray(value, dtype=np.float64)
    if array.shape[-len(last) :] != last:
        raise RotationError(
            f"{what}: expected shape (..., {', '.join(map(str, last))}), got {array.shape}"
        )
    return array


def quaternion_normalized(quat_xyzw: ArrayLike) -> Array:
    """Returns unit quaternions of the same direction.

    Args:
        quat_xyzw: ``(..., 4)``.

    Raises:
        RotationError: a quaternion is zero or not finite.
    """
    quat = _finite(quat_xyzw, (4,), "quaternion")
    norm = np.linalg.norm(quat, axis=-1, keepdims=True)
    if not np.all(np.isfinite(norm) & (norm > 0.0)):
        raise RotationError(
            "quaternion: expected finite and non-zero, got a zero or non-finite one"
        )
    return np.asarray(quat / norm)


def quaternion_multiply(first: ArrayLike, second: ArrayLike) -> Array:
    """Returns the Hamilton product: the rotation ``second`` followed by ``first``.

    Args:
        first: ``(..., 4)`` xyzw.
        second: ``(..., 4)`` xyzw.
    """
    ax, ay, az, aw = np.moveaxis(_finite(first, (4,), "quaternion"), -1, 0)
    bx, by, bz, bw = np.moveaxis(_finite(second, (4,), "quaternion"), -1, 0)
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=-1,
    )


def quaternion_conjugate(quat_xyzw: ArrayLike) -> Array:
    """Returns the inverse of unit quaternions ``(..., 4)``."""
    return np.asarray(_finite(quat_xyzw, (4,), "quaternion") * np.array([-1.0, -1.0, -1.0, 1.0]))


def quaternion_rotate(quat_xyzw: ArrayLike, vector: ArrayLike) -> Array:
    """Rotates vectors ``(..., 3)`` by unit quaternions ``(..., 4)``."""
    quat = _finite(quat_xyzw, (4,), "quaternion")
    v = _finite(vector, (3,), "vector")
    twice = 2.0 * np.cross(quat[..., :3], v)
    return np.asarray(v + quat[..., 3:] * twice + np.cross(quat[..., :3], twice))


def quaternion_continuous(quat_xyzw: ArrayLike) -> Array:
    """Returns the same rotations, signs chosen so that neighbours in time are in one hemisphere.

    Args:
        quat_xyzw: ``(time, ..., 4)``; the first keeps its sign.
    """
    quat = _finite(quat_xyzw, (4,), "quaternion")
    if quat.ndim < 2 or quat.shape[0] < 2:
        return quat.copy()
    step = np.where(np.sum(quat[1:] * quat[:-1], axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    signs = np.concatenate([np.ones_like(step[:1]), np.cumprod(step, axis=0)])
    return np.asarray(quat * signs)


def quaternion_to_matrix(quat_xyzw: ArrayLike) -> Array:
    """Returns rotation matrices ``(..., 3, 3)`` of unit quaternions ``(..., 4)``."""
    x, y, z, w = np.moveaxis(_finite(quat_xyzw, (4,), "quaternion"), -1, 0)
    out = np.empty((*x.shape, 3, 3))
    out[..., 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    out[..., 0, 1] = 2.0 * (x * y - z * w)
    out[..., 0, 2] = 2.0 * (x * z + y * w)
    out[..., 1, 0] = 2.0 * (x * y + z * w)
    out[..., 1, 1] = 1.0 - 2.0 * (x * x + z * z)
    out[..., 1, 2] = 2.0 * (y * z - x * w)
    out[..., 2, 0] = 2.0 * (x * z - y * w)
    out[..., 2, 1] = 2.0 * (y * z + x * w)
    out[..., 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    return out


def matrix_to_quaternion(rotation: ArrayLike) -> Array:
    """Returns unit quaternions ``(..., 4)`` xyzw, w >= 0, of rotation matrices ``(..., 3, 3)``.

    Source: Shepperd 1978 (the largest of the four squared components is the divisor, so that
    nothing cancels at half turns).
    """
    r = _finite(rotation, (3, 3), "rotation matrix")
    diagonal = np.diagonal(r, axis1=-2, axis2=-1)
    trace = diagonal.sum(axis=-1)
    # Four scaled copies of the same quaternion: row k is 4 * component_k * quaternion.
    rows = np.empty((*trace.shape, 4, 4))
    for k in range(3):
        rows[..., k, k] = 1.0 + 2.0 * diagonal[..., k] - trace
    rows[..., 3, 3] = 1.0 + trace
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        rows[..., i, j] = rows[..., j, i] = r[..., i, j] + r[..., j, i]
        rows[..., k, 3] = rows[..., 3, k] = r[..., j, i] - r[..., i, j]
    best = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)
    quat = np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :]
    quat = quaternion_normalized(quat)
    return np.where(quat[..., 3:] < 0.0, -quat, quat)


def rotation_vector_to_quaternion(vector: ArrayLike) -> Array:
    """Exponential map: rotation vectors ``(..., 3)`` (rad) to unit quaternions ``(..., 4)``."""
    v = _finite(vector, (3,), "rotation vector")
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    # sin(angle / 2) / angle, whole for any angle.
    return np.concatenate([v * 0.5 * np.sinc(angle / (2.0 * np.pi)), np.cos(0.5 * angle)], axis=-1)


def quaternion_to_rotation_vector(quat_xyzw: ArrayLike) -> Array:
    """Logarithm: the shortest rotation vectors ``(..., 3)`` (rad) of quaternions ``(..., 4)``."""
    quat = _finite(quat_xyzw, (4,), "quaternion")
    quat = np.where(quat[..., 3:] < 0.0, -quat, quat)
    sine = np.linalg.norm(quat[..., :3], axis=-1, keepdims=True)
    half = np.arctan2(sine, quat[..., 3:])
    small = sine < _SMALL_ANGLE_RAD
    factor = np.where(small, 2.0 + sine**2 / 3.0, 2.0 * half / np.where(small, 1.0, sine))
    return np.asarray(quat[..., :3] * factor)


def matrix_to_rotation_vector(rotation: ArrayLike) -> Array:
    """Logarithm of matrices ``(..., 3, 3)``: the shortest rotation vectors ``(..., 3)`` (rad)."""
    return quaternion_to_rotation_vector(matrix_to_quaternion(rotation))


def rotation_vector_to_matrix(vector: ArrayLike) -> Array:
    """Exponential map: rotation vectors ``(..., 3)`` (rad) to matrices ``(..., 3, 3)``."""
    return quaternion_to_matrix(rotation_vector_to_quaternion(vector))


def xyz_to_matrix(angles: ArrayLike) -> Array:
    """Returns ``Rx(a) Ry(b) Rz(c)``, the rotation of a spherical joint of the model.

    Args:
        angles: ``(..., 3)`` rad, the joint's three degrees of freedom in order.

    Returns:
        ``(..., 3, 3)``, child axes in the parent's.

    Source: Latella et al. 2019, section 2.3 (each joint is three revolutes, x then y then z).
    """
    a = _finite(angles, (3,), "x-y-z angles")
    (sa, sb, sc), (ca, cb, cc) = np.moveaxis(np.sin(a), -1, 0), np.moveaxis(np.cos(a), -1, 0)
    out = np.empty((*a.shape[:-1], 3, 3))
    out[..., 0, 0] = cb * cc
    out[..., 0, 1] = -cb * sc
    out[..., 0, 2] = sb
    out[..., 1, 0] = ca * sc + sa * sb * cc
    out[..., 1, 1] = ca * cc - sa * sb * sc
    out[..., 1, 2] = -sa * cb
    out[..., 2, 0] = sa * sc - ca * sb * cc
    out[..., 2, 1] = sa * cc + ca * sb * sc
    out[..., 2, 2] = ca * cb
    return out


def matrix_to_xyz(rotation: ArrayLike) -> Array:
    """Returns the x-y-z angles ``(..., 3)`` (rad) with the middle one in [-pi/2, pi/2].

    At a middle angle of 90 degrees only the sum or difference of the other two is defined: the
    third is then zero. The same rotation is also given by ``(a + pi, pi - b, c + pi)``; which of
    the two a person's joint is at is for the caller (`human.pose`) to decide.

    Args:
        rotation: ``(..., 3, 3)`` child axes in the parent's.
    """
    r = _finite(rotation, (3, 3), "rotation matrix")
    cos_b = np.hypot(r[..., 0, 0], r[..., 0, 1])
    b = np.arctan2(r[..., 0, 2], cos_b)
    locked = cos_b < 1e-12
    a = np.where(
        locked,
        np.arctan2(r[..., 2, 1], r[..., 1, 1]),
        np.arctan2(-r[..., 1, 2], r[..., 2, 2]),
    )
    c = np.where(locked, 0.0, np.arctan2(-r[..., 0, 1], r[..., 0, 0]))
    return np.stack([a, b, c], axis=-1)


def skew(vector: ArrayLike) -> Array:
    """Returns the cross-product matrices ``(..., 3, 3)`` of vectors ``(..., 3)``."""
    v = _finite(vector, (3,), "vector")
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2] = -v[..., 2], v[..., 1]
    out[..., 1, 0], out[..., 1, 2] = v[..., 2], -v[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -v[..., 1], v[..., 0]
    return out
