"""2021, section IV-C1: how far the plates are believed in an unloaded T-pose. Figs 8 and 9."""

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from benchmarks.estimation.papers.drawing import (
    ESTIMATED,
    MEASURED,
    SERIES,
    label,
    legend_below,
    log_sweep,
    mark_interval,
    panels,
)
from benchmarks.estimation.papers.loads import without_ncwe
from benchmarks.estimation.papers.measuring import FEET, Measured, foot_wrenches
from benchmarks.estimation.papers.reports import Report, Table, rms
from benchmarks.estimation.papers.scenes import TPOSE, Scenes
from estimation import TPOSE_NO_LOAD, Estimate
from human import forward_kinematics

#: The paper names 1e-6 alone; the others are ours.
SWEEP = (1e-6, 1e-4, 1e-2, 1.0, 1e2)
NAMES = ("fx", "fy", "fz", "mx", "my", "mz")


def experiment(scenes: Scenes) -> Report:
    """Sweeps the covariance of the feet, with accelerations and with zeros in their place."""
    task = scenes.tpose_unloaded
    held = task.simulated.truth.segment_id == TPOSE
    rotation, read = _read(task)
    found = {value: _estimate(task, value, True) for value in SWEEP}
    zeros = {value: _estimate(task, value, False) for value in SWEEP}
    rows = []
    for value in SWEEP:
        apart = (_wrenches(found[value], rotation) - read)[:, held]
        free = (_wrenches(zeros[value], rotation) - read)[:, held]
        rows.append(
            (
                f"{value:g}",
                *(float(rms(x)) for x in (apart[..., :3], apart[..., 3:])),
                *(float(rms(x)) for x in (free[..., :3], free[..., 3:])),
            )
        )
    table = Table(
        "Feet, estimated minus measured while the T-pose is held, RMS; N and N m",
        ("covariance", "force", "moment", "force, zeros fed", "moment, zeros fed"),
        rows,
    )
    errors = {value: _wrenches(found[value], rotation) - read for value in SWEEP}
    worst = _wrenches(zeros[1e-2], rotation) - read
    return Report(
        "2021 Figs 8, 9: T-pose without load, covariance of the feet",
        (table,),
        {
            "2021_fig08_feet_error": _errors(task, held, errors, worst),
            "2021_fig09_feet_tracking": _tracking(task, held, read, found[1e-6], rotation),
        },
        (
            "As in the paper the estimate leaves the measurement as the covariance grows. But "
            "with measured accelerations it stops at the plates' noise: the balance of the body "
            "tells the feet's sum as well. With zeros in place of the accelerations, which is "
            "free fall, it goes on to hundreds, and nothing but 1e-6 looks right.",
        ),
    )


def _estimate(task: Measured, feet: float, accelerations: bool) -> Estimate:
    preset = replace(TPOSE_NO_LOAD, feet=feet)
    return without_ncwe(task, preset, (), accelerations=accelerations)


def _read(task: Measured) -> tuple[np.ndarray, np.ndarray]:
    """Axes of the feet in the world ``2 x T x 3 x 3``; what was read, in world axes."""
    poses = forward_kinematics(task.model, task.simulated.motion.q)
    rotation = np.array([poses.of(name)[0] for name in FEET])
    return rotation, _turned(rotation, foot_wrenches(task)[0])


def _wrenches(found: Estimate, rotation: np.ndarray) -> np.ndarray:
    wrench = np.array([found.external_wrench[:, found.link(name)] for name in FEET])
    return _turned(rotation, wrench)


def _turned(rotation: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    parts = [np.einsum("ktij,ktj->kti", rotation, wrench[..., part]) for part in _PARTS]
    return np.concatenate(parts, axis=-1)


_PARTS = (slice(0, 3), slice(3, 6))


def _errors(
    task: Measured, held: np.ndarray, errors: dict[float, np.ndarray], worst: np.ndarray
) -> Figure:
    title = "2021 Fig. 8: feet, |estimated - measured| for covariances of the feet (world axes)"
    figure, axes = panels(6, 2, title, size=(9.5, 10.0), sharex=True, sharey="row")
    names = log_sweep(list(errors))
    for k, foot in enumerate(FEET):
        for row, name in enumerate(NAMES):
            axis = axes[row, k]
            for (_, error), text, color in zip(errors.items(), names, SERIES, strict=False):
                size = np.abs(error[k, :, row])
                axis.plot(task.time_s, size, color=color, linewidth=0.7, label=text)
            fed = r"$10^{-2}$, zeros fed as accelerations"
            size = np.abs(worst[k, :, row])
            axis.plot(task.time_s, size, color="black", linewidth=0.8, linestyle="--", label=fed)
            axis.set_yscale("log")
            axis.set_ylim(1e-6, 1e3)
            mark_interval(axis, task.time_s, held)
            unit = "N" if row < 3 else "N m"
            label(
                axis,
                title=foot if row == 0 else "",
                y=f"{name} ({unit})" if k == 0 else "",
                x="time (s)" if row == 5 else "",
            )
    legend_below(figure, axes[0, 0], 6)
    return figure


def _tracking(
    task: Measured, held: np.ndarray, read: np.ndarray, found: Estimate, rotation: np.ndarray
) -> Figure:
    title = r"2021 Fig. 9: feet, measured and estimated with a covariance of $10^{-6}$ (world axes)"
    figure, axes = panels(6, 2, title, size=(9.5, 10.0), sharex=True, sharey="row")
    ours = _wrenches(found, rotation)
    for k, foot in enumerate(FEET):
        for row, name in enumerate(NAMES):
            axis = axes[row, k]
            axis.plot(
                task.time_s, read[k, :, row], ".", color=MEASURED, markersize=2.5, label="measured"
            )
            axis.plot(
                task.time_s, ours[k, :, row], color=ESTIMATED, linewidth=0.8, label="estimated"
            )
            mark_interval(axis, task.time_s, held)
            unit = "N" if row < 3 else "N m"
            label(
                axis,
                title=foot if row == 0 else "",
                y=f"{name} ({unit})" if k == 0 else "",
                x="time (s)" if row == 5 else "",
            )
    legend_below(figure, axes[0, 0])
    return figure
