"""Fitted frames joined over time: one branch of every joint's angles, short gaps carried over.

An angle that its markers do not show for a moment is taken from its neighbours in time and the
frame fitted again around it; a frame that cannot be fitted at all is interpolated whole, or left
out where the gap is longer than stated.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from human.markers.ik_blocks import FitPlan, RawBlock
from human.markers.ik_priors import POOR_SD_RAD, SWING_RAD, Pull
from human.markers.ik_solve import solve
from human.markers.ik_start import inside, middle, other_branch, whole_turns_off
from human.model import BASE_NQ, Array, HumanModel, IntArray

Flags = NDArray[np.bool_]

#: How far an angle may stray from its neighbours' (rad): over a short gap, and over a longer one.
_SHORT_SD_RAD, _LONG_SD_RAD = 0.05, 0.2
#: Middle angles with a smaller cosine let the outer ones swing.
_SWINGING_COSINE = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class JoinedBlock:
    """Frames in their final posture; those left out are gone.

    Attributes:
        frame: ``(F,)`` places in the recording.
        q: ``(F, nq)``.
        residual_m: ``(F, markers)`` m.
        outlier: ``(F, markers)``.
        held: ``(F, n_dof)`` angles that no marker determined.
        lost: ``(F, n_dof)`` those of them that were not shown for longer than a short gap.
        bridged: ``(F,)`` something was carried over a short gap.
        left_out: places in the recording of the frames that could not be fitted.
    """

    frame: IntArray
    q: Array
    residual_m: Array
    outlier: Flags
    held: Flags
    lost: Flags
    bridged: Flags
    left_out: IntArray


def joined_blocks(
    plan: FitPlan, blocks: Iterator[RawBlock], longest_gap_s: float
) -> Iterator[JoinedBlock]:
    """Joins blocks, each with a view of the one before and the one after."""
    before: RawBlock | None = None
    here: RawBlock | None = None
    for after in _on_one_branch(plan.problem.system.model, blocks):
        if here is not None:
            yield _join(plan, before, here, after, longest_gap_s)
        before, here = here, after
    if here is not None:
        yield _join(plan, before, here, None, longest_gap_s)


def _on_one_branch(model: HumanModel, blocks: Iterator[RawBlock]) -> Iterator[RawBlock]:
    """Takes, of the two triples of angles that make the same rotation, the nearer to the last.

    A quaternion and its negative are the same, too.
    """
    last: Array | None = None
    for block in blocks:
        q = block.solved.q.copy()
        if last is None:
            last = q[0]
        signs = np.sign(np.sum(q[:, 3:7] * np.vstack([last[3:7], q[:-1, 3:7]]), axis=1))
        q[:, 3:7] *= np.cumprod(np.where(signs < 0.0, -1.0, 1.0))[:, None]
        for joint in range(len(model.joint_names)):
            dofs = model.joint_dofs(joint)
            if model.dof_axes[dofs].tolist() == [0, 1, 2]:
                part = q[:, BASE_NQ + dofs]
                limits = model.lower[dofs], model.upper[dofs]
                q[:, BASE_NQ + dofs] = _nearest_branch(part, last[BASE_NQ + dofs], *limits)
        last = q[-1]
        yield replace(block, solved=replace(block.solved, q=q))


def _nearest_branch(angles: Array, last: Array, lower: Array, upper: Array) -> Array:
    """Returns triples ``(B, 3)`` that follow each other closely.

    Where the middle angle is large the outer two may leave their limits to do so.
    """
    other = whole_turns_off(other_branch(angles), middle(lower, upper))
    swinging = np.abs(np.cos(angles[:, 1])) < _SWINGING_COSINE
    if not np.any(swinging | inside(other, lower, upper)):
        return angles
    out = angles.copy()
    room = SWING_RAD * np.array([1.0, 0.0, 1.0])
    for k in range(len(out)):
        both = np.stack([angles[k], other[k]])
        if swinging[k]:
            both = whole_turns_off(both, last)
            allowed = inside(both, lower - room, upper + room)
        else:
            allowed = inside(both, lower, upper)
        steps = np.where(allowed, np.sum((both - last) ** 2, axis=1), np.inf)
        out[k] = both[np.argmin(steps)] if np.any(allowed) else angles[k]
        last = out[k]
    return out


def _join(
    plan: FitPlan,
    before: RawBlock | None,
    here: RawBlock,
    after: RawBlock | None,
    longest_gap_s: float,
) -> JoinedBlock:
    model, free = plan.problem.system.model, plan.problem.system.free
    around = [block for block in (before, here, after) if block is not None]
    first = around[0].start
    time = plan.recording.time_s[first : around[-1].start + len(around[-1].good)]
    all_q = np.concatenate([block.solved.q for block in around])
    all_good = np.concatenate([block.good for block in around])
    all_weak = np.concatenate([block.weak for block in around])
    frames = np.arange(here.start, here.start + len(here.good))
    mine = frames - first
    marker, seen = plan.markers(frames)
    q, residual = here.solved.q.copy(), here.solved.residual_m.copy()
    outlier, weak = here.solved.outlier.copy(), here.weak.copy()
    bridged = np.zeros(len(frames), dtype=np.bool_)
    lost = np.zeros((len(frames), model.n_dof), dtype=np.bool_)

    known = np.flatnonzero(all_good)
    gone = ~here.good
    if np.any(gone):
        gap = _gap_around(time, known, mine)
        filled = gone & (gap <= longest_gap_s)
        if np.any(filled):
            q[filled] = _between(time, known, all_q, mine[filled])
            placed = plan.problem.system.place(q[filled]).marker
            away = np.linalg.norm(marker[filled] - placed, axis=-1)
            residual[filled] = away * seen[filled]
            outlier[filled] = (residual[filled] > plan.most_residual_m) & (seen[filled] > 0.0)
            weak[filled] = True
            bridged |= filled
        gone &= ~filled

    again = here.good & np.any(here.weak, axis=1)
    if np.any(again):
        pull, short = _carried(plan, time, all_q, all_good, all_weak, mine, longest_gap_s)
        at = np.flatnonzero(again)
        pull = pull.of(at)
        start = q[at]
        start[:, BASE_NQ + free] = np.where(
            pull.precision > 0.0, pull.mean, start[:, BASE_NQ + free]
        )
        solved = solve(plan.problem, start, marker[at], seen[at], pull)
        q[at], residual[at], outlier[at] = solved.q, solved.residual_m, solved.outlier
        bridged |= again & np.any(here.weak & short, axis=1)
        lost[:, free] = again[:, None] & here.weak & ~short

    keep = ~gone
    held = np.zeros((len(frames), model.n_dof), dtype=np.bool_)
    held[:, free] = weak
    held |= np.isin(
        np.arange(model.n_dof), [model.dof_names.index(n) for n in plan.unobserved_dofs]
    )
    return JoinedBlock(
        frames[keep],
        q[keep],
        residual[keep],
        outlier[keep],
        held[keep],
        lost[keep],
        bridged[keep],
        frames[gone],
    )


def _carried(
    plan: FitPlan,
    time: Array,
    q: Array,
    good: Flags,
    weak: Flags,
    mine: IntArray,
    longest_gap_s: float,
) -> tuple[Pull, Flags]:
    """Returns where time puts each angle not shown, and for which of them the gap is short."""
    free = plan.problem.system.free
    mean, precision = np.zeros((len(mine), len(free))), np.zeros((len(mine), len(free)))
    short = np.zeros((len(mine), len(free)), dtype=np.bool_)
    for k in np.flatnonzero(np.any(weak[mine], axis=0)):
        at = np.flatnonzero(weak[mine, k])
        known = np.flatnonzero(good & ~weak[:, k])
        if not len(known):
            mean[at, k], precision[at, k] = plan.problem.prior.mean[k], POOR_SD_RAD**-2
            continue
        short[at, k] = _gap_around(time, known, mine[at]) <= longest_gap_s
        mean[at, k] = _between(time, known, q[:, [BASE_NQ + free[k]]], mine[at])[:, 0]
        sd = np.where(short[at, k], _SHORT_SD_RAD, _LONG_SD_RAD)
        precision[at, k] = sd**-2
    return Pull(mean, precision), short


def _gap_around(time: Array, known: IntArray, frames: IntArray) -> Array:
    """Time (s) between the known frames next to each frame; infinite beyond the last."""
    after = np.searchsorted(known, frames)
    inside = (after > 0) & (after < len(known))
    gap = np.full(len(frames), np.inf)
    later = known[np.minimum(after, len(known) - 1)] if len(known) else frames
    earlier = known[np.maximum(after - 1, 0)] if len(known) else frames
    gap[inside] = (time[later] - time[earlier])[inside]
    return gap


def _between(time: Array, known: IntArray, values: Array, frames: IntArray) -> Array:
    """Values ``(frames, k)`` by monotone cubics through the known ones, held beyond their ends."""
    if len(known) < 2:
        return np.repeat(values[known], len(frames), axis=0)
    at = np.clip(time[frames], time[known[0]], time[known[-1]])
    out = np.asarray(PchipInterpolator(time[known], values[known], axis=0)(at))
    if values.shape[1] > BASE_NQ:
        out[:, 3:7] /= np.linalg.norm(out[:, 3:7], axis=1, keepdims=True)
    return out
