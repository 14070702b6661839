"""2019, section 4.2: is what was measured found again? Figs 7, 8a, 8b, 9 and Tables 2, 3.

The papers hold the estimate against the measurement it was made from. Here the truth is known, too.
"""

import numpy as np
from matplotlib.figure import Figure

from benchmarks.estimation.papers.bases import floating
from benchmarks.estimation.papers.drawing import (
    ESTIMATED,
    MEASURED,
    OTHER,
    TRUE,
    label,
    legend_below,
    panels,
)
from benchmarks.estimation.papers.measuring import FEET, Measured, foot_wrenches
from benchmarks.estimation.papers.reports import Report, Table, rms, spread
from benchmarks.estimation.papers.scenes import Scenes
from benchmarks.estimation.papers.tables_2019 import JOINT_ACCELERATIONS, TABLE_2, TABLE_3, TASKS
from estimation import Accelerometer, Estimate, JointAcceleration
from human.simulate import ImuMount, simulate_imus

LINKS = ("Pelvis", "LeftFoot", "RightFoot")
WAYS = ("paper", "noise")
NAMES = ("2019 covariances", "the noise's")


def experiment(scenes: Scenes) -> Report:
    """Runs T1 to T4 and compares."""
    seen = {name: _Compared(scenes, name) for name in TASKS}
    lost = 100.0 * (1.0 - float(np.mean([one.arrived.mean() for one in seen.values()])))
    figures = {
        "2019_fig07_base_acceleration": _drawn(
            seen, "Pelvis", "2019 Fig. 7: proper acceleration of the base (pelvis)", "m/s²"
        ),
        "2019_fig08a_left_foot": _drawn(
            seen, "LeftFoot", "2019 Fig. 8a: what the ground does to the left foot", "N"
        ),
        "2019_fig08b_right_foot": _drawn(
            seen, "RightFoot", "2019 Fig. 8b: what the ground does to the right foot", "N"
        ),
        "2019_fig09_joint_accelerations": _joint_figure(seen),
    }
    return Report(
        "2019 Figs 7-9, Tables 2, 3: measured against estimated",
        (_table_2(seen), _table_3(seen), _joint_table(seen), _truth_table(seen)),
        figures,
        (
            "The paper's measure rewards believing the sensors: with its covariances the estimate "
            "repeats their noise and is as wrong as they are. With the noise as covariance it is "
            "further from the measurement, nearer to the truth, and says how near.",
            "The paper prints only the range of its covariances; these are the ones in it that "
            "come nearest to its Table 2.",
            f"{lost:.0f} % of the frames lack some sensor: with the noise as covariance it "
            "counts for nothing there, with the paper's its last reading stands: see T4.",
        ),
    )


class _Compared:
    """One task: readings, truth and both estimates of everything that was measured."""

    def __init__(self, scenes: Scenes, name: str) -> None:
        task: Measured = scenes.tasks[name]
        self.task, self.time_s, self.arrived = task, task.time_s, task.arrived
        self.estimates: dict[str, Estimate] = {way: floating(scenes, task, way) for way in WAYS}
        wrenches, true = foot_wrenches(task)
        pelvis = next(
            s for s in task.sensors if isinstance(s, Accelerometer) and s.link == "Pelvis"
        )
        (exact,) = simulate_imus(
            scenes.model,
            task.simulated.motion,
            [ImuMount("Pelvis", np.zeros(3), np.eye(3))],
            np.random.default_rng(0),
        )
        self.read = {"Pelvis": np.asarray(pelvis.value), **dict(zip(FEET, wrenches, strict=True))}
        self.true = {"Pelvis": exact.acceleration, **dict(zip(FEET, true, strict=True))}
        self.found: dict[str, dict[str, np.ndarray]] = {}
        for way, found in self.estimates.items():
            self.found[way] = {"Pelvis": found.link_acceleration[:, 0, :3]}
            for foot in FEET:
                self.found[way][foot] = found.external_wrench[:, found.link(foot)]

    def joint_error(self, way: str) -> np.ndarray:
        """Norm of the difference of all joint accelerations from the measured ones, ``T``."""
        read = next(s for s in self.task.sensors if isinstance(s, JointAcceleration))
        apart = self.estimates[way].joint_acceleration - np.asarray(read.value)
        return np.linalg.norm(apart, axis=1)


def _table_2(seen: dict[str, _Compared]) -> Table:
    rows = []
    for name, one in seen.items():
        for link in LINKS:
            ok = one.arrived
            rows.append((name, link, "paper, to measured", *_wide(TABLE_2[name, link])))
            for way in WAYS:
                apart = rms((one.found[way][link] - one.read[link])[ok], axis=0)
                rows.append(("", "", f"ours ({way}), to measured", *_wide(apart)))
            for way in WAYS:
                apart = rms((one.found[way][link] - one.true[link])[ok], axis=0)
                rows.append(("", "", f"ours ({way}), to the truth", *_wide(apart)))
    return Table(
        "Table 2: RMSE; pelvis m/s², feet N and N m (paper: its covariances, noise: the sensors')",
        ("task", "link", "which", "x", "y", "z", "mx", "my", "mz"),
        rows,
    )


def _table_3(seen: dict[str, _Compared]) -> Table:
    rows = []
    for (link, name), paper in TABLE_3.items():
        column = "xyz".index(name[1]) + 3 * (name[0] == "m")
        row = [f"{link} {name}"]
        for task, (low, high) in zip(TASKS, paper, strict=True):
            one = seen[task]
            apart = np.abs(one.found["paper"][link] - one.read[link])[one.arrived, column]
            row += [f"{low:.1e}-{high:.1e}", f"{apart.min():.1e}-{apart.max():.1e}"]
        rows.append(row)
    columns = ["error"] + [f"{task} {who}" for task in TASKS for who in ("paper", "ours")]
    return Table("Table 3: least and largest error to the measurement", columns, rows)


def _joint_table(seen: dict[str, _Compared]) -> Table:
    rows = [
        (name, JOINT_ACCELERATIONS[name], *(spread(one.joint_error(way)) for way in WAYS))
        for name, one in seen.items()
    ]
    return Table(
        "Fig. 9: |measured - estimated| over all 66 joint accelerations, rad/s²",
        ("task", "paper", "ours, its covariances", "ours, the noise's"),
        rows,
    )


def _truth_table(seen: dict[str, _Compared]) -> Table:
    rows = []
    for name, one in seen.items():
        for way in WAYS:
            found = one.estimates[way]
            assert found.torque_sd is not None
            error = found.torque - one.task.torque()
            cover = float(np.mean(np.abs(error) < 1.96 * found.torque_sd))
            good = 0.92 <= cover <= 0.97 if way == "noise" else None
            rows.append((name, way, float(rms(error)), f"{100.0 * cover:.1f} %", good))
    return Table(
        "Torques against the truth, which the paper could not know; 95 % bands must cover 92-97 %",
        ("task", "covariances", "RMSE, N m", "bands cover", ""),
        rows,
    )


def _wide(values: np.ndarray | tuple[float, ...]) -> list[float | str]:
    return [*map(float, values)] + [""] * (6 - len(values))


def _drawn(seen: dict[str, _Compared], link: str, title: str, unit: str) -> Figure:
    names = ("x", "y", "z") if link == "Pelvis" else ("fx", "fy", "fz", "mx", "my", "mz")
    figure, axes = panels(len(names), len(seen), title, sharex="col")
    for column, (task, one) in enumerate(seen.items()):
        t = one.time_s
        for row, name in enumerate(names):
            axis = axes[row, column]
            read = np.where(one.arrived, one.read[link][:, row], np.nan)
            axis.plot(t, read, ".", color=MEASURED, markersize=1.8, label="measured")
            ours = one.found["paper"][link][:, row]
            axis.plot(t, ours, color=ESTIMATED, linewidth=0.5, label="estimated, 2019 covariances")
            ours = one.found["noise"][link][:, row]
            axis.plot(t, ours, color=OTHER, linewidth=1.1, label="estimated, the noise's")
            axis.plot(t, one.true[link][:, row], color=TRUE, linewidth=0.7, label="truth")
            y = f"{name} ({unit if row < 3 else 'N m'})" if column == 0 else ""
            x = "time (s)" if row == len(names) - 1 else ""
            label(axis, title=task if row == 0 else "", y=y, x=x)
    legend_below(figure, axes[0, 0])
    return figure


def _joint_figure(seen: dict[str, _Compared]) -> Figure:
    title = "2019 Fig. 9: joint accelerations, norm of measured minus estimated"
    figure, axes = panels(1, len(seen), title, sharey=True, size=(11.0, 3.2))
    for axis, (task, one) in zip(axes[0], seen.items(), strict=True):
        for way, name, color in zip(WAYS, NAMES, (ESTIMATED, OTHER), strict=True):
            error = one.joint_error(way)
            axis.plot(one.time_s, error, color=color, linewidth=0.8, label=f"ours, {name}")
        mean = float(JOINT_ACCELERATIONS[task].split()[0])
        axis.axhline(mean, color=MEASURED, linestyle="--", linewidth=1.0, label="paper's mean")
        axis.set_yscale("log")
        label(axis, title=task, y="rad/s²" if task == TASKS[0] else "", x="time (s)")
    legend_below(figure, axes[0, 0])
    return figure
