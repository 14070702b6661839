"""What force plates do wrong: a zero that is none, a limit reached, another unit, another sign.

Each function takes plates as read and says in words what it found or mended.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from estimation.feet.foot_force_record import PlateZero
from estimation.spatial import Array
from human.marker_recording import PlateForces

Mask = NDArray[np.bool_]

#: A foot is on a plate from the first force on, N, and leaves it below the second one.
ENTER_N, LEAVE_N = 20.0, 5.0
#: An unloaded plate that reads less than this is at zero, N and N m.
_ZERO_N, _ZERO_NM = 3.0, 3.0
#: An unloaded plate reads less than this share of the body's weight; for so long at least, s.
_UNLOADED_SHARE, _UNLOADED_S = 0.08, 0.1
#: Plates that are stood on bear this share of the body's weight, from and to.
_LIKELY = (0.7, 1.4)
#: From one sample to the next a person's force changes by less than this share.
_STEADY = 0.2
#: Forces this far from any foot are somewhere else; those so near are under one, m.
_FAR_M, _UNDER_M = 2.0, 0.3
#: Friction under a sole turns by less than the force at this lever, m.
_FREE_LEVER_M = 0.3
#: A foot that rests on a plate without bearing for longer than this, s, still stands on it.
_IDLE_S = 0.2
#: Kept away from both ends of an unloaded time: a foot comes and goes gently, s.
_MARGIN_S = 0.05
#: A limit counts where the force would have gone on by this share of it.
_OVERSHOOT = 0.01
#: Samples repeated for less than this, s, are a coarser clock or do no harm.
_LOST_S = 0.02
#: A signal is at a limit if it is there so many times as often as on any of the levels below.
_PILE, _LEVELS = 20, 5
#: Samples that must stand still to be suspected, and how still, relative to the largest.
_STUCK, _STILL = 4, 1e-7


def runs(mask: Mask) -> list[tuple[int, int]]:
    """Returns the runs of True in ``(time,)`` booleans, as (first, past the last)."""
    edge = np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))
    return list(
        zip(np.flatnonzero(edge > 0).tolist(), np.flatnonzero(edge < 0).tolist(), strict=True)
    )


def loaded_runs(time_s: Array, vertical_n: Array, occupied: Mask) -> list[tuple[int, int]]:
    """Returns the runs in which a plate is stood on and bears something, with hysteresis.

    Args:
        time_s: ``(samples,)`` s.
        vertical_n: ``(samples,)`` N, positive upwards on the person.
        occupied: ``(samples,)`` where a foot rests on it by its movement: it may bear next to
            nothing for a while.
    """
    out = []
    for start, end in runs((vertical_n > LEAVE_N) | occupied):
        loads = [
            (start + low, start + high)
            for low, high in runs(vertical_n[start:end] > LEAVE_N)
            if np.max(vertical_n[start + low : start + high]) > ENTER_N
        ]
        if not loads:
            continue
        # Movement tells a switch worse than force does: a little idleness at an end is none.
        first, last = loads[0][0], loads[-1][1]
        idle = time_s[[first, end - 1]] - time_s[[start, last - 1]] > _IDLE_S
        out.append((start if idle[0] else first, end if idle[1] else last))
    return out


def mended_units(
    plates: PlateForces, weight_n: float, distance_m: Callable[[PlateForces], float]
) -> tuple[PlateForces, list[str], list[str]]:
    """Puts right forces that push down, and units that only one reading explains.

    Args:
        plates: as read.
        weight_n: of the person, N.
        distance_m: how far the forces of some plates enter from the nearest foot, m; infinite
            where nothing is loaded.

    Returns:
        The plates, what was assumed, and what does not fit but was left.
    """
    total = np.abs(plates.force[..., 2]).sum(axis=1)
    most = float(np.percentile(total, 95))
    usual = float(np.median(total[total > 0.5 * most])) if most > 0.0 else 0.0
    # Noise jumps by its own size from one sample to the next, a person does not.
    steady = len(total) > 1 and float(np.median(np.abs(np.diff(total)))) < _STEADY * usual
    readings = [
        (worth, f"{unit}; forces and moments multiplied by {worth:.4g}")
        for unit, worth in (("kN", 1e3), ("multiples of body weight", weight_n))
        if steady and _LIKELY[0] < usual * worth / weight_n < _LIKELY[1]
    ]
    for worth, words in [*readings, (1.0, "")]:
        scaled = replace(plates, force=worth * plates.force, moment=worth * plates.moment)
        out, turned = _upright(scaled, weight_n)
        out, away, converted = _moments_in_newton_metres(out, distance_m)
        # A small zero may look like a weight in another unit, but not under a foot.
        if not words or not np.isfinite(away) or away < _UNDER_M:
            break
    assumed = [*turned, *converted]
    if words:
        assumed.insert(
            0,
            f"plates: they bear {usual:.3g} while stood on, a weight of {weight_n:.0f} N needs "
            + words,
        )
    findings, usual = [], usual * worth
    if usual < _UNLOADED_SHARE * weight_n:
        findings.append(
            f"plates: they bear next to nothing ({usual:.3g} N), the person weighs {weight_n:.0f} "
            "N: nobody stands on them, or the unit is not N"
        )
    elif not _LIKELY[0] < usual / weight_n < _LIKELY[1]:
        findings.append(
            f"plates: they bear {usual:.4g} N while stood on, the person weighs {weight_n:.0f} N: "
            "much of the weight is elsewhere (a chair, a handrail, the floor), or a load is "
            "carried, or the unit is not N"
        )
    _, turning, bears = out.centres_of_pressure(_LIKELY[0] * weight_n)
    lever = float(np.median(np.abs(turning[bears]))) / weight_n if np.any(bears) else 0.0
    if lever > _FREE_LEVER_M:
        findings.append(
            f"plates: they turn a foot about the vertical by {lever * weight_n:.0f} N m, which no "
            "sole can hold; their moments have another unit than their forces, and no torque of "
            "this recording is to be believed"
        )
    if np.isfinite(away) and away > _FAR_M:
        findings.append(
            f"plates: the forces enter {away:.2f} m from the nearest foot; plates and motion do "
            "not share one world, or the moments have another unit"
        )
    return out, assumed, findings


def _upright(plates: PlateForces, weight_n: float) -> tuple[PlateForces, list[str]]:
    """Turns the plates round that say what the foot does to them."""
    force, moment, assumed = plates.force.copy(), plates.moment.copy(), []
    for k, plate in enumerate(plates.plates):
        vertical = force[:, k, 2]
        most = float(np.percentile(np.abs(vertical), 99))
        stood = np.abs(vertical) > 0.5 * most
        if most > _UNLOADED_SHARE * weight_n and float(np.median(vertical[stood])) < 0.0:
            force[:, k] *= -1.0
            moment[:, k] *= -1.0
            assumed.append(
                f"plate {plate.name}: its force points down, what the foot does to the plate; "
                "turned round"
            )
    return replace(plates, force=force, moment=moment), assumed


def _moments_in_newton_metres(
    plates: PlateForces, distance_m: Callable[[PlateForces], float]
) -> tuple[PlateForces, float, list[str]]:
    """Converts moments that put the forces under the feet in another unit only.

    Returns:
        The plates, how far from the feet their forces enter (m), and what was assumed.
    """
    away = distance_m(plates)
    if np.isfinite(away) and away > _FAR_M:
        for words, factor in (("moments in N mm", 1e-3), ("moments in kN m", 1e3)):
            other = replace(plates, moment=plates.moment * factor)
            if (near := distance_m(other)) < _UNDER_M:
                said = (
                    f"plates: the forces enter {away:.0f} m from the feet as read, but under them "
                    f"with {words}; converted"
                )
                return other, near, [said]
    return plates, away, []


def tared(
    plates: PlateForces,
    weight_n: float,
    stood_on: Mask,
    earlier: Mapping[str, PlateZero] = MappingProxyType({}),
) -> tuple[PlateForces, list[str], list[str], dict[str, PlateZero]]:
    """Takes off what plates read while nobody stands on them.

    The zero is followed from one unloaded time to the next, along straight lines.

    Args:
        plates: in N.
        weight_n: of the person, N.
        stood_on: ``(samples, plates)`` where a foot is over the plate.
        earlier: plate name to the last zero seen before these samples.

    Returns:
        The plates, what was taken off, which plates could not be checked, and the last zeros.
    """
    time, assumed, findings, last = plates.time_s, [], [], dict(earlier)
    force, moment = plates.force.copy(), plates.moment.copy()
    for k, plate in enumerate(plates.plates):
        low = (np.abs(force[:, k, 2]) < _UNLOADED_SHARE * weight_n) & ~stood_on[:, k]
        quiet = [
            part
            for start, end in runs(low)
            if len(part := _inner(time, start, end)) and np.ptp(time[part]) >= _UNLOADED_S
        ]
        known = [last[plate.name]] if plate.name in last else []
        if not quiet and not known:
            findings.append(f"plate {plate.name}: never unloaded, so its zero cannot be checked")
            continue
        channels = np.concatenate([force[:, k], moment[:, k]], axis=1)
        found = [
            PlateZero(float(np.mean(time[part])), np.median(channels[part], axis=0))
            for part in quiet
        ]
        found = [zero for zero in known if not found or zero.time_s < found[0].time_s] + found
        last[plate.name] = found[-1]
        middle = np.array([zero.time_s for zero in found])
        zero = np.array([zero.reading for zero in found])
        worst = np.abs(zero).max(axis=0)
        if np.all(worst[:3] < _ZERO_N) and np.all(worst[3:] < _ZERO_NM):
            continue
        drift = np.stack([np.interp(time, middle, zero[:, c]) for c in range(6)], axis=1)
        force[:, k] -= drift[:, :3]
        moment[:, k] -= drift[:, 3:]
        low_z, high_z = zero[:, 2].min(), zero[:, 2].max()
        drifts = f", drifting to {high_z:.1f} N" if high_z - low_z > _ZERO_N else ""
        assumed.append(
            f"plate {plate.name}: unloaded it reads {low_z:.1f} N upwards{drifts} and "
            f"{np.max(worst[3:]):.1f} N m at most; taken off"
        )
    return replace(plates, force=force, moment=moment), assumed, findings, last


def saturated(plates: PlateForces) -> Mask:
    """Returns where a channel stands at its limit ``(samples, plates)``.

    Derived here: a peak that was cut off is the extreme of its channel, stands still for some
    samples, and is entered and left at full slope; a true peak or a quiet stance has none. Whoever
    stands quietly on a plate at its limit is told by noise: the other channels have it, while this
    one has the same extreme over and over and hardly a value just below.
    """
    out = np.zeros(plates.force.shape[:2], dtype=np.bool_)
    channels = np.concatenate([plates.force, plates.moment], axis=2)
    for k in range(channels.shape[1]):
        for c in range(6):
            signal = channels[:, k, c]
            most = float(np.max(np.abs(signal)))
            if most <= ENTER_N:
                continue
            stuck = np.abs(signal) >= most * (1.0 - _STILL)
            if _piled_up(np.abs(signal), stuck, np.delete(channels[:, k], c, axis=1)) or any(
                end - start >= _STUCK and _cut_off(np.abs(signal), start, end, most)
                for start, end in runs(stuck)
            ):
                # Noise lets a signal at its limit look away for a moment.
                for start, end in runs(~stuck):
                    stuck[start:end] |= end - start < _STUCK and 0 < start and end < len(stuck)
                out[:, k] |= stuck
    return out


def lost(plates: PlateForces) -> Mask:
    """Returns where a loaded plate repeats one sample in all its channels ``(samples, plates)``."""
    channels = np.concatenate([plates.force, plates.moment], axis=2)
    same = np.zeros(plates.force.shape[:2], dtype=np.bool_)
    same[1:] = np.all(channels[1:] == channels[:-1], axis=2) & (plates.force[1:, :, 2] > ENTER_N)
    out = np.zeros_like(same)
    for k in range(len(plates.plates)):
        # What never changes is a made-up constant, not a radio that fails.
        for start, end in runs(same[:, k]):
            jumps = end < len(same) and not np.allclose(
                channels[end, k], channels[start, k], rtol=1e-3
            )
            long = plates.time_s[end - 1] - plates.time_s[start - 1] >= _LOST_S
            if end - start >= _STUCK and long and jumps:
                out[start:end, k] = True
    return out


def _piled_up(size: Array, stuck: Mask, others: Array) -> bool:
    """Whether a signal is at its extreme far more often than just below, while others go on."""
    at = np.flatnonzero(stuck)
    if len(at) < _PILE:
        return False
    _, counts = np.unique(size[~stuck], return_counts=True)
    # Coarse steps pile up, too, but on all their levels.
    if len(counts) < _LEVELS or len(at) < _PILE * np.max(counts[-_LEVELS:]):
        return False
    follows = at[1:][np.diff(at) == 1]
    moved = np.abs(others[follows] - others[follows - 1]) > _STILL * np.max(np.abs(others))
    return bool(len(follows)) and bool(np.all(np.any(moved, axis=1)))


def _cut_off(size: Array, start: int, end: int, most: float) -> bool:
    """Whether the signal would have gone on beyond a plateau, by its slope on either side."""
    # Over a quarter of the plateau's length: one step of a coarse converter is no slope.
    reach, slopes = max((end - start) // 4, 1), []
    if start > reach:
        slopes.append((size[start - 1] - size[start - 1 - reach]) / reach)
    if end + reach < len(size):
        slopes.append((size[end] - size[end + reach]) / reach)
    return bool(slopes) and 0.25 * (end - start) * min(slopes) > _OVERSHOOT * most


def _inner(time_s: Array, start: int, end: int) -> NDArray[np.intp]:
    """Returns the samples of a run without its margins, but where it begins or ends the file."""
    low = time_s[start] + (_MARGIN_S if start else 0.0)
    high = time_s[end - 1] - (_MARGIN_S if end < len(time_s) else 0.0)
    inside = np.arange(start, end)
    return np.asarray(inside[(time_s[start:end] >= low) & (time_s[start:end] <= high)])
