"""2019, section 4.4: does it matter which link is the base? Figs 11, 12, 13 and Table 4."""

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from benchmarks.estimation.papers.bases import fixed, floating
from benchmarks.estimation.papers.drawing import MEASURED, SERIES, label, legend_below, panels
from benchmarks.estimation.papers.reports import Report, Table, rms, spread
from benchmarks.estimation.papers.scenes import Scenes
from benchmarks.estimation.papers.tables_2019 import TABLE_4

#: The foot that the paper makes the fixed base in each task; in T4 none stays.
FIXED = {"T1": "LeftFoot", "T2": "RightFoot", "T3": "LeftFoot"}
NAMES = tuple(TABLE_4)
WAYS = {
    "paper": "2019 covariances",
    "heavier": "the same, body 3 % too heavy",
    "noise": "the noise's",
}


@dataclass(frozen=True, slots=True)
class _Apart:
    """Norms of the differences, ``T`` by quantity, and errors of the torques of both."""

    time_s: np.ndarray
    norms: dict[str, np.ndarray]
    fixed_rmse: float
    floating_rmse: float


def experiment(scenes: Scenes) -> Report:
    """Estimates T1 to T3 both ways and compares."""
    apart = {way: {name: _apart(scenes, name, way) for name in FIXED} for way in WAYS}
    rows = []
    for name in NAMES:
        for k, (task, paper) in enumerate(zip(FIXED, TABLE_4[name], strict=True)):
            ours = [spread(apart[way][task].norms[name]) for way in apart]
            rows.append((name if k == 0 else "", task, paper, *ours))
    truth = [
        (task, way, one.fixed_rmse, one.floating_rmse)
        for way, tasks in apart.items()
        for task, one in tasks.items()
    ]
    tables = (
        Table(
            "Table 4: norm of fixed minus floating, mean ± sd over the frames",
            ("norm", "task", "paper", *(f"ours, {text}" for text in WAYS.values())),
            rows,
        ),
        Table(
            "Torques against the truth, RMSE in N m",
            ("task", "covariances", "fixed base", "floating base"),
            truth,
        ),
    )
    return Report(
        "2019 Figs 11-13, Table 4: fixed against floating base",
        tables,
        {
            "2019_fig11_base_acceleration": _figure(
                apart, NAMES[:2], "2019 Fig. 11: pelvis, fixed minus floating base"
            ),
            "2019_fig12_external_wrenches": _figure(
                apart,
                NAMES[2:4],
                "2019 Fig. 12: wrenches but the fixed foot's, fixed minus floating",
            ),
            "2019_fig13_joints": _figure(
                apart, NAMES[4:], "2019 Fig. 13: joints, fixed minus floating base"
            ),
        },
        (
            "Both are one elimination: a fixed base is a foot whose acceleration is known and "
            "whose force is not measured. What differs is that the floating base uses both shoes: "
            "its torques are nearer to the truth.",
            "With our readings the two differ at random, by what one shoe's noise moves. The "
            "paper's torques differ by a steady 4 to 7 N m, which points to a model that disagrees "
            "with the shoes: a body that is 3 % too heavy adds some 3 N m that stay to ours.",
        ),
    )


def _apart(scenes: Scenes, name: str, way: str) -> _Apart:
    task, foot = scenes.tasks[name], FIXED[name]
    free, held = floating(scenes, task, way), fixed(scenes, task, way, foot)
    others = [k for k, link in enumerate(free.tree.link_names) if link != foot]
    base = held.link_acceleration[:, 0] - free.link_acceleration[:, 0]
    wrench = (held.external_wrench - free.external_wrench)[:, others]
    count = len(task.time_s)
    values = (
        base[:, :3],
        base[:, 3:],
        wrench[..., :3].reshape(count, -1),
        wrench[..., 3:].reshape(count, -1),
        held.joint_acceleration - free.joint_acceleration,
        held.torque - free.torque,
    )
    norms = {n: np.linalg.norm(value, axis=1) for n, value in zip(NAMES, values, strict=True)}
    true = task.torque()
    return _Apart(
        task.time_s, norms, float(rms(held.torque - true)), float(rms(free.torque - true))
    )


def _figure(apart: dict[str, dict[str, _Apart]], names: tuple[str, ...], title: str) -> Figure:
    figure, axes = panels(len(names), len(FIXED), title, sharex="col", sharey="row")
    for row, name in enumerate(names):
        quantity, unit = name.rsplit(", ", 1)
        for column, task in enumerate(FIXED):
            axis = axes[row, column]
            for (way, text), color in zip(WAYS.items(), SERIES, strict=False):
                one = apart[way][task]
                norm = one.norms[name]
                axis.plot(one.time_s, norm, color=color, linewidth=0.7, label=f"ours, {text}")
            mean = float(TABLE_4[name][column].split()[0])
            axis.axhline(mean, color=MEASURED, linestyle="--", linewidth=1.0, label="paper's mean")
            axis.set_yscale("log")
            label(
                axis,
                title=task if row == 0 else "",
                y=f"{quantity}\n({unit})" if column == 0 else "",
                x="time (s)" if row == len(names) - 1 else "",
            )
    legend_below(figure, axes[0, 0])
    return figure
