"""Rates of a spherical joint's three angles where its middle axis nears 90 degrees.

There the outer two angles swing, or jump to the other triple of the same rotation, while the limb
moves smoothly; a cubic through the angles then tells of motion that is not there. The rotation
itself is differentiated instead and its rates turned into those of the angles, so that the
segment's velocity and acceleration are right on every frame.
"""

from typing import TYPE_CHECKING

import numpy as np

from human.model import Array, IntArray
from human.rotations import matrix_to_quaternion, xyz_to_matrix

if TYPE_CHECKING:
    from human.differentiate import LocalCubic

#: Middle angles whose cosine is less, anywhere in a frame's window, make the frame one of these.
_NEAR_COSINE = 0.5
#: Where the cosine is less than about this, the lost axis keeps the rate of the angles' own cubics.
_LOST_COSINE = 0.01


def spherical_rates(
    cubic: "LocalCubic", angles: Array, first: Array, second: Array
) -> tuple[IntArray, Array, Array]:
    """Differentiates one joint through its rotation on the frames that need it.

    Args:
        cubic: the windows.
        angles: ``(time, 3)`` rad, x, y, z.
        first: ``(time, 3)`` rad/s, rates of the angles themselves.
        second: ``(time, 3)`` rad/s^2, likewise.

    Returns:
        The frames ``(n,)``, and there rates (rad/s) and accelerations (rad/s^2), ``(n, 3)``.

    Derived here: with ``R = Rx(a) Ry(b) Rz(c)`` the angular velocity in the child's axes is
    ``E [a', b', c'] = a' Rz^T Ry^T e_x + b' Rz^T e_y + c' e_z``. What the angles' own rates miss of
    the rotation's is solved for and added, with ``cos b / (cos^2 b + h^2)`` for ``1 / cos b``, so
    that at the singular posture itself they stay as they are; the derivative likewise.
    """
    frames = cubic.frames_near(np.abs(np.cos(angles[:, 1])) < _NEAR_COSINE)
    if not len(frames):
        return frames, np.zeros((0, 3)), np.zeros((0, 3))
    omega, alpha = cubic.body_rates(matrix_to_quaternion(xyz_to_matrix(angles)), frames)
    b, c = angles[frames, 1], angles[frames, 2]
    (sb, sc), (cb, cc) = (np.sin(b), np.sin(c)), (np.cos(b), np.cos(c))
    inverse = cb / (cb**2 + _LOST_COSINE**2)

    def velocity(da: Array, db: Array, dc: Array) -> Array:
        return np.stack([da * cb * cc + db * sc, db * cc - da * cb * sc, da * sb + dc], axis=-1)

    def corrected(rates: Array, wanted: Array) -> Array:
        x, y, z = (wanted - velocity(*rates.T)).T
        da = (x * cc - y * sc) * inverse
        return np.asarray(rates + np.stack([da, x * sc + y * cc, z - sb * da], axis=-1))

    rates = corrected(first[frames], omega)
    da, db, dc = rates.T
    bias = np.stack(
        [
            da * (-sb * cc * db - cb * sc * dc) + db * cc * dc,
            da * (sb * sc * db - cb * cc * dc) - db * sc * dc,
            da * cb * db,
        ],
        axis=-1,
    )
    return frames, rates, corrected(second[frames], alpha - bias)
