"""A recording's postures block by block: every frame fitted for itself, nothing carried over.

A block is a fixed stretch of frames, so that a recording fitted in parts gives the same numbers as
fitted whole. Every eighth frame is found from its markers alone; those between start from their
neighbours.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from human.marker_recording import MarkerRecording
from human.markers.body import MarkerBody
from human.markers.errors import MarkerFitError
from human.markers.ik_priors import (
    POOR_SD_RAD,
    movable_dofs,
    no_pull,
    posture_prior,
    trusting,
)
from human.markers.ik_solve import MarkerProblem, Solved, solve, spreads
from human.markers.ik_start import start_poses
from human.markers.ik_system import MarkerSystem
from human.markers.marker_set import plain_name, wearer
from human.markers.recognise import LEAST_LANDMARKS
from human.model import BASE_NQ, BASE_NV, Array, IntArray

Flags = NDArray[np.bool_]

#: Frames in a block.
BLOCK = 512
#: Every so many frames are found from their markers alone.
_KEY_STEP = 8
#: Angles further apart (rad) than this between two such frames are not interpolated.
_FAR_RAD = 1.0
#: Frames looked at to learn which angles the markers determine.
_SAMPLE = 48
#: A frame whose angles stray so far (rad) from the median of so many frames is tried again there.
_JUMP_RAD, _JUMP_FRAMES = 0.25, 33
#: What smoothness may cost: half a squared standard deviation or so.
_JUMP_COST = 1.0
#: An angle with a greater standard deviation (rad) is poorly shown; by a trial prior of one radian.
_POOR_RAD = 0.15
_TRIAL_SD_RAD = 1.0
#: Share of its prior's spread above which a poorly shown angle is not shown at all.
_UNSHOWN = 0.7
#: An angle is not shown on a frame where it is this uncertain (rad), and this many times the usual.
_WEAK_RAD, _WEAK_TIMES = 0.15, 3.0
#: A base more uncertain than this (m, rad) is not known.
_BASE_SD = (0.05, 0.2)
#: Least share of the markers seen that must be believed.
_LEAST_BELIEVED = 0.6


@dataclass(frozen=True, slots=True, eq=False)
class FitPlan:
    """What a recording's markers determine, settled before its frames are fitted.

    Attributes:
        recording: the markers.
        columns: ``(used,)`` places in the recording of the markers used.
        marker_names: ``used`` names.
        problem: model, markers and prior.
        typical_sd_rad: ``(n_dof,)`` rad.
        poor: ``(n_dof,)`` held near the reference posture for want of markers, or not moved at all.
        unobserved_dofs: those of them that no marker shows.
        observed: segments that the body's markers show when they are seen.
        most_residual_m: a frame whose believed markers lie further off (RMS) is not fitted.
        notes: in words.
    """

    recording: MarkerRecording
    columns: IntArray
    marker_names: tuple[str, ...]
    problem: MarkerProblem
    typical_sd_rad: Array
    poor: Flags
    unobserved_dofs: tuple[str, ...]
    observed: tuple[str, ...]
    most_residual_m: float
    notes: tuple[str, ...]

    def markers(self, frames: IntArray | slice) -> tuple[Array, Array]:
        """Returns positions ``(B, used, 3)`` m and where they are seen ``(B, used)``, 1 or 0."""
        position = self.recording.position[frames][:, self.columns]
        return position, self.recording.valid[frames][:, self.columns].astype(np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class RawBlock:
    """Frames fitted each for itself.

    Attributes:
        start: place of the first in the recording.
        solved: their postures.
        good: ``(B,)`` fitted.
        weak: ``(B, k)`` free angles that their markers do not determine.
    """

    start: int
    solved: Solved
    good: Flags
    weak: Flags


def plan_fit(body: MarkerBody, recording: MarkerRecording, most_residual_m: float) -> FitPlan:
    """Finds which markers and angles of a body a recording shows.

    Raises:
        MarkerFitError: none of its markers is on the body, or they never show the pelvis.
    """
    place_of = _places(body.marker_names, recording)
    used = [k for k, place in enumerate(place_of) if place is not None]
    if not used:
        raise MarkerFitError(
            recording.source,
            f"expected some of the body's ({', '.join(body.marker_names)}), got "
            f"{', '.join(recording.marker_names) or 'none'}; use the body of the same marker set.",
        )
    names = tuple(body.marker_names[k] for k in used)
    absent = [name for name in body.marker_names if name not in names]
    model, segment = body.model, body.segment[used]
    free = movable_dofs(model, segment)
    loose = posture_prior(model, free, segment)
    plan = FitPlan(
        recording=recording,
        columns=np.array([place_of[k] for k in used], dtype=np.intp),
        marker_names=names,
        problem=MarkerProblem(
            MarkerSystem(model, segment, body.offset[used], free),
            loose.loosened(np.full(len(free), _TRIAL_SD_RAD)),
            body.sd_m[used],
        ),
        typical_sd_rad=np.full(model.n_dof, np.inf),
        poor=np.ones(model.n_dof, dtype=np.bool_),
        unobserved_dofs=(),
        observed=body.observed,
        most_residual_m=most_residual_m,
        notes=(f"Not in this recording: {', '.join(absent)}.",) if absent else (),
    )
    marker, seen = plan.markers(_sample(recording.valid[:, plan.columns]))
    trial = _solve_alone(plan.problem, marker, seen)
    sd = _typical(plan.problem, trial, seen)
    poor = (sd[BASE_NV:] > _POOR_RAD) & ~loose.settled
    problem = replace(plan.problem, prior=trusting(loose, poor))
    settled = solve(problem, trial.q, marker, seen, no_pull(len(marker), len(free)))
    sd = _typical(problem, settled, seen)
    if np.any(sd[:3] > _BASE_SD[0]) or np.any(sd[3:6] > _BASE_SD[1]):
        raise MarkerFitError(
            recording.source,
            f"expected markers that show where the body is, got only {', '.join(names)} on it.",
        )
    unshown = poor & (sd[BASE_NV:] > _UNSHOWN * POOR_SD_RAD)
    everywhere = np.ones(model.n_dof, dtype=np.bool_)
    everywhere[free[~unshown]] = False
    all_poor = np.ones(model.n_dof, dtype=np.bool_)
    all_poor[free[~poor]] = False
    typical = np.full(model.n_dof, POOR_SD_RAD)
    typical[free] = sd[BASE_NV:]
    return replace(
        plan,
        problem=problem,
        typical_sd_rad=typical,
        poor=all_poor,
        unobserved_dofs=tuple(model.dof_names[k] for k in np.flatnonzero(everywhere)),
    )


def _places(names: tuple[str, ...], recording: MarkerRecording) -> list[int | None]:
    """Returns where a recording has each marker, if it ever shows it.

    The same marker may bear another subject's prefix in another file; one subject's, not several.

    Raises:
        MarkerFitError: several subjects wear the markers, and none by the name they have here.
    """
    exact = {name: k for k, name in enumerate(recording.marker_names)}
    known = {wearer(name) for name in names if name in exact}
    wanted = {plain_name(name) for name in names}
    worn = Counter(wearer(name) for name in exact if plain_name(name) in wanted)
    persons = [prefix for prefix, count in worn.items() if count >= LEAST_LANDMARKS]
    if not known and len(persons) > 1:
        raise MarkerFitError(
            recording.source,
            f"expected one person's, got those of {', '.join(map(repr, persons))}; use a static "
            "trial in which the person has the same name, or leave the others out of the file.",
        )
    mine = known or {prefix for prefix, _ in worn.most_common(1)} | {""}
    plain = {plain_name(name): k for name, k in exact.items() if wearer(name) in mine}
    ever = np.any(recording.valid, axis=0)
    found = [exact.get(name, plain.get(plain_name(name))) for name in names]
    return [place if place is not None and ever[place] else None for place in found]


def raw_blocks(plan: FitPlan) -> Iterator[RawBlock]:
    """Fits a recording block by block."""
    for start in range(0, plan.recording.frames, BLOCK):
        yield _fit_block(plan, start)


def _fit_block(plan: FitPlan, start: int) -> RawBlock:
    problem = plan.problem
    marker, seen = plan.markers(slice(start, start + BLOCK))
    count, free = len(marker), len(problem.system.free)
    keys = np.union1d(np.arange(0, count, _KEY_STEP), [count - 1])
    key = _solve_alone(problem, marker[keys], seen[keys])
    trusted = _good(plan, key, seen[keys]) & ~np.any(key.outlier, axis=1)
    if not np.any(trusted):
        trusted = np.ones(len(keys), dtype=np.bool_)
    q = interpolated(keys[trusted], key.q[trusted], np.arange(count))
    solved = solve(problem, q, marker, seen, no_pull(count, free))
    # Where that leaves doubt, the frame's own markers may know better.
    doubtful = np.flatnonzero(~solved.settled | np.any(solved.outlier, axis=1))
    if len(doubtful):
        alone = _solve_alone(problem, marker[doubtful], seen[doubtful])
        solved = _better(solved, alone, doubtful, -1e-6 * solved.cost[doubtful])
    # With few markers left two postures may look alike: the one that does not jump is meant.
    usual = _median(solved.q)
    jumping = np.flatnonzero(_stray(problem, solved.q, usual) > _JUMP_RAD)
    if len(jumping):
        calm = solve(
            problem, usual[jumping], marker[jumping], seen[jumping], no_pull(len(jumping), free)
        )
        solved = _better(solved, calm, jumping, np.full(len(jumping), _JUMP_COST))
    good, weak = _judge(plan, solved, seen)
    return RawBlock(start, solved, good, weak)


def _solve_alone(problem: MarkerProblem, marker: Array, seen: Array) -> Solved:
    system = problem.system
    q = start_poses(system.model, system.segment, system.offset, marker, seen)
    return solve(problem, q, marker, seen, no_pull(len(q), len(system.free)))


def _median(q: Array) -> Array:
    """Returns configurations with each angle the median of the frames around; the base as it is."""
    out = q.copy()
    out[:, BASE_NQ:] = median_filter(q[:, BASE_NQ:], size=(_JUMP_FRAMES, 1), mode="nearest")
    return out


def _stray(problem: MarkerProblem, q: Array, usual: Array) -> Array:
    """Returns the largest difference ``(B,)`` rad of any angle.

    The outer two of three angles count by the cosine of the middle one: near 90 degrees they swing.
    """
    model = problem.system.model
    away = np.abs(q - usual)[:, BASE_NQ:]
    for joint in range(len(model.joint_names)):
        dofs = model.joint_dofs(joint)
        if len(dofs) == 3:
            away[:, dofs[[0, 2]]] *= np.abs(np.cos(q[:, BASE_NQ + dofs[[1]]]))
    return np.asarray(np.max(away, axis=1))


def _better(solved: Solved, other: Solved, frames: IntArray, more: Array) -> Solved:
    """Takes the other solution of some frames where it costs less, or so much ``more``."""
    wins = other.cost < solved.cost[frames] + more
    at = frames[wins]
    fields = {}
    for name in ("q", "residual_m", "outlier", "settled", "cost"):
        fields[name] = getattr(solved, name).copy()
        fields[name][at] = getattr(other, name)[wins]
    return Solved(**fields)


def _judge(plan: FitPlan, solved: Solved, seen: Array) -> tuple[Flags, Flags]:
    """Returns which frames are fitted ``(B,)`` and which free angles are not shown ``(B, k)``.

    The uncertainty is worked out where markers are missing, and on every eighth of the frames that
    show them all, whose verdict, the posture's, holds for those around it.
    """
    free = plan.problem.system.free
    believed = seen * ~solved.outlier
    patchy = np.any(believed < 1.0, axis=1)
    whole = np.flatnonzero(~patchy)
    looked_at = np.concatenate([np.flatnonzero(patchy), whole[::_KEY_STEP]])
    at = np.zeros(len(seen), dtype=np.intp)
    at[patchy] = np.arange(np.sum(patchy))
    at[whole] = np.sum(patchy) + np.arange(len(whole)) // _KEY_STEP
    sd, turn = spreads(
        plan.problem, solved.q[looked_at], solved.residual_m[looked_at], believed[looked_at]
    )
    sd, turn = sd[at], turn[at]
    most = np.maximum(_WEAK_RAD, _WEAK_TIMES * plan.typical_sd_rad[free])
    weak = (sd[:, BASE_NV:] > most) & (turn > most)
    known = np.all(sd[:, :3] < _BASE_SD[0], axis=1) & np.all(sd[:, 3:6] < _BASE_SD[1], axis=1)
    return _good(plan, solved, seen) & known, weak & ~plan.poor[free]


def _good(plan: FitPlan, solved: Solved, seen: Array) -> Flags:
    believed = seen * ~solved.outlier
    number = believed.sum(axis=1)
    square = np.sum(believed * solved.residual_m**2, axis=1) / np.maximum(number, 1.0)
    enough = (number >= 3) & (number >= _LEAST_BELIEVED * seen.sum(axis=1))
    return np.asarray(solved.settled & enough & (square <= plan.most_residual_m**2))


def interpolated(known: IntArray, q: Array, wanted: IntArray) -> Array:
    """Returns configurations ``(wanted, nq)`` between known ones, held beyond the first and last.

    Angles far apart are not mixed: the nearer one is taken.
    """
    after = np.clip(np.searchsorted(known, wanted), 1, max(len(known) - 1, 1))
    after = np.minimum(after, len(known) - 1)
    before = np.maximum(after - 1, 0)
    span = np.maximum(known[after] - known[before], 1)
    share = np.clip((wanted - known[before]) / span, 0.0, 1.0)[:, None]
    first, second = q[before], q[after].copy()
    flip = np.sum(first[:, 3:7] * second[:, 3:7], axis=1) < 0.0
    second[flip, 3:7] *= -1.0
    jump = np.abs(second - first) > _FAR_RAD
    jump[:, :BASE_NQ] = False
    mixed = np.where(jump, np.where(share < 0.5, first, second), first + share * (second - first))
    mixed[:, 3:7] /= np.linalg.norm(mixed[:, 3:7], axis=1, keepdims=True)
    return np.asarray(mixed)


def _sample(valid: NDArray[np.bool_]) -> IntArray:
    """Returns some frames, spread over the recording, of those that show most markers."""
    number = valid.sum(axis=1)
    full = np.flatnonzero(number >= 0.9 * number.max())
    return full[np.unique(np.linspace(0, len(full) - 1, _SAMPLE).astype(np.intp))]


def _typical(problem: MarkerProblem, solved: Solved, seen: Array) -> Array:
    at = solved.settled if np.any(solved.settled) else np.ones_like(solved.settled)
    sd, _ = spreads(problem, solved.q[at], np.zeros_like(seen[at]), seen[at])
    return np.asarray(np.median(sd, axis=0))
