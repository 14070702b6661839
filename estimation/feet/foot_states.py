"""What is known of each foot's wrench, frame by frame."""

import numpy as np
from numpy.typing import NDArray

from estimation.feet.foot_force_record import SIDES, FootState
from estimation.feet.foot_wrenches import FootSums
from estimation.feet.plate_faults import runs
from estimation.feet.plate_findings import MISSING_SHARE, WORTH_SAYING_S
from estimation.feet.plate_smoothing import uncovered
from estimation.feet.plate_stances import BOTH, NONE, LoadedTime, Standing
from estimation.spatial import Array
from human.marker_recording import PlateForces

Mask = NDArray[np.bool_]
States = NDArray[np.intp]

#: A sole less than this inside of the plates hangs over their edge.
_ON_PLATES = 0.85
#: A switch told by movement alone is off by this at most, s.
_SWITCH_S = 0.1
#: A sole of which less is over the plates can bear on the floor beside them.
_OVER_PLATES = 0.5
#: A foot that is down for so long before and after rests, s.
_REST_S = 0.2
#: Which state stays where two plates say different things, by `FootState`.
_BADNESS = np.array([0, 1, 4, 3, 2])


def foot_states(
    plates: PlateForces,
    standing: Standing,
    loads: list[LoadedTime],
    sums: FootSums,
    missing: Array,
    margin_s: float,
) -> tuple[States, list[str]]:
    """Says what is known of each foot at each frame, ``(2, frames)``, and what is not, in words.

    Args:
        plates: put right.
        standing: the feet.
        loads: what each plate bore when.
        sums: the wrenches under the feet.
        missing: ``(frames,)`` vertical force that the motion needs and no plate bears, in weights.
        margin_s: an unknown force reaches so far into the frames around it, by smoothing.
    """
    time, lacks = standing.time_s, missing > MISSING_SHARE
    state, findings = _on_plates(plates, standing, loads, lacks)
    beside = _beside(standing, state, lacks) | _resting_beside(plates, standing, state)
    beside |= uncovered(plates.time_s, time)[:, None] & standing.down
    for foot, side in enumerate(SIDES):
        for what, samples, words, least_s in (
            (FootState.SATURATED, sums.saturated, "a plate at its limit", 0.0),
            (FootState.UNMEASURED, sums.lost, "samples lost", 0.0),
            (FootState.UNMEASURED, None, "stands on no plate", WORTH_SAYING_S),
        ):
            bad = beside[:, foot] if samples is None else sums.at_frames(samples[:, foot], time)
            findings += [
                f"{side} foot from {time[start]:.2f} to {time[end - 1]:.2f} s: {words}; its force "
                "is not known"
                for start, end in runs(bad)
                if time[end - 1] - time[start] >= least_s
            ]
            state[foot, _widened(bad, time, margin_s)] = what
    return state, findings


def _on_plates(
    plates: PlateForces, standing: Standing, loads: list[LoadedTime], lacks: Mask
) -> tuple[States, list[str]]:
    """Returns the states of feet by the plates they were given; half a foot's is not known."""
    time, findings = standing.time_s, []
    state = np.full((2, len(time)), FootState.OFF_GROUND, dtype=np.intp)
    outlines = [plate.corners for plate in plates.plates if plate.corners is not None]
    partly = np.zeros((len(time), 2), dtype=np.bool_)
    if len(outlines) == len(plates.plates):
        partly = standing.soles.share_inside(outlines) < _ON_PLATES
    for load in loads:
        during = (time >= load.start_s) & (time <= load.end_s)
        for foot in {BOTH: (0, 1), NONE: ()}.get(load.foot, (load.foot,)):
            known = FootState.SHARED if load.foot == BOTH else FootState.MEASURED
            flat = during & standing.down[:, foot]
            edge = bool(np.any(flat)) and float(np.mean(partly[flat, foot])) > 0.5
            if edge and float(np.mean(lacks[flat])) > 0.5:
                known = FootState.UNMEASURED
                findings.append(
                    f"{SIDES[foot]} foot from {load.start_s:.2f} to {load.end_s:.2f} s: half on "
                    f"plate {plates.plates[load.plate].name}, half beside it; its force is not "
                    "known"
                )
            # What is worse stays: a foot half known is not known.
            worse = during & (_BADNESS[state[foot]] < _BADNESS[known])
            state[foot, worse] = known
    return state, findings


def _beside(standing: Standing, state: States, lacks: Mask) -> Mask:
    """Returns when a foot stands on no plate ``(frames, 2)``: it is down and weight is missing."""
    stands: Mask = np.asarray(state > FootState.OFF_GROUND).T
    # A foot half on a plate accounts for what is missing meanwhile.
    lacks = lacks & ~np.any(state == FootState.UNMEASURED, axis=0)
    beside: Mask = standing.down & ~stands & lacks[:, None]
    # The weight is missing until a foot is really off, and movement tells that less well.
    orphan = lacks & ~np.any(beside, axis=1)
    for foot in (0, 1):
        near = _widened(beside[:, foot], standing.time_s, _SWITCH_S)
        beside[:, foot] |= near & orphan & ~stands[:, foot]
    return beside


def _resting_beside(plates: PlateForces, standing: Standing, state: States) -> Mask:
    """Returns when a foot rests beside the plates ``(frames, 2)``, whatever weight is missing.

    A load in the hands hides what such a foot bears, and it may bear less than would be missed.
    """
    time = standing.time_s
    outlines = [plate.corners for plate in plates.plates if plate.corners is not None]
    rests: Mask = standing.down & (state == FootState.OFF_GROUND).T
    if len(outlines) == len(plates.plates):
        rests &= standing.soles.share_inside(outlines) < _OVER_PLATES
    for foot in (0, 1):
        # Movement tells a switch late: only what is far from one counts.
        rests[:, foot] &= ~_widened(~standing.down[:, foot], time, _REST_S)
    return rests


def _widened(mask: Mask, time_s: Array, margin_s: float) -> Mask:
    """Returns a mask that holds ``margin_s`` longer on both sides."""
    out = mask.copy()
    for start, end in runs(mask):
        out |= (time_s >= time_s[start] - margin_s) & (time_s <= time_s[end - 1] + margin_s)
    return out
