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
#: The cosine is taken for no less than about this: the lost axis gets no infinite rate.
_LEAST_COSINE = 1e-4


def spherical_rates(cubic: "LocalCubic", angles: Array) -> tuple[IntArray, Array, Array]:
    """Differentiates one joint through its rotation on the frames that need it.

    Args:
        cubic: the windows.
        angles: ``(time, 3)`` rad, x, y, z.

    Returns:
        The frames ``(n,)``, and there rates (rad/s) and accelerations (rad/s^2), ``(n, 3)``.

    Derived here: with ``R = Rx(a) Ry(b) Rz(c)`` the angular velocity in the child's axes is
    ``a' Rz^T Ry^T e_x + b' Rz^T e_y + c' e_z``, solved for the rates; its derivative likewise.
    """
    frames = cubic.frames_near(np.abs(np.cos(angles[:, 1])) < _NEAR_COSINE)
    if not len(frames):
        return frames, np.zeros((0, 3)), np.zeros((0, 3))
    omega, alpha = cubic.body_rates(matrix_to_quaternion(xyz_to_matrix(angles)), frames)
    b, c = angles[frames, 1], angles[frames, 2]
    (sb, sc), (cb, cc) = (np.sin(b), np.sin(c)), (np.cos(b), np.cos(c))
    inverse = cb / (cb**2 + _LEAST_COSINE**2)

    def to_angles(x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        first = (x * cc - y * sc) * inverse
        return first, x * sc + y * cc, z - sb * first

    da, db, dc = to_angles(*omega.T)
    bias_x = da * (-sb * cc * db - cb * sc * dc) + db * cc * dc
    bias_y = da * (sb * sc * db - cb * cc * dc) - db * sc * dc
    bias_z = da * cb * db
    second = to_angles(alpha[:, 0] - bias_x, alpha[:, 1] - bias_y, alpha[:, 2] - bias_z)
    return frames, np.stack([da, db, dc], axis=-1), np.stack(second, axis=-1)
