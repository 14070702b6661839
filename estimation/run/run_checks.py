"""What is wrong with a recording, frame by frame: found, named with its times, and left out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from estimation.feet.foot_force_record import SIDES, FootForces, FootState
from estimation.run.run_sensors import FootFrames
from estimation.spatial import Array, BoolArray
from estimation.tree import BASE_NQ, EstimationTree
from human import Motion

#: Nobody turns a joint faster, or is thrown about harder: rad/s, rad/s^2, m/s^2.
FASTEST_RAD_S, FASTEST_RAD_S2, HARDEST_MS2 = 60.0, 5000.0, 1000.0
#: Nearer than this to a right angle the middle one of three axes leaves the outer two all but
#: parallel.
NEAR_SINGULAR_DEG = 5.0
#: Flags of motions, as a reader understands them.
_FLAG_WORDS = {"weak_derivative": "too few frames in a row to derive accelerations from"}
#: Stretches named one by one in a finding.
_NAMED = 3


@dataclass(slots=True)
class _Stretches:
    frames: int = 0
    spans: list[list[float]] = field(default_factory=list)
    count: int = 0
    going_on: bool = False


@dataclass(slots=True)
class Findings:
    """Collects what was found over a run, in any portions of frames.

    Attributes:
        notes: texts, each once.
    """

    notes: list[str] = field(default_factory=list)
    _marks: dict[str, _Stretches] = field(default_factory=dict)

    def note(self, text: str) -> None:
        """Adds a text unless it is there."""
        if text not in self.notes:
            self.notes.append(text)

    def mark(self, what: str, time_s: Array, where: BoolArray) -> None:
        """Says of some frames what is wrong with them; frames come in order."""
        if not np.any(where) and what not in self._marks:
            return
        found = self._marks.setdefault(what, _Stretches())
        found.frames += int(np.count_nonzero(where))
        edges = np.flatnonzero(np.diff(where)) + 1
        for part in np.split(np.arange(len(where)), edges):
            if not len(part):
                continue
            if not where[part[0]]:
                found.going_on = False
                continue
            start, end = float(time_s[part[0]]), float(time_s[part[-1]])
            if found.going_on and found.count <= _NAMED:
                found.spans[-1][1] = end
            elif not found.going_on:
                found.count += 1
                if found.count <= _NAMED:
                    found.spans.append([start, end])
            found.going_on = True

    def texts(self) -> tuple[str, ...]:
        """Returns everything in words, with counts and times."""
        out = list(self.notes)
        for what, found in self._marks.items():
            spans = ", ".join(f"{start:.2f} to {end:.2f} s" for start, end in found.spans)
            more = f" and {found.count - _NAMED} more" if found.count > _NAMED else ""
            out.append(f"{what}: {found.frames} frames ({spans}{more})")
        return tuple(out)


def frames_to_leave_out(motion: Motion, flags: tuple[str, ...]) -> dict[str, BoolArray]:
    """Returns, by reason, the frames ``(n,)`` that no estimate can be made of."""
    out: dict[str, BoolArray] = {}
    for name in flags:
        if name in motion.flags:
            out[_FLAG_WORDS.get(name, f"flagged {name!r}")] = np.asarray(motion.flags[name])
    limits = np.concatenate(
        [np.full(3, HARDEST_MS2), np.full(motion.a.shape[1] - 3, FASTEST_RAD_S2)]
    )
    out[f"acceleration over {HARDEST_MS2:g} m/s^2 or {FASTEST_RAD_S2:g} rad/s^2"] = np.any(
        np.abs(motion.a) > limits, axis=1
    )
    out[f"turning faster than {FASTEST_RAD_S:g} rad/s"] = np.any(
        np.abs(motion.v[:, 3:]) > FASTEST_RAD_S, axis=1
    )
    return {reason: where for reason, where in out.items() if np.any(where)}


def unseen_segments(motion: Motion, unobserved: Sequence[str]) -> dict[str, BoolArray]:
    """Returns segments to the frames ``(n,)`` on which nothing measured their posture.

    Args:
        motion: its flags say which segments were lost for a while.
        unobserved: those that nothing ever showed.
    """
    never = np.ones(len(motion), dtype=np.bool_)
    return {**motion.unseen_segments, **dict.fromkeys(unobserved, never)}


def near_singular(tree: EstimationTree, q: Array) -> Mapping[str, BoolArray]:
    """Returns, by joint, the frames ``(n,)`` in which two of its three axes all but coincide."""
    out = {}
    for link, dofs in enumerate(tree.dofs):
        if len(dofs) == 3 and len(set(tree.axes[link])) == 3:
            middle = q[:, BASE_NQ + dofs[1]]
            where = np.abs(np.cos(middle)) < np.sin(np.radians(NEAR_SINGULAR_DEG))
            if np.any(where):
                out[tree.joint_names[link - 1]] = where
    return out


def mark_feet(
    findings: Findings, feet: FootForces | None, time_s: Array, frames: FootFrames
) -> None:
    """Says where the feet's forces are not known, and why."""
    if feet is None:
        findings.note(
            "no foot forces: no balance, so no payload, and a joint is known only where nothing "
            "unmeasured can push beyond it"
        )
        return
    for side, foot in zip(SIDES, (feet.right, feet.left), strict=True):
        for state, words in (
            (FootState.UNMEASURED, "stands where nothing measures"),
            (FootState.SATURATED, "is on a plate at its limit"),
            (FootState.SHARED, "shares a plate with the other: the legs are not known"),
        ):
            findings.mark(f"{side} foot {words}", time_s, np.asarray(foot.state == state))
        column = SIDES.index(side)
        findings.mark(
            f"{side} foot's wrench or variance is not a number that can be worked with, and is "
            "taken as not measured",
            time_s,
            frames.mended[:, column],
        )
    findings.mark(
        "something else than the plates bears a part of the person (a chair, a table), or the body "
        "mass is too high: no balance, and no payload",
        time_s,
        frames.propped,
    )
