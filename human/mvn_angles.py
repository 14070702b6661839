"""Joint angles as MVN reports them: a derived quantity for comparison and for readers used to them.

The model's own angles are the x-y-z ones of its revolutes (`human.pose`). These are the clinical
triplets of the ISB: lateral bending or abduction, axial or inward rotation, flexion; zero standing
with hanging arms, palms to the thighs.

Source: Wu et al. 2002 and 2005 (ISB axes: x forward, y up, z right). Order, signs and zero of every
    joint
determined here from MVNX files of versions 3 and 4, which state both orientations and angles; they
reproduce the stated angles to the rounding of the files.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from human.names import PARENT_SEGMENT, SEGMENT_OF_JOINT
from human.rotations import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
)

Array = NDArray[np.float64]
Sequence = Literal["ZXY", "XZY"]

_HALF = float(np.sqrt(0.5))
#: Orientation in the T-pose, xyzw, of axes that are parallel to the world's when the arms hang with
#: the palms to the thighs; in these MVN takes arm angles, and older files state arm orientations.
HANGING_ARM_AXES: Mapping[str, Array] = MappingProxyType(
    {
        "RightUpperArm": np.array([-_HALF, 0.0, 0.0, _HALF]),
        "RightForeArm": np.array([-0.5, 0.5, 0.5, 0.5]),
        "RightHand": np.array([-0.5, 0.5, 0.5, 0.5]),
        "LeftUpperArm": np.array([_HALF, 0.0, 0.0, _HALF]),
        "LeftForeArm": np.array([0.5, 0.5, -0.5, 0.5]),
        "LeftHand": np.array([0.5, 0.5, -0.5, 0.5]),
    }
)
#: Columns are the ISB axes in house axes: x forward, y up (house z), z right (minus house y).
_ISB = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def mvn_joint_angles_deg(
    joint: str, parent_xyzw: ArrayLike, child_xyzw: ArrayLike, sequence: Sequence = "ZXY"
) -> Array:
    """Returns a joint's angles as MVN states them.

    Args:
        joint: house name.
        parent_xyzw: ``(..., 4)`` orientation of the parent segment's T-pose axes.
        child_xyzw: ``(..., 4)`` of the child's, in the same world.
        sequence: ``ZXY`` is MVNX ``jointAngle``, ``XZY`` its ``jointAngleXZY``.

    Returns:
        ``(..., 3)`` degrees: lateral bending or abduction, axial rotation, flexion.
    """
    child = SEGMENT_OF_JOINT[joint]
    turn = quaternion_multiply(
        quaternion_conjugate(_isb(PARENT_SEGMENT[child], parent_xyzw)), _isb(child, child_xyzw)
    )
    rotation: Array = _ISB.T @ quaternion_to_matrix(turn) @ _ISB
    if sequence == "ZXY":
        flexion = np.arctan2(-rotation[..., 0, 1], rotation[..., 1, 1])
        lateral = np.arctan2(
            rotation[..., 2, 1], np.hypot(rotation[..., 0, 1], rotation[..., 1, 1])
        )
        axial = np.arctan2(-rotation[..., 2, 0], rotation[..., 2, 2])
    else:
        flexion = np.arctan2(
            -rotation[..., 0, 1], np.hypot(rotation[..., 1, 1], rotation[..., 2, 1])
        )
        lateral = np.arctan2(rotation[..., 2, 1], rotation[..., 1, 1])
        axial = np.arctan2(rotation[..., 0, 2], rotation[..., 0, 0])
    return np.asarray(np.rad2deg(np.stack([lateral, axial, flexion], axis=-1)) * _signs(joint))


def _isb(segment: str, quat: ArrayLike) -> Array:
    axes = HANGING_ARM_AXES.get(segment)
    array = np.asarray(quat, dtype=np.float64)
    return array if axes is None else quaternion_multiply(array, axes)


def _signs(joint: str) -> Array:
    """Outward, inward and forward count positive on both sides; knees and toes bend backward."""
    if joint.startswith("jRight") or joint.startswith("jLeft"):
        flexion = -1.0 if joint.endswith(("Knee", "BallFoot")) else 1.0
        return (
            np.array([-1.0, 1.0, flexion]) if "Right" in joint else np.array([1.0, -1.0, flexion])
        )
    return np.array([1.0, 1.0, -1.0])


__all__ = ["HANGING_ARM_AXES", "mvn_joint_angles_deg"]
