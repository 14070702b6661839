"""What does not fit between plates, feet and motion, in words."""

import numpy as np
from numpy.typing import NDArray

from estimation.feet.foot_force_record import USABLE
from estimation.feet.plate_faults import runs
from estimation.feet.plate_stances import BOTH, NONE, LoadedTime
from estimation.spatial import Array

#: A foot that stands beside the plates is one that misses this share of the body's weight.
MISSING_SHARE = 0.1
#: What lasts less than this, s, is not worth a sentence.
WORTH_SAYING_S = 0.1
#: A force this far outside of the sole it was given to is worth a sentence, m.
_AWAY_M = 0.1
#: Plates that bear more than needed by this share of the weight are worth a sentence.
_TOO_HEAVY = 0.05
#: Forces may enter this far from where the motion needs them, m: a model's mass is not a person's.
_MISPLACED_M = 0.05


def odd_loads(name: str, loads: list[LoadedTime]) -> list[str]:
    """Returns what is odd about the loads of one plate, in words."""
    findings = []
    long = [load for load in loads if load.end_s - load.start_s >= WORTH_SAYING_S]
    for load in long:
        when = f"plate {name} from {load.start_s:.2f} to {load.end_s:.2f} s: "
        if load.foot == NONE:
            findings.append(f"{when}loaded {load.distance_m:.2f} m away from either foot; left out")
        elif load.given and load.distance_m > _AWAY_M:
            foot = ("right", "left")[load.foot] if load.foot != BOTH else "feet"
            findings.append(
                f"{when}given to the {foot} by the caller, but loaded {load.distance_m:.2f} m away"
            )
    shared = [load for load in long if load.foot == BOTH]
    if shared:
        total = sum(load.end_s - load.start_s for load in shared)
        findings.append(
            f"plate {name} from {shared[0].start_s:.2f} to {shared[-1].end_s:.2f} s: both feet "
            f"stand on it for {total:.2f} s in all; how they share the load is a guess"
        )
    return findings


def missing_weight(time_s: Array, missing: Array, state: NDArray[np.intp]) -> list[str]:
    """Says where feet that are known all the same do not bear what the motion needs."""
    known = np.all(np.isin(state, USABLE), axis=0)
    findings = []
    usual = float(np.median(missing[known])) if np.any(known) else 0.0
    if usual < -_TOO_HEAVY:
        findings.append(
            f"plates: they bear {-100.0 * usual:.0f} % of the weight more than the motion needs, "
            "by the median: a load is carried, or the body mass is too low"
        )
    for start, end in runs(known & (missing > MISSING_SHARE)):
        if time_s[end - 1] - time_s[start] >= 2.0 * WORTH_SAYING_S:
            share = 100.0 * float(np.median(missing[start:end]))
            findings.append(
                f"from {time_s[start]:.2f} to {time_s[end - 1]:.2f} s the plates lack {share:.0f} "
                "% of the weight: a chair, a handrail, another support, a body mass that is too "
                "high, or a plate that is wrong"
            )
    return findings


def misplaced_plates(
    total: Array, needed: Array, weight_n: float, state: NDArray[np.intp]
) -> list[str]:
    """Says where all forces together enter far from where the motion needs them.

    Args:
        total: ``(frames, 6)`` of both feet, about the world's origin.
        needed: the same, by the motion.
        weight_n: of the person, N.
        state: ``(2, frames)``.
    """
    # Both forces have to be much alike: a load in the hands moves the point of entry, too.
    alike = np.abs(total[:, 2] - needed[:, 2]) < MISSING_SHARE * weight_n
    known = np.all(np.isin(state, USABLE), axis=0) & alike & (total[:, 2] > 0.5 * weight_n)
    if not np.any(known):
        return []
    enters, wanted = (
        np.stack([-w[known, 4], w[known, 3]], axis=1) / w[known, 2:3] for w in (total, needed)
    )
    off = np.median(enters - wanted, axis=0)
    if float(np.hypot(*off)) < _MISPLACED_M:
        return []
    return [
        f"plates: the forces enter ({off[0]:+.2f}, {off[1]:+.2f}) m (x, y) from where the motion "
        "needs them, by the median: plates and motion may not share one world, or segments weigh "
        "otherwise than the model's"
    ]
