"""Gives a take's plates to the feet, window by window, and keeps what was said on the way."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from app.estimates.schemas import EstimateOptions
from app.fitting import BodyInMotion, joined
from app.problems import InvalidRequest
from estimation import FootForces, PlateStance, PlateZero, align, feet_from_plates
from human import Motion
from human.marker_recording import PlateForces

#: So much of the motion on both sides is looked at with a window, so that stances are seen whole.
_MARGIN_S = 5.0
#: Longest stretch worked on at once to take in a tare that comes late.
_LONGEST_FIRST_S = 600.0
#: Offsets of two parts of a recording differ by so many standard deviations and seconds at least.
_SURE, _CLOCK_S = 4.0, 0.02


@dataclass(eq=False)
class FeetOfTake:
    """The wrenches under the feet along a motion; what was found is complete at the end.

    Attributes:
        body: The person and the motion.
        options: Clock and assignment, where they were given.
        clock: What was added to the plates' times, how sure that is, and where it came from.
        stances: Which plate was under which foot, and when.
        assumed: What was assumed, each once.
        findings: What does not fit, each once.
    """

    body: BodyInMotion
    options: EstimateOptions
    clock: Mapping[str, Any] | None = None
    stances: list[PlateStance] = field(default_factory=list)
    assumed: list[str] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)
    _clock_open: bool = False
    _clock_sd: float | None = None

    def windows(self) -> Iterator[tuple[Motion, FootForces | None]]:
        """Yields the motion's windows, each with the wrenches under the feet, None without plates.

        Raises:
            InvalidRequest: The tare comes too late.
            EstimationError: Plates and motion do not fit each other at all.
        """
        motions = _first_with_tare(self.body.windows(), self.options.tare_s)
        plates = self.body.plates
        if plates is None:
            for motion in motions:
                yield motion, None
            return
        before: Motion | None = None
        zeros: Mapping[str, PlateZero] = {}
        now, offset = next(motions, None), 0.0
        if now is not None:
            offset = self._clock_offset(now, plates)
        while now is not None:
            after = next(motions, None)
            parts = [
                None if before is None else _between(before, now.time_s[0] - _MARGIN_S, np.inf),
                now,
                None if after is None else _between(after, -np.inf, now.time_s[-1] + _MARGIN_S),
            ]
            wide = joined([part for part in parts if part is not None])
            start, end = wide.time_s[0] - offset - 1.0, wide.time_s[-1] - offset + 1.0
            forces = feet_from_plates(
                self.body.model,
                wide,
                _of_time(plates, float(start), float(end)),
                clock_offset_s=offset,
                assign=self.options.assign or None,
                zeros=zeros,
            )
            zeros = forces.zeros
            self._remember(forces, float(now.time_s[0]), float(now.time_s[-1]))
            if before is not None:
                self._doubt_clock(now, plates, offset)
            inside = (wide.time_s >= now.time_s[0]) & (wide.time_s <= now.time_s[-1])
            yield now, forces.select(inside)
            before, now = now, after

    def record(self) -> dict[str, Any] | None:
        """Returns what is known of plates and feet, ready for JSON; None without plates."""
        if self.body.plates is None:
            return None
        return {
            "plates_from": self.body.plates_from,
            "clock": self.clock,
            "stances": [
                {
                    "plate": one.plate,
                    "foot": one.foot,
                    "start_s": round(one.start_s, 3),
                    "end_s": round(one.end_s, 3),
                    "given": one.given,
                }
                for one in sorted(self.stances, key=lambda one: (one.start_s, one.plate))
            ],
        }

    def _clock_offset(self, motion: Motion, plates: PlateForces) -> float:
        given = self.options.clock_offset_s
        if given is not None:
            self.clock = {"offset_s": given, "sd_s": None, "from": "given"}
            return given
        if self.body.plates_from == self.body.source:
            self.clock = {"offset_s": 0.0, "sd_s": None, "from": "one file, one clock"}
            return 0.0
        part = _of_time(plates, float(motion.time_s[0]) - 1.0, float(motion.time_s[-1]) + 1.0)
        found = align(self.body.model, motion, part)
        self._clock_open, self._clock_sd = True, found.sd_s
        self.clock = {
            "offset_s": round(found.offset_s, 4),
            "sd_s": None if found.sd_s is None else round(found.sd_s, 4),
            "from": found.words,
        }
        return found.offset_s

    def _doubt_clock(self, motion: Motion, plates: PlateForces, offset_s: float) -> None:
        """Says so where a later part of the recording asks for another offset than the first."""
        if not self._clock_open:
            return
        start, end = float(motion.time_s[0]), float(motion.time_s[-1])
        part = _of_time(plates, start - offset_s - 1.0, end - offset_s + 1.0)
        found = align(self.body.model, motion, part)
        if found.estimated_s is None or found.sd_s is None:
            return
        self._clock_sd = self._clock_sd or found.sd_s
        sd = float(np.hypot(self._clock_sd, found.sd_s))
        if abs(found.estimated_s - offset_s) > max(_SURE * sd, _CLOCK_S):
            self._clock_open = False
            self.findings.append(
                f"plates' clock from {start:.1f} to {end:.1f} s: {found.estimated_s:+.3f} s fits "
                f"best (sd {found.sd_s:.3f} s), {offset_s:+.3f} s is used: the clocks drift apart, "
                "or the beginning told it wrongly or not at all; state the offset"
            )

    def _remember(self, forces: FootForces, start_s: float, end_s: float) -> None:
        for stance in forces.stances:
            if stance.end_s >= start_s and stance.start_s <= end_s:
                self._add(stance)
        for kept, found in ((self.assumed, forces.assumed), (self.findings, forces.findings)):
            kept += [text for text in found if text not in kept]

    def _add(self, stance: PlateStance) -> None:
        """Adds a stance; one over the edge of a window was seen from both sides of it."""
        for k, known in enumerate(self.stances):
            same = (known.plate, known.foot) == (stance.plate, stance.foot)
            if same and stance.start_s <= known.end_s and stance.end_s >= known.start_s:
                self.stances[k] = replace(
                    known,
                    start_s=min(known.start_s, stance.start_s),
                    end_s=max(known.end_s, stance.end_s),
                )
                return
        self.stances.append(stance)


def _first_with_tare(
    windows: Iterator[Motion], tare_s: tuple[float, float] | None
) -> Iterator[Motion]:
    """Yields the windows, those up to the end of the tare as one: body mass comes from there."""
    first: list[Motion] = []
    while tare_s is not None and (motion := next(windows, None)) is not None:
        first.append(motion)
        if motion.time_s[-1] >= tare_s[1]:
            break
        if motion.time_s[-1] - first[0].time_s[0] > _LONGEST_FIRST_S:
            raise InvalidRequest(
                f"tare: expected it within the first {_LONGEST_FIRST_S:.0f} s, got "
                f"{tare_s[0]:g} to {tare_s[1]:g} s."
            )
    if first:
        yield joined(first)
    yield from windows


def _between(motion: Motion, start_s: float, end_s: float) -> Motion | None:
    frames = (motion.time_s >= start_s) & (motion.time_s <= end_s)
    return motion.select(frames) if np.any(frames) else None


def _of_time(plates: PlateForces, start_s: float, end_s: float) -> PlateForces:
    """Returns the samples between two instants of the plates' clock, all where there are none."""
    first, last = np.searchsorted(plates.time_s, (start_s, end_s))
    if last - first < 2:
        return plates
    part = slice(int(first), int(last))
    return replace(
        plates, time_s=plates.time_s[part], force=plates.force[part], moment=plates.moment[part]
    )
