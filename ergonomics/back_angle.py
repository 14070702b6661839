"""How far the back is bent, along the spine and against gravity: two measures, named apart.

``chain_sum_deg`` adds up the forward bending of the four lumbar and thoracic joints without sign,
so that an S-shaped spine does not cancel out. A hip hinge with a straight back leaves it near
zero; ``trunk_inclination_deg`` (from the posture angles) sees the hinge. Report both.

The literature names a cumulative back angle and prints no formula; these are definitions of ours.
Derived here.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .angles import SegmentNames
from .errors import PostureError
from .neutral import Poses
from .timeline import dose, time_mean, time_quantile, time_share

Floats = NDArray[np.float64]

#: The joints of the sum, from below, with their parent and child segments.
BACK_JOINTS: tuple[tuple[str, str, str], ...] = (
    ("jL5S1", "Pelvis", "L5"),
    ("jL4L3", "L5", "L3"),
    ("jL1T12", "L3", "T12"),
    ("jT9T8", "T12", "T8"),
)
ZONES_DEG = (20.0, 60.0)


@dataclass(frozen=True, slots=True)
class BackAngle:
    """Bending of the back along the spine, degrees.

    Attributes:
        by_joint_deg: ``(..., 4)`` forward bending at each of ``BACK_JOINTS``, + forward.
        chain_sum_deg: ``(...)`` sum of their magnitudes.
        signed_sum_deg: ``(...)`` sum with sign: the bend of the upper trunk against the pelvis.
    """

    by_joint_deg: Floats
    chain_sum_deg: Floats
    signed_sum_deg: Floats


@dataclass(frozen=True, slots=True)
class BackDose:
    """A back angle over time.

    Attributes:
        dose_deg_s: Integral over time, degree seconds.
        mean_deg: Dose by duration.
        percentiles_deg: 10th, 50th and 90th by time.
        zone_share: Shares of the time below 20, between 20 and 60, and above 60 degrees.
    """

    dose_deg_s: float
    mean_deg: float
    percentiles_deg: tuple[float, float, float]
    zone_share: tuple[float, float, float]


def back_angle(model: SegmentNames, poses: Poses) -> BackAngle:
    """Measures the bending of the back.

    The bending of a joint is the angle of the upper segment's long axis in the sagittal plane of
    the lower one: no Euler sequence, so a twist or side-bend does not leak into it.

    Args:
        model: Anything with the ``segment_names`` of the poses.
        poses: Segment rotations ``(..., segments, 3, 3)`` in the world.

    Raises:
        PostureError: If a segment of the back is missing or a value is not finite.
    """
    names: Sequence[str] = model.segment_names
    rotation = np.asarray(poses.rotation, dtype=np.float64)
    if rotation.ndim < 3 or rotation.shape[-3:] != (len(names), 3, 3):
        raise PostureError(
            "poses.rotation", f"expected (..., {len(names)}, 3, 3), got {rotation.shape}"
        )
    bends = []
    for _, below, above in BACK_JOINTS:
        for name in (below, above):
            if name not in names:
                raise PostureError("model.segment_names", f"{name!r} is missing")
        lower = rotation[..., names.index(below), :, :]
        axis = rotation[..., names.index(above), :, 2]
        forward = (lower[..., 0] * axis).sum(axis=-1)
        up = (lower[..., 2] * axis).sum(axis=-1)
        bends.append(np.rad2deg(np.arctan2(forward, up)))
    by_joint = np.stack(bends, axis=-1)
    if not np.isfinite(by_joint).all():
        raise PostureError("poses.rotation", "expected finite values")
    return BackAngle(by_joint, np.abs(by_joint).sum(axis=-1), by_joint.sum(axis=-1))


def back_dose(angle_deg: ArrayLike, time_s: ArrayLike) -> BackDose:
    """Sums a back angle up over time; either measure of the back will do.

    Args:
        angle_deg: ``(frames,)`` degrees; the magnitude counts.
        time_s: ``(frames,)`` seconds, increasing; uneven steps are weighed as they are.

    Raises:
        PostureError: If the two do not fit together.
    """
    angle = np.abs(np.asarray(angle_deg, dtype=np.float64))
    below, above = ZONES_DEG
    upper = float(time_share(angle > above, time_s))
    middle = float(time_share(angle > below, time_s)) - upper
    low, mid, high = (float(time_quantile(angle, time_s, p)) for p in (0.1, 0.5, 0.9))
    return BackDose(
        dose_deg_s=float(dose(angle, time_s)),
        mean_deg=float(time_mean(angle, time_s)),
        percentiles_deg=(low, mid, high),
        zone_share=(1.0 - middle - upper, middle, upper),
    )
