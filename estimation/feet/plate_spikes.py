"""Samples of force plates that no person causes: gone again before a body could follow."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from estimation.feet.plate_faults import runs
from estimation.spatial import Array, cross
from human.marker_recording import PlateForces

Mask = NDArray[np.bool_]

#: A spike comes and goes within this, s, or one sample where they are further apart.
_SHORT_S = 0.01
#: It departs from what is before and after it by more than so many body weights, and its moment by
#: so many times one metre: a hard landing takes longer, however high.
_DEPARTS = 2.0
#: No foot bears more body weights than this for however long.
_MOST = 20.0


def without_spikes(plates: PlateForces, weight_n: float) -> tuple[PlateForces, Mask, list[str]]:
    """Draws straight lines over samples that no person causes.

    Args:
        plates: in N and N m.
        weight_n: of the person, N.

    Returns:
        The plates; where so many of them follow each other that what was borne meanwhile is not
        known, ``(samples, plates)``; what was found, in words.

    Derived here: a spike differs from the median of the samples around it, which does not see what
    is shorter than half of them. Moments are taken about where the force usually enters: about a
    distant origin they jump with each step.
    """
    time, findings = plates.time_s, []
    force, moment = plates.force.copy(), plates.moment.copy()
    unknown = np.zeros(force.shape[:2], dtype=np.bool_)
    points, _, entered = plates.centres_of_pressure()
    step = float(np.median(np.diff(time))) if len(time) > 1 else np.inf
    short = max(1, round(_SHORT_S / step))
    for k, plate in enumerate(plates.plates):
        arm = np.zeros(3)
        if np.any(entered[:, k]):
            arm = np.median(points[entered[:, k], k], axis=0) - plate.origin
        size = np.concatenate([force[:, k], moment[:, k] - cross(arm, force[:, k])], axis=1)
        size /= weight_n
        torn = _torn(size, short)
        for start, end in runs(torn):
            beside = [n for n in (start - 1, end) if 0 <= n < len(time)]
            if not beside:
                continue
            for values in (force, moment):
                for c in range(3):
                    values[start:end, k, c] = np.interp(
                        time[start:end], time[beside], values[beside, k, c]
                    )
            unknown[start:end, k] = end - start > short
        if np.any(torn):
            most = float(np.max(np.abs(size[torn])))
            count = int(np.sum(torn))
            findings.append(
                f"plate {plate.name} from {time[int(np.argmax(torn))]:.2f} s on: {count} "
                f"sample{'s' if count > 1 else ''} that no person causes, of up to {most:.3g} body "
                "weights; left out"
            )
    return replace(plates, force=force, moment=moment), unknown, findings


def _torn(size: Array, short: int) -> Mask:
    """Returns the samples ``(samples,)`` that are no person's; ``size`` is in body weights."""
    out: Mask = np.any(np.abs(size[:, :3]) > _MOST, axis=1)
    # A median over each channel is slow: most recordings have nothing that it could find.
    for channel in size.T:
        if np.ptp(channel) > _DEPARTS:
            around = median_filter(channel, size=4 * short + 1, mode="nearest")
            out |= np.abs(channel - around) > _DEPARTS
    return out
