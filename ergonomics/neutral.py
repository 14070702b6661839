"""What counts as zero: the anatomical N-pose, of the model or as a person stood it."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .errors import PostureError
from .geometry import heading_axes

Floats = NDArray[np.float64]


class Poses(Protocol):
    """Where the segments are: ``human.SegmentPoses`` or its like."""

    @property
    def rotation(self) -> Floats:
        """``(..., segments, 3, 3)`` segment axes in world axes."""

    @property
    def position(self) -> Floats:
        """``(..., segments, 3)`` segment origins (proximal joint centres), world, metres."""


#: N-pose from the T-pose: arms turned down about the forward axis, palms to the thighs.
_TURN = {"Right": 1.0, "Left": -1.0}


def n_pose_rotation(segment: str) -> Floats:
    """Returns a segment's rotation in the model's N-pose, ``(3, 3)``.

    In the T-pose every segment frame is aligned with the world; the right arm points along -y.
    A quarter turn about x brings it to -z, the left arm by the opposite turn.
    """
    for side, sign in _TURN.items():
        if segment.startswith(side) and segment.endswith(("UpperArm", "ForeArm", "Hand")):
            return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -sign], [0.0, sign, 0.0]])
    return np.eye(3)


def calibration(
    segment_names: Sequence[str], reference: Poses, pelvis: str = "Pelvis"
) -> Mapping[str, Floats]:
    """Returns the fixed turn of each segment that makes a recorded N-pose read as zero.

    With ``R0`` the mean rotation of the segment in the reference, its heading taken off, and
    ``N`` the model's N-pose, the calibrated rotation is ``R R0^T N``: the turn is fixed in the
    segment, as a sensor or a marker set sits on it. How the pelvis' own turn about the vertical
    was mounted cannot be told from the way the person faced: the pelvis is taken as facing
    forward.

    Args:
        segment_names: Names along the segment axis of ``reference``.
        reference: One or more frames of a person standing in N-pose.
        pelvis: Segment whose heading is taken off.

    Returns:
        ``(3, 3)`` by segment, to be multiplied on the right.

    Raises:
        PostureError: If the reference is malformed, or its frames differ by more than a half
            turn, so that they have no mean.
    """
    rotation = np.asarray(reference.rotation, dtype=np.float64)
    if rotation.shape[-3:] != (len(segment_names), 3, 3):
        raise PostureError(
            "neutral_reference.rotation",
            f"expected (..., {len(segment_names)}, 3, 3), got {rotation.shape}",
        )
    if not np.isfinite(rotation).all():
        raise PostureError("neutral_reference.rotation", "expected finite values")
    frames = rotation.reshape(-1, len(segment_names), 3, 3)
    pelvis_axes = np.moveaxis(frames[:, segment_names.index(pelvis)], 0, -1)
    forward_x, forward_y = heading_axes(pelvis_axes)
    turn_back = np.zeros((len(frames), 3, 3))
    turn_back[:, 0, 0] = turn_back[:, 1, 1] = forward_x
    turn_back[:, 0, 1] = forward_y
    turn_back[:, 1, 0] = -forward_y
    turn_back[:, 2, 2] = 1.0
    mean = (turn_back[:, None] @ frames).mean(axis=0)
    left, spread, right = np.linalg.svd(mean)
    if spread[:, -1].min() < 0.1:
        raise PostureError("neutral_reference", "its frames are not one posture held still")
    handed = np.sign(np.linalg.det(left @ right))
    left[:, :, -1] *= handed[:, None]
    return {
        name: (left[i] @ right[i]).T @ n_pose_rotation(name) for i, name in enumerate(segment_names)
    }
