"""Force plates to feet: which foot each plate carries, and its wrench at the motion's frames.

Plates know nothing of feet, have their own clock and rate, and err in known ways. What can be put
right is, and said; where a foot's wrench is not known its state says so, frame by frame, and the
rest stays usable.
"""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from estimation.errors import MeasurementError
from estimation.feet.foot_contacts import contacts_of_motion
from estimation.feet.foot_force_record import (
    USABLE,
    FootForce,
    FootForces,
    FootState,
    PlateStance,
    PlateZero,
)
from estimation.feet.foot_states import foot_states
from estimation.feet.foot_wrenches import sums_of_feet
from estimation.feet.plate_faults import lost, mended_units, saturated, tared
from estimation.feet.plate_findings import misplaced_plates, missing_weight, odd_loads
from estimation.feet.plate_smoothing import resampled, smoothing_width_s
from estimation.feet.plate_spikes import without_spikes
from estimation.feet.plate_stances import Standing, loaded_times, stood_on
from estimation.feet.required_wrench import required_wrench
from estimation.feet.soles import soles_of
from estimation.feet.swapped_plates import distances_m, put_back
from estimation.spatial import GRAVITY_MS2
from human import HumanModel, Motion
from human.marker_recording import PlateForces

__all__ = [
    "USABLE",
    "FootForce",
    "FootForces",
    "FootState",
    "PlateStance",
    "PlateZero",
    "feet_from_plates",
]

Mask = NDArray[np.bool_]

#: Standard deviations of a wrench of which nothing is known, N and N m.
_UNKNOWN_N, _UNKNOWN_NM = 1e3, 3e2


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
    zeros: Mapping[str, PlateZero] = MappingProxyType({}),
) -> FootForces:
    """Finds what the ground does to each foot.

    Args:
        model: the person, of the right size and mass.
        motion: what they do, with accelerations.
        plates: as read; they may run longer than the motion.
        clock_offset_s: seconds to add to the plates' times; `clocks.align` finds it.
        assign: plate name to ``right``, ``left`` or ``both``, where the caller knows better.
        window_s: full width of the window that the motion's accelerations were derived with, s;
            forces are smoothed to match. Zero where accelerations were measured; None takes what
            the motion's provenance says.
        force_sd_n: noise of each component of a plate's force, N.
        moment_sd_nm: noise of each component of its moment about its own origin, N m.
        zeros: of the plates, from the stretch before this one.

    Raises:
        MeasurementError: no plates, plates and motion that share no time, or an assignment to a
            plate or foot that is not there.
        human.UnknownNameError: the model lacks a foot.

    Derived here: a force enters where its moment about the horizontal vanishes
    (`human.marker_recording.PlateForces.centres_of_pressure`); `estimation.feet.plate_stances` says
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
    weight = GRAVITY_MS2 * model.total_mass_kg
    plates, bad, assumed, findings, last = _put_right(plates, standing, weight, zeros)
    loads = loaded_times(plates, standing, assign)
    sums = sums_of_feet(plates, standing, loads, bad)

    width = smoothing_width_s(motion, window_s)
    wrench = np.stack(
        [resampled(plates.time_s, sums.wrench[:, foot], motion.time_s, width) for foot in (0, 1)]
    )
    needed = required_wrench(model, motion)
    missing = needed[:, 2] - wrench[..., 2].sum(axis=0)
    state, words = foot_states(plates, standing, loads, sums, missing / weight, 0.25 * width)
    findings += words
    for k, plate in enumerate(plates.plates):
        findings += odd_loads(plate.name, [load for load in loads if load.plate == k])
    findings += missing_weight(motion.time_s, missing / weight, state)
    findings += misplaced_plates(wrench.sum(axis=0), needed, weight, state)
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
        zeros=last,
    )


def _put_right(
    plates: PlateForces, standing: Standing, weight_n: float, earlier: Mapping[str, PlateZero]
) -> tuple[PlateForces, list[Mask], list[str], list[str], dict[str, PlateZero]]:
    """Mends units, signs, spikes, zeros and exchanged plates.

    Returns:
        The plates; where they are at their limit and where samples were lost, ``(samples, plates)``
        each; what was assumed; what does not fit; the last zeros.
    """

    def from_feet(plates: PlateForces) -> float:
        distances = distances_m(plates, standing)
        known = distances[np.isfinite(distances)]
        return float(np.median(known)) if len(known) else np.inf

    plates, assumed, findings = mended_units(plates, weight_n, from_feet)
    plates, torn, spikes = without_spikes(plates, weight_n)
    # Before zeros are taken off: afterwards a limit is no longer flat.
    bad = [saturated(plates), lost(plates) | torn]
    frame = np.clip(np.searchsorted(standing.time_s, plates.time_s), 0, len(standing.time_s) - 1)
    over = np.stack(
        [np.any(stood_on(plates, k, standing)[frame], axis=1) for k in range(len(plates.plates))],
        axis=1,
    )
    plates, zeros, unchecked, last = tared(plates, weight_n, over, earlier)
    plates, channels, exchanged = put_back(plates, standing)
    bad = [mask[:, channels] for mask in bad]
    return plates, bad, [*assumed, *zeros, *exchanged, *unchecked], [*findings, *spikes], last
