"""From markers to the model's configurations: whole-body inverse kinematics.

Use this for optical recordings; `human.pose.fit_recording` for recorded segment orientations.

Source: Lu and O'Connor 1999 (weighted least squares over all segments at once); the rest derived
here and in the modules that do the work: `ik_system`, `ik_priors`, `ik_solve`, `ik_bridge`.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from human.differentiate import GAP_FACTOR, motion_from_configurations
from human.marker_recording import MarkerRecording
from human.markers.body import MarkerBody
from human.markers.errors import MarkerFitError
from human.markers.fitted import FittedMarkers, Flags
from human.markers.ik_blocks import FitPlan, plan_fit, raw_blocks
from human.markers.ik_bridge import JoinedBlock, joined_blocks
from human.markers.ik_start import inside, middle, other_branch, whole_turns_off
from human.model import BASE_NQ, Array, HumanModel, IntArray
from human.motion import UNSEEN, Motion, Provenance
from human.pairwise_ik import NEAR_SINGULAR_RAD

#: Default differentiating window, s: accelerations are within a tenth of those behind the low-pass
#: of 6 Hz usual for gait (Butterworth of second order, forwards and back).
MARKER_WINDOW_S = 0.12
#: Longest gap that is carried over, s.
LONGEST_GAP_S = 0.25
#: A frame whose markers lie further from the model's (root mean square) is not fitted, m.
MOST_RESIDUAL_M = 0.06
#: Least frames to look at beyond a window of time, so that derivatives at its edges are the same.
_LEAST_CONTEXT = 8


def fit_markers(
    body: MarkerBody,
    recording: MarkerRecording,
    *,
    window_s: float = MARKER_WINDOW_S,
    longest_gap_s: float = LONGEST_GAP_S,
    most_residual_m: float = MOST_RESIDUAL_M,
) -> FittedMarkers:
    """Moves a person's model until its markers meet the recorded ones, frame by frame.

    Each frame is fitted for itself, all angles and the base at once: the weighted squared
    distances are least, far markers count less, and angles that markers say little about stay
    likely. See `FittedMarkers` for what becomes of frames and angles that are not shown.

    Args:
        body: the person with the markers on.
        recording: markers of the same set; those not on the body are ignored.
        window_s: width of the differentiating window, s.
        longest_gap_s: longest gap that is carried over, s.
        most_residual_m: frames with a greater root mean square residual are left out, m.

    Returns:
        The motion with residuals, the trust in each angle, and notes.

    Raises:
        MarkerFitError: no marker of the body is in the recording, or no frame can be fitted.
    """
    settings = _Settings(window_s, longest_gap_s, most_residual_m)
    for fitted in _windows(body, recording, np.inf, settings):
        return fitted
    raise MarkerFitError(
        recording.source,
        f"expected frames that the model can meet within {most_residual_m * 1e3:.0f} mm, got none; "
        "check that the body was made from the same person with the same marker set, and the unit.",
    )


def fit_markers_in_windows(
    body: MarkerBody,
    recording: MarkerRecording,
    *,
    seconds: float = 60.0,
    window_s: float = MARKER_WINDOW_S,
    longest_gap_s: float = LONGEST_GAP_S,
    most_residual_m: float = MOST_RESIDUAL_M,
) -> Iterator[FittedMarkers]:
    """Does the same stretch by stretch, with the same numbers and little memory.

    Args:
        body: the person with the markers on.
        recording: markers of the same set.
        seconds: length of a stretch; one without a frame that can be fitted is passed over.
        window_s: width of the differentiating window, s.
        longest_gap_s: longest gap that is carried over, s.
        most_residual_m: frames with a greater root mean square residual are left out, m.

    Yields:
        Consecutive stretches; their notes are about themselves.

    Raises:
        MarkerFitError: no marker of the body is in the recording, or ``seconds`` is not positive.
    """
    if not seconds > 0.0:
        raise MarkerFitError(
            recording.source, f"seconds: expected a positive length of time, got {seconds!r}."
        )
    yield from _windows(
        body, recording, seconds, _Settings(window_s, longest_gap_s, most_residual_m)
    )


@dataclass(frozen=True, slots=True)
class _Settings:
    window_s: float
    longest_gap_s: float
    most_residual_m: float


def _windows(
    body: MarkerBody, recording: MarkerRecording, seconds: float, settings: _Settings
) -> Iterator[FittedMarkers]:
    plan = plan_fit(body, recording, settings.most_residual_m)
    time = recording.time_s
    step_s = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    context_s = settings.window_s + _LEAST_CONTEXT * GAP_FACTOR * step_s
    waiting: list[JoinedBlock] = []
    begin_s = float(time[0])

    def finished(end_s: float) -> FittedMarkers | None:
        return _fitted(plan, waiting, (begin_s, end_s), context_s, step_s, settings)

    for block in joined_blocks(plan, raw_blocks(plan), settings.longest_gap_s):
        waiting.append(block)
        # Derivatives and gaps at the end of a stretch need a frame beyond it.
        while len(block.frame) and time[block.frame[-1]] >= begin_s + seconds + context_s:
            out = finished(begin_s + seconds)
            begin_s += seconds
            del waiting[: _outlived(waiting, time, begin_s - context_s)]
            if out is not None:
                yield out
    while begin_s <= time[-1]:
        out = finished(begin_s + seconds)
        begin_s += seconds
        if out is not None:
            yield out


def _outlived(blocks: list[JoinedBlock], time: Array, limit_s: float) -> int:
    """Returns how many of the first blocks can go, one frame before the limit kept."""
    ended = [
        k for k, block in enumerate(blocks) if len(block.frame) and time[block.frame[-1]] < limit_s
    ]
    return ended[-1] if ended else 0


def _fitted(
    plan: FitPlan,
    blocks: list[JoinedBlock],
    between_s: tuple[float, float],
    context_s: float,
    step_s: float,
    settings: _Settings,
) -> FittedMarkers | None:
    """Makes the record of the frames in ``[begin, end)``, or None if there are none."""
    time = plan.recording.time_s
    model = plan.problem.system.model
    frame = np.concatenate([block.frame for block in blocks])
    begin, end = between_s
    within = (time[frame] >= begin) & (time[frame] < end)
    if not np.any(within):
        return None
    around = (time[frame] >= begin - context_s) & (time[frame] < end + context_s)
    # The next frame on either side, however far: it says whether a gap lies between.
    first, last = np.flatnonzero(within)[[0, -1]]
    around[[max(first - 1, 0), min(last + 1, len(frame) - 1)]] = True

    q, times = np.concatenate([block.q for block in blocks])[around], time[frame[around]]
    outlier = np.concatenate([block.outlier for block in blocks])
    lost = np.concatenate([block.lost for block in blocks])[around]
    flags = {
        "bridged": np.concatenate([block.bridged for block in blocks])[around],
        "unseen": np.any(lost, axis=1),
        **_unseen_segments(plan, lost),
        "outlier": np.any(outlier[around], axis=1),
        "limit_active": _limited(model, q),
        "near_singular": _near_singular(model, q),
    }
    usual_s = float(np.median(np.diff(times))) if len(times) > 1 else step_s
    motion = motion_from_configurations(
        model.dof_names,
        times,
        q,
        window_s=settings.window_s,
        gap_factor=max(GAP_FACTOR * step_s / usual_s, 1.0 + 1e-9),
        flags=flags,
        provenance=_provenance(plan),
        spherical=_spherical(model),
    ).select(within[around])
    left_out = np.concatenate([block.left_out for block in blocks])
    left_out = left_out[(time[left_out] >= begin) & (time[left_out] < end)]
    outlier = outlier[within]
    return FittedMarkers(
        model=model,
        motion=motion,
        frame=frame[within],
        marker_names=plan.marker_names,
        residual_m=np.concatenate([block.residual_m for block in blocks])[within],
        outlier=outlier,
        held=np.concatenate([block.held for block in blocks])[within],
        angle_sd_rad=plan.typical_sd_rad,
        unobserved_dofs=plan.unobserved_dofs,
        notes=(*plan.notes, *_notes(plan, motion, frame[within], outlier, left_out, settings)),
    )


def _unseen_segments(plan: FitPlan, lost: Flags) -> dict[str, Flags]:
    """Flags of the segments that the body's markers show, where this recording does not."""
    model = plan.problem.system.model
    out = {}
    for joint in range(len(model.joint_names)):
        dofs, segment = model.joint_dofs(joint), model.segment_names[joint + 1]
        if segment in plan.observed and len(dofs):
            never = all(model.dof_names[dof] in plan.unobserved_dofs for dof in dofs)
            out[UNSEEN + segment] = np.any(lost[:, dofs], axis=1) | never
    return out


def _spherical(model: HumanModel) -> list[IntArray]:
    """Degrees of freedom ``(3,)`` of each joint that turns about x, y and z."""
    every = [model.joint_dofs(joint) for joint in range(len(model.joint_names))]
    return [dofs for dofs in every if model.dof_axes[dofs].tolist() == [0, 1, 2]]


def _limited(model: HumanModel, q: Array) -> Flags:
    """Frames on which some joint rests on a limit, or lies beyond in both its triples of angles."""
    angles = q[:, BASE_NQ:]
    beyond = (angles <= model.lower) | (angles >= model.upper)
    for dofs in _spherical(model):
        lower, upper = model.lower[dofs], model.upper[dofs]
        other = whole_turns_off(other_branch(angles[:, dofs]), middle(lower, upper))
        beyond[:, dofs] &= ~inside(other, lower, upper, -1e-3)[:, None]
    return np.asarray(np.any(beyond, axis=1))


def _near_singular(model: HumanModel, q: Array) -> Flags:
    middle = [BASE_NQ + dofs[1] for dofs in _spherical(model)]
    away = np.abs(np.abs(q[:, middle]) - 0.5 * np.pi)
    return np.asarray(np.any(away < NEAR_SINGULAR_RAD, axis=1))


def _notes(
    plan: FitPlan,
    motion: Motion,
    frame: IntArray,
    outlier: Flags,
    left_out: IntArray,
    settings: _Settings,
) -> Iterator[str]:
    time = plan.recording.time_s
    for name, bad in zip(plan.marker_names, outlier.T, strict=True):
        if np.any(bad):
            yield f"{name} was not believed on {_spans(time, frame[bad])}."
    if len(left_out):
        yield (
            f"Left out, because the model cannot meet their markers within "
            f"{plan.most_residual_m * 1e3:.0f} mm or too few are seen: {_spans(time, left_out)}."
        )
    if np.any(motion.flags["bridged"]):
        yield (
            f"Carried over gaps of up to {settings.longest_gap_s:g} s: "
            f"{_spans(time, frame[motion.flags['bridged']])}."
        )
    if np.any(motion.flags["unseen"]):
        yield (
            "Some angles were not shown for longer and are held: "
            f"{_spans(time, frame[motion.flags['unseen']])}."
        )


def _spans(time: Array, frames: IntArray) -> str:
    """Says how many frames, and when, in words."""
    parts = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
    spans = [f"{time[part[0]]:.2f} to {time[part[-1]]:.2f} s" for part in parts]
    more = f" and {len(spans) - 3} more" if len(spans) > 3 else ""
    return f"{len(frames)} frames ({', '.join(spans[:3])}{more})"


def _provenance(plan: FitPlan) -> Provenance:
    recording = plan.recording
    assumed = dict.fromkeys(plan.unobserved_dofs, "no marker shows it: reference posture")
    return Provenance(
        source=f"{recording.source} ({recording.format} {recording.version})",
        sha256=recording.digest,
        steps=(
            *recording.report.conversions,
            f"configurations by least squares on {len(plan.marker_names)} markers",
        ),
        assumed=assumed,
    )
