"""Force plates to feet: which foot each plate carries, and its wrench at the motion's frames.

Plates know nothing of feet, have their own clock and rate, and err in known ways. What can be put
right is, and said; where a foot's wrench is not known its state says so, frame by frame, and the
rest stays usable.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.errors import MeasurementError
from estimation.foot_contacts import contacts_of_motion
from estimation.foot_force_record import (
    USABLE,
    FootForce,
    FootForces,
    FootState,
    PlateStance,
)
from estimation.foot_wrenches import FootSums, sums_of_feet
from estimation.plate_faults import lost, mended_units, runs, saturated, tared
from estimation.plate_smoothing import resampled, smoothing_width_s, uncovered
from estimation.plate_stances import BOTH, NONE, LoadedTime, Standing, loaded_times, stood_on
from estimation.required_wrench import required_wrench
from estimation.soles import soles_of
from estimation.spatial import Array
from estimation.swapped_plates import distances_m, put_back
from human import HumanModel, Motion
from human.marker_recording import PlateForces

__all__ = [
    "USABLE",
    "FootForce",
    "FootForces",
    "FootState",
    "PlateStance",
    "feet_from_plates",
]

Mask = NDArray[np.bool_]

#: A foot that stands beside the plates is one that misses this share of the body's weight.
_MISSING_SHARE = 0.1
#: A force this far outside of the sole it was given to is worth a sentence, m.
_AWAY_M = 0.1
#: Plates that bear more than needed by this share of the weight are worth a sentence.
_TOO_HEAVY = 0.05
#: Forces may enter this far from where the motion needs them, m: a model's mass is not a person's.
_MISPLACED_M = 0.05
#: A sole less than this inside of the plates hangs over their edge.
_ON_PLATES = 0.85
#: Standard deviations of a wrench of which nothing is known, N and N m.
_UNKNOWN_N, _UNKNOWN_NM = 1e3, 3e2
#: A switch told by movement alone is off by this at most, s.
_SWITCH_S = 0.1
#: Which state stays where two plates say different things, by `FootState`.
_BADNESS = np.array([0, 1, 4, 3, 2])
#: What lasts less than this, s, is not worth a sentence.
_WORTH_SAYING_S = 0.1


def feet_from_plates(
    model: HumanModel,
    motion: Motion,
    plates: PlateForces,
    *,
    clock_offset_s: float = 0.0,
    assign: Mapping[str, str] | None = None,
    window_s: float | None = None,
    force_sd_n: float = 2.0,
    moment_sd_nm: float = 1.0,
) -> FootForces:
    """Finds what the ground does to each foot.

    Args:
        model: the person, of the right size and mass.
        motion: what they do, with accelerations.
        plates: as read; they may run longer than the motion.
        clock_offset_s: seconds to add to the plates' times; `estimation.clocks.align` finds it.
        assign: plate name to ``right``, ``left`` or ``both``, where the caller knows better.
        window_s: full width of the window that the motion's accelerations were derived with, s;
            forces are smoothed to match. Zero where accelerations were measured; None takes what
            the motion's provenance says.
        force_sd_n: noise of each component of a plate's force, N.
        moment_sd_nm: noise of each component of its moment about its own origin, N m.

    Raises:
        MeasurementError: no plates, plates and motion that share no time, or an assignment to a
            plate or foot that is not there.
        human.UnknownNameError: the model lacks a foot.

    Derived here: a force enters where its moment about the horizontal vanishes
    (`human.marker_recording.PlateForces.centres_of_pressure`); `estimation.plate_stances` says
    whose foot that is under.
    """
    if not plates.plates or not len(plates.time_s):
        raise MeasurementError("plates: expected at least one with samples, got none")
    plates = replace(plates, time_s=plates.time_s + clock_offset_s)
    if plates.time_s[0] > motion.time_s[-1] or plates.time_s[-1] < motion.time_s[0]:
        raise MeasurementError(
            f"plates: they run from {plates.time_s[0]:.2f} to {plates.time_s[-1]:.2f} s, the "
            f"motion from {motion.time_s[0]:.2f} to {motion.time_s[-1]:.2f} s; give clock_offset_s"
        )
    contacts = contacts_of_motion(model, motion, meaning="load")
    standing = Standing(motion.time_s, soles_of(model, motion.q), contacts.feet, contacts.floor_m)
    weight = 9.81 * model.total_mass_kg
    plates, bad, assumed, findings = _put_right(plates, standing, weight)
    loads = loaded_times(plates, standing, assign)
    sums = sums_of_feet(plates, standing, loads, bad)

    width = smoothing_width_s(motion, window_s)
    wrench = np.stack(
        [resampled(plates.time_s, sums.wrench[:, foot], motion.time_s, width) for foot in (0, 1)]
    )
    needed = required_wrench(model, motion)
    missing = needed[:, 2] - wrench[..., 2].sum(axis=0)
    state, words = _states(plates, standing, loads, sums, missing / weight, 0.25 * width)
    findings += words
    for k, plate in enumerate(plates.plates):
        findings += _said_of(plate.name, [load for load in loads if load.plate == k])
    findings += _unexplained(motion.time_s, missing / weight, state)
    findings += _misplaced(wrench.sum(axis=0), needed, weight, state)
    unknown = np.isin(state, (FootState.UNMEASURED, FootState.SATURATED))
    wrench[state == FootState.UNMEASURED] = 0.0
    variance = np.where(
        unknown[..., None],
        np.repeat([_UNKNOWN_N**2, _UNKNOWN_NM**2], 3),
        np.repeat([force_sd_n**2, moment_sd_nm**2], 3),
    )
    point = np.where(
        unknown[..., None], np.moveaxis(standing.soles.center, 1, 0), sums.point(motion.time_s)
    )
    right, left = (FootForce(wrench[k], state[k], point[k], variance[k]) for k in (0, 1))
    stances = tuple(load.record(plates) for load in loads)
    if width:
        assumed.append(
            f"plates: smoothed over {width:.3g} s, as the motion's derived accelerations are"
        )
    return FootForces(
        time_s=motion.time_s,
        right=right,
        left=left,
        missing_n=missing,
        stances=stances,
        clock_offset_s=clock_offset_s,
        assumed=tuple(assumed),
        findings=tuple(findings),
    )


def _put_right(
    plates: PlateForces, standing: Standing, weight_n: float
) -> tuple[PlateForces, list[Mask], list[str], list[str]]:
    """Mends units, signs, zeros and exchanged plates.

    Returns:
        The plates; where they are at their limit and where samples were lost, ``(samples, plates)``
        each; what was assumed; what does not fit.
    """

    def from_feet(plates: PlateForces) -> float:
        distances = distances_m(plates, standing)
        known = distances[np.isfinite(distances)]
        return float(np.median(known)) if len(known) else np.inf

    plates, assumed, findings = mended_units(plates, weight_n, from_feet)
    # Before zeros are taken off: afterwards a limit is no longer flat.
    bad = [saturated(plates), lost(plates)]
    frame = np.clip(np.searchsorted(standing.time_s, plates.time_s), 0, len(standing.time_s) - 1)
    over = np.stack(
        [np.any(stood_on(plates, k, standing)[frame], axis=1) for k in range(len(plates.plates))],
        axis=1,
    )
    plates, zeros, unchecked = tared(plates, weight_n, over)
    plates, channels, exchanged = put_back(plates, standing)
    bad = [mask[:, channels] for mask in bad]
    return plates, bad, [*assumed, *zeros, *exchanged, *unchecked], findings


def _states(
    plates: PlateForces,
    standing: Standing,
    loads: list[LoadedTime],
    sums: FootSums,
    missing: Array,
    margin_s: float,
) -> tuple[NDArray[np.intp], list[str]]:
    """Says what is known of each foot at each frame, ``(2, frames)``, and what is not, in words.

    Args:
        plates: put right.
        standing: the feet.
        loads: what each plate bore when.
        sums: the wrenches under the feet.
        missing: ``(frames,)`` vertical force that the motion needs and no plate bears, in weights.
        margin_s: an unknown force reaches so far into the frames around it, by smoothing.
    """
    time, findings = standing.time_s, []
    state = np.full((2, len(time)), FootState.OFF_GROUND, dtype=np.intp)
    outlines = [plate.corners for plate in plates.plates if plate.corners is not None]
    partly = (
        standing.soles.share_inside(outlines) < _ON_PLATES
        if len(outlines) == len(plates.plates)
        else np.zeros((len(time), 2), dtype=np.bool_)
    )
    lacks = missing > _MISSING_SHARE
    for load in loads:
        during = (time >= load.start_s) & (time <= load.end_s)
        feet = {BOTH: (0, 1), NONE: ()}.get(load.foot, (load.foot,))
        for foot in feet:
            name = plates.plates[load.plate].name
            known = FootState.SHARED if load.foot == BOTH else FootState.MEASURED
            flat = during & standing.down[:, foot]
            edge = bool(np.any(flat)) and float(np.mean(partly[flat, foot])) > 0.5
            if edge and float(np.mean(lacks[flat])) > 0.5:
                known = FootState.UNMEASURED
                findings.append(
                    f"{('right', 'left')[foot]} foot from {load.start_s:.2f} to {load.end_s:.2f} s:"
                    f" half on plate {name}, half beside it; its force is not known"
                )
            # What is worse stays: a foot half known is not known.
            worse = during & (_BADNESS[state[foot]] < _BADNESS[known])
            state[foot, worse] = known
    frames_of = {FootState.SATURATED: sums.saturated, FootState.UNMEASURED: sums.lost}
    words = {FootState.SATURATED: "a plate at its limit", FootState.UNMEASURED: "samples lost"}
    stands: Mask = np.asarray(state > FootState.OFF_GROUND).T
    # A foot half on a plate accounts for what is missing meanwhile.
    lacks = lacks & ~np.any(state == FootState.UNMEASURED, axis=0)
    off_plates = standing.down & ~stands & lacks[:, None]
    # The weight is missing until a foot is really off, and movement tells that less well.
    orphan = lacks & ~np.any(off_plates, axis=1)
    gap = uncovered(plates.time_s, time)
    for foot, side in enumerate(("right", "left")):
        beside = off_plates[:, foot]
        beside |= _widened(beside, time, _SWITCH_S) & orphan & ~stands[:, foot]
        beside |= gap & standing.down[:, foot]
        for what, samples in frames_of.items():
            bad = sums.at_frames(samples[:, foot], time)
            for start, end in runs(bad):
                findings.append(
                    f"{side} foot from {time[start]:.2f} to {time[end - 1]:.2f} s: {words[what]}; "
                    "its force is not known"
                )
            state[foot, _widened(bad, time, margin_s)] = what
        for start, end in runs(beside):
            if time[end - 1] - time[start] >= _WORTH_SAYING_S:
                findings.append(
                    f"{side} foot from {time[start]:.2f} to {time[end - 1]:.2f} s: stands on no "
                    "plate; its force is not known"
                )
        state[foot, _widened(beside, time, margin_s)] = FootState.UNMEASURED
    return state, findings


def _widened(mask: Mask, time_s: Array, margin_s: float) -> Mask:
    """Returns a mask that holds ``margin_s`` longer on both sides."""
    out = mask.copy()
    for start, end in runs(mask):
        out |= (time_s >= time_s[start] - margin_s) & (time_s <= time_s[end - 1] + margin_s)
    return out


def _said_of(name: str, loads: list[LoadedTime]) -> list[str]:
    """Returns what is odd about the loads of one plate, in words."""
    findings = []
    long = [load for load in loads if load.end_s - load.start_s >= _WORTH_SAYING_S]
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


def _unexplained(time_s: Array, missing: Array, state: NDArray[np.intp]) -> list[str]:
    """Says where feet that are known all the same do not bear what the motion needs."""
    known = np.all(np.isin(state, USABLE), axis=0)
    findings = []
    usual = float(np.median(missing[known])) if np.any(known) else 0.0
    if usual < -_TOO_HEAVY:
        findings.append(
            f"plates: they bear {-100.0 * usual:.0f} % of the weight more than the motion needs, "
            "by the median: a load is carried, or the body mass is too low"
        )
    for start, end in runs(known & (missing > _MISSING_SHARE)):
        if time_s[end - 1] - time_s[start] >= 2.0 * _WORTH_SAYING_S:
            share = 100.0 * float(np.median(missing[start:end]))
            findings.append(
                f"from {time_s[start]:.2f} to {time_s[end - 1]:.2f} s the plates lack {share:.0f} "
                "% of the weight: a chair, a handrail, another support, or a plate that is wrong"
            )
    return findings


def _misplaced(total: Array, needed: Array, weight_n: float, state: NDArray[np.intp]) -> list[str]:
    """Says where all forces together enter far from where the motion needs them.

    Args:
        total: ``(frames, 6)`` of both feet, about the world's origin.
        needed: the same, by the motion.
        weight_n: of the person, N.
        state: ``(2, frames)``.
    """
    # Both forces have to be much alike: a load in the hands moves the point of entry, too.
    alike = np.abs(total[:, 2] - needed[:, 2]) < _MISSING_SHARE * weight_n
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
