"""2019, section 4.3: the legs' torques while walking, Figs 10a and 10b."""

import numpy as np
from matplotlib.figure import Figure

from benchmarks.estimation.papers.bases import floating
from benchmarks.estimation.papers.drawing import (
    ESTIMATED,
    OTHER,
    TRUE,
    band,
    label,
    legend_below,
    panels,
    shade_supports,
)
from benchmarks.estimation.papers.reports import Report, Table, rms
from benchmarks.estimation.papers.scenes import Scenes

#: The paper shows "only the most representative": flexions, and what else bears weight.
DOFS = ("Hip_rotx", "Hip_roty", "Hip_rotz", "Knee_roty", "Ankle_rotx", "Ankle_roty")


def experiment(scenes: Scenes) -> Report:
    """Estimates T4 and draws both legs."""
    task = scenes.tasks["T4"]
    found = floating(scenes, task, "noise")
    assert found.torque_sd is not None
    rows = []
    for side in ("Left", "Right"):
        for part in DOFS:
            dof = scenes.model.dof_names.index(f"j{side}{part}")
            true = task.torque()[:, dof]
            error = found.torque[:, dof] - true
            peak = float(np.abs(true).max())
            sd = float(found.torque_sd[:, dof].mean())
            rows.append((f"j{side}{part}", peak, float(rms(error)), sd))
    table = Table(
        "T4, with the noise as covariance, N m",
        ("joint", "peak", "RMSE", "stated sd"),
        rows,
    )
    return Report(
        "2019 Fig. 10: torques of the legs while walking",
        (table,),
        {
            "2019_fig10a_left_leg": _figure(scenes, "Left", "10a"),
            "2019_fig10b_right_leg": _figure(scenes, "Right", "10b"),
        },
        (
            "Ours walks over ground with flat feet; seen from a treadmill's belt it is the same "
            "motion, and the estimator never asks how fast the base goes.",
        ),
    )


def _figure(scenes: Scenes, side: str, number: str) -> Figure:
    task = scenes.tasks["T4"]
    found = floating(scenes, task, "noise")
    truth = task.simulated.truth
    assert found.torque_sd is not None
    title = f"2019 Fig. {number}: {side.lower()} leg while walking; shaded: single support"
    figure, axes = panels(3, 2, title, size=(11.0, 7.5), sharex=True)
    t = task.time_s
    for k, part in enumerate(DOFS):
        axis = axes.flat[k]
        dof = scenes.model.dof_names.index(f"j{side}{part}")
        shade_supports(axis, t, truth.contact_right, truth.contact_left)
        torque, sd = found.torque[:, dof], found.torque_sd[:, dof]
        band(axis, t, torque, sd, ESTIMATED, "95 % band")
        axis.plot(t, torque, color=ESTIMATED, linewidth=1.2, label="torque, estimated")
        axis.plot(t, task.torque()[:, dof], color=TRUE, linewidth=0.7, label="torque, truth")
        label(axis, title=f"j{side}{part}", y="N m", x="time (s)" if k > 3 else "")
        twin = axis.twinx()
        angle = np.rad2deg(task.simulated.motion.joint_angles[:, dof])
        twin.plot(t, angle, color=OTHER, linewidth=0.9, linestyle="--")
        axis.plot([], [], color=OTHER, linewidth=0.9, linestyle="--", label="angle (right axis)")
        twin.set_ylabel("degrees", fontsize=8)
        twin.tick_params(labelsize=8)
    legend_below(figure, axes[0, 0])
    return figure
