"""Adds up what plates do to each foot, sample by sample."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.feet.plate_smoothing import resampled
from estimation.feet.plate_stances import BOTH, NONE, LoadedTime, Standing
from estimation.spatial import Array, cross
from human.marker_recording import PlateForces

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class FootSums:
    """Wrenches under the feet at the plates' samples; right, then left.

    Attributes:
        time_s: ``(samples,)`` s, on the motion's clock.
        wrench: ``(samples, 2, 6)`` N, N m, world axes, about the world's origin.
        origin: ``(samples, 2, 3)`` m, of the plate that bears most of it.
        saturated: ``(samples, 2)`` where a plate under the foot is at its limit.
        lost: ``(samples, 2)`` where its samples did not arrive.
    """

    time_s: Array
    wrench: Array
    origin: Array
    saturated: Mask
    lost: Mask

    def point(self, at_s: Array) -> Array:
        """Returns the bearing plates' origins ``(2, frames, 3)`` m."""
        nearest = np.clip(np.searchsorted(self.time_s, at_s), 0, len(self.time_s) - 1)
        return np.asarray(np.moveaxis(self.origin[nearest], 1, 0))

    def at_frames(self, samples: Mask, at_s: Array) -> Mask:
        """Returns the frames nearest to which any of some samples lies."""
        out = np.zeros(len(at_s), dtype=np.bool_)
        if np.any(samples):
            edges = 0.5 * (at_s[1:] + at_s[:-1])
            out[np.searchsorted(edges, self.time_s[samples])] = True
            out[[0, -1]] &= [
                bool(np.any(samples & (np.abs(self.time_s - at_s[k]) < 0.1))) for k in (0, -1)
            ]
        return out


def sums_of_feet(
    plates: PlateForces, standing: Standing, loads: list[LoadedTime], bad: list[Mask]
) -> FootSums:
    """Gives each load to its foot and adds up; what both feet share is split by where it enters.

    Args:
        plates: put right, times on the motion's clock.
        standing: the feet.
        loads: whose each load is.
        bad: where plates are at their limit, and where samples were lost, ``(samples, plates)``.
    """
    time, samples = plates.time_s, len(plates.time_s)
    wrench = np.zeros((samples, 2, 6))
    at = np.array([plate.origin for plate in plates.plates])
    origin = np.broadcast_to(at.mean(axis=0), (samples, 2, 3)).copy()
    most = np.zeros((samples, 2))
    limits, gone = np.zeros((samples, 2), dtype=np.bool_), np.zeros((samples, 2), dtype=np.bool_)
    for load in loads:
        if load.foot == NONE:
            continue
        part = np.flatnonzero((time >= load.start_s) & (time <= load.end_s))
        force = plates.force[part, load.plate]
        moment = plates.moment[part, load.plate] + cross(at[load.plate], force)
        whole = np.concatenate([force, moment], axis=1)
        feet = [0, 1] if load.foot == BOTH else [load.foot]
        shares = _split(whole, time[part], standing) if load.foot == BOTH else [whole]
        for foot, share in zip(feet, shares, strict=True):
            wrench[part, foot] += share
            limits[part, foot] |= bad[0][part, load.plate]
            gone[part, foot] |= bad[1][part, load.plate]
            more = part[share[:, 2] > most[part, foot]]
            origin[more, foot] = at[load.plate]
            most[part, foot] = np.maximum(most[part, foot], share[:, 2])
    return FootSums(time, wrench, origin, limits, gone)


def _split(wrench: Array, time_s: Array, standing: Standing) -> list[Array]:
    """Splits wrenches ``(samples, 6)`` between both feet; the parts add up exactly.

    Derived here: each foot bears the share that the point of entry has on the way between the
    soles' middles, at its own middle moved by what the point is beside that way.
    """
    centers = standing.soles.center.reshape(len(standing.time_s), 6)
    center = resampled(standing.time_s, centers, time_s, 0.0).reshape(-1, 2, 3)
    up = np.maximum(wrench[:, 2], 1.0)
    height = center[..., 2].mean(axis=1)
    point = np.stack(
        [
            (height * wrench[:, 0] - wrench[:, 4]) / up,
            (height * wrench[:, 1] + wrench[:, 3]) / up,
        ],
        axis=-1,
    )
    way = center[:, 1, :2] - center[:, 0, :2]
    along = np.sum((point - center[:, 0, :2]) * way, axis=1) / np.sum(way * way, axis=1)
    left = np.clip(along, 0.0, 1.0)
    beside = point - (center[:, 0, :2] + left[:, None] * way)
    force = left[:, None] * wrench[:, :3]
    enters = np.concatenate([center[:, 1, :2] + beside, height[:, None]], axis=1)
    moment = cross(enters, force)
    moment[:, 2] += left * (
        wrench[:, 5] - (point[:, 0] * wrench[:, 1] - point[:, 1] * wrench[:, 0])
    )
    part = np.concatenate([force, moment], axis=1)
    return [wrench - part, part]
