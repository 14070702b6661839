"""Plates whose channels were plugged into each other's place."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from estimation.feet.plate_faults import ENTER_N
from estimation.feet.plate_stances import Standing, force_points
from estimation.spatial import Array
from human.marker_recording import ForcePlate, PlateForces

#: As read, the forces enter so far outside of any sole, m; exchanged, so near.
_FAR_M, _NEAR_M = 0.1, 0.05


def distances_m(
    plates: PlateForces, standing: Standing, which: Sequence[int] | None = None
) -> Array:
    """Returns how far outside of the nearest sole the force of each plate, or of some, enters.

    It is the median over the loaded frames, NaN for a plate that bears nothing.
    """
    wanted = range(len(plates.plates)) if which is None else which
    out = np.full(len(wanted), np.nan)
    for place, k in enumerate(wanted):
        point, bears = force_points(plates, k, standing.time_s, ENTER_N)
        if np.any(bears):
            outside = standing.soles.outside_m(point)[bears]
            out[place] = np.median(outside[:, :2].min(axis=1))
    return out


def put_back(plates: PlateForces, standing: Standing) -> tuple[PlateForces, list[int], list[str]]:
    """Exchanges the channels of plates that only fit the feet in each other's place.

    Args:
        plates: put right otherwise, times on the motion's clock.
        standing: the feet.

    Returns:
        The plates, whose channels each has now, and what was assumed.
    """
    assumed, channels = [], list(range(len(plates.plates)))
    distance = distances_m(plates, standing)
    for i, j in combinations(range(len(plates.plates)), 2):
        as_read = distance[[i, j]]
        if np.all(np.isnan(as_read)) or not np.nanmin(as_read) > _FAR_M:
            continue
        exchanged = _exchanged(plates, i, j)
        instead = distances_m(exchanged, standing, (i, j))
        if np.nanmax(instead) < _NEAR_M:
            plates, distance[[i, j]] = exchanged, instead
            channels[i], channels[j] = channels[j], channels[i]
            first, second = plates.plates[i].name, plates.plates[j].name
            assumed.append(
                f"plates {first} and {second}: their forces enter {np.nanmin(as_read):.2f} m from "
                "the nearest foot, but under a foot if the two are exchanged; exchanged"
            )
    return plates, channels, assumed


def _exchanged(plates: PlateForces, i: int, j: int) -> PlateForces:
    """Returns the plates with the channels of two in each other's place and axes."""
    turn = _axes(plates.plates[j]) @ _axes(plates.plates[i]).T
    force, moment = plates.force.copy(), plates.moment.copy()
    for array, read in ((force, plates.force), (moment, plates.moment)):
        array[:, j] = read[:, i] @ turn.T
        array[:, i] = read[:, j] @ turn
    return replace(plates, force=force, moment=moment)


def _axes(plate: ForcePlate) -> Array:
    """Returns a plate's axes in the world, columns; the world's if its corners are not known."""
    if plate.corners is None:
        return np.eye(3)
    x = plate.corners[0] - plate.corners[1]
    x = x / np.linalg.norm(x)
    z = np.cross(x, plate.corners[0] - plate.corners[3])
    z = z / np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=1)
