"""2021, section IV-C2: 5 kg in the right hand, found without and with NCWE. Figs 11 to 15.

The paper's case against one step is held against one step whose accelerations are not zero.
"""

import numpy as np
from matplotlib.figure import Figure

from benchmarks.estimation.papers.drawing import (
    ESTIMATED,
    MEASURED,
    OTHER,
    SERIES,
    TRUE,
    label,
    legend_below,
    log_sweep,
    mark_interval,
    panels,
)
from benchmarks.estimation.papers.loads import (
    BOTH,
    G,
    hand_wrenches,
    mass_kg,
    ours,
    swept,
    with_ncwe,
    without_ncwe,
)
from benchmarks.estimation.papers.measuring import Measured
from benchmarks.estimation.papers.reports import Report, Table, rms
from benchmarks.estimation.papers.scenes import TPOSE, TPOSE_KG, Scenes
from estimation import TPOSE_LOAD, Estimate, payload

RIGHT = BOTH[:1]
SWEEP = (1e-4, 1e-2, 1.0, 1e2, 1e4)
#: Fig. 15, without NCWE; those with NCWE are in the picture only.
PAPER_KG = (0.14, 1.24, 6.57, 17.01, 37.13)
NAMES = ("fx", "fy", "fz", "mx", "my", "mz")
ZEROS = "one step, zeros fed as accelerations"
ONE, TWO = "one step, accelerations measured", "two steps (NCWE)"
_Sweep = dict[str, list[Estimate]]


def experiment(scenes: Scenes) -> Report:
    """Sweeps the covariance of the right hand's force in three ways."""
    task = scenes.tpose_loaded
    held = task.simulated.truth.segment_id == TPOSE
    presets = [swept(TPOSE_LOAD, value) for value in SWEEP]
    found: _Sweep = {
        ZEROS: [without_ncwe(task, preset, accelerations=False) for preset in presets],
        ONE: [without_ncwe(task, preset) for preset in presets],
        TWO: [with_ncwe(task, preset) for preset in presets],
    }
    mine = ours(task)
    masses = {
        way: [float(mass_kg(one, RIGHT)[held].mean()) for one in sweep]
        for way, sweep in found.items()
    }
    rows = [
        (f"{value:g}", PAPER_KG[k], *(masses[way][k] for way in (ZEROS, ONE, TWO)))
        for k, value in enumerate(SWEEP)
    ]
    mine_kg = float(mass_kg(mine, RIGHT)[held].mean())
    rows.append(("the noise's", "", "", mine_kg, ""))
    tables = (
        Table(
            "Fig. 15: object mass (norm of the force over g), mean over the T-pose, kg; truly 5",
            ("hand force", "paper, no NCWE", "zeros fed", "accelerations measured", "NCWE"),
            rows,
        ),
        _exact(scenes),
        _noisy(task, held, found, mine),
    )
    return Report(
        "2021 Figs 11-15: T-pose with 5 kg, covariance of the hand",
        tables,
        {
            "2021_fig11_hands_without_ncwe": _wrench_figure(
                task, held, found, (ZEROS, ONE), "2021 Fig. 11: hands without NCWE (world axes)"
            ),
            "2021_fig12_mass_without_ncwe": _mass_figure(
                task, held, found, (ZEROS, ONE), "2021 Fig. 12: object mass without NCWE"
            ),
            "2021_fig13_hands_with_ncwe": _wrench_figure(
                task, held, found, (TWO,), "2021 Fig. 13: hands with NCWE (world axes)"
            ),
            "2021_fig14_mass_with_ncwe": _mass_figure(
                task, held, found, (TWO,), "2021 Fig. 14: object mass with NCWE", mine
            ),
            "2021_fig15_mass_by_covariance": _summary(masses, mine_kg),
        },
        (
            "The paper finds that one step cannot find a payload: its mass grows with the "
            "covariance without end. That is what zeros in place of the accelerations do: the body "
            "seems to fall freely, and the free hand must bear what the plates push. With "
            "measured accelerations the same equations and covariances stop at 5 kg.",
            "NCWE needs accelerations, too, for the rate of change of momentum; with those, the "
            "first step is not needed.",
            "The text of the paper gives the hand's moments a covariance of 1e4, its Table 1 1e-4; "
            "with 1e4 any force can be traded for a moment. The table's is used.",
        ),
    )


def _exact(scenes: Scenes) -> Table:
    """Bars that are about exact readings."""
    task = scenes.tpose_exact
    rows = []
    for way, found in (
        (TWO, with_ncwe(task, TPOSE_LOAD)),
        ("one step, hand force 1e2", without_ncwe(task, swept(TPOSE_LOAD, 1e2))),
        ("one step, the noise's", ours(task)),
    ):
        error = float(rms(found.torque - task.torque()))
        carried = task.simulated.truth.load_kg["RightHandCOM"] > 0.999 * TPOSE_KG
        kg = float(payload(found).mass_kg[carried].mean())
        rows.append((way, error, error <= 0.02, f"{kg:.4f}", abs(kg - TPOSE_KG) <= 0.02))
    return Table(
        "Exact readings: torque RMSE at most 0.02 N m, 5 kg within 0.02 kg",
        ("way", "torque RMSE, N m", "", "inertial payload, kg", ""),
        rows,
    )


def _noisy(task: Measured, held: np.ndarray, found: _Sweep, mine: Estimate) -> Table:
    rows = []
    best = SWEEP.index(1.0)
    for way, one in ((TWO, found[TWO][best]), (ONE, found[ONE][best + 1]), ("ours", mine)):
        assert one.torque_sd is not None
        error = one.torque - task.torque()
        kg = payload(one)
        assert kg.sd_kg is not None
        cover = float(np.mean(np.abs(error) < 1.96 * one.torque_sd))
        rows.append(
            (
                way,
                float(rms(error)),
                f"{100.0 * cover:.1f} %",
                f"{kg.mass_kg[held].mean():.3f} ± {kg.mass_kg[held].std():.3f}",
                float(kg.sd_kg[held].mean()),
            )
        )
    return Table(
        "Noisy readings: torques over the whole motion; inertial payload in the T-pose, kg",
        ("way", "torque RMSE, N m", "95 % bands cover", "payload, sd over frames", "stated sd"),
        rows,
    )


def _wrench_figure(
    task: Measured, held: np.ndarray, found: _Sweep, ways: tuple[str, ...], title: str
) -> Figure:
    columns = [(way, site) for way in ways for site in reversed(BOTH)]
    size = (4.2 * len(columns) + 0.5, 10.0)
    figure, axes = panels(6, len(columns), title, size=size, sharex=True)
    load = task.simulated.truth.dynamics.hands["RightHandCOM"]
    for column, (way, site) in enumerate(columns):
        for one, text, color in zip(found[way], log_sweep(SWEEP), SERIES, strict=False):
            (wrench,) = hand_wrenches(one, (site,))
            for row in range(6):
                axis = axes[row, column]
                axis.plot(task.time_s, wrench[:, row], color=color, linewidth=0.8, label=text)
        for row, name in enumerate(NAMES):
            axis = axes[row, column]
            true = load[:, row] if site == RIGHT[0] and row < 3 else np.zeros(len(task.time_s))
            axis.plot(task.time_s, true, color=TRUE, linewidth=0.9, linestyle="--", label="truth")
            mark_interval(axis, task.time_s, held)
            unit = "N" if row < 3 else "N m"
            hand = "left hand" if site.startswith("Left") else "right hand"
            label(
                axis,
                title=f"{hand}: {way}" if row == 0 else "",
                y=f"{name} ({unit})" if column == 0 else "",
                x="time (s)" if row == 5 else "",
            )
    legend_below(figure, axes[0, 0], 6)
    return figure


def _mass_figure(
    task: Measured,
    held: np.ndarray,
    found: _Sweep,
    ways: tuple[str, ...],
    title: str,
    mine: Estimate | None = None,
) -> Figure:
    columns = len(ways) + (mine is not None)
    figure, axes = panels(1, columns, title, size=(5.5 * columns + 1.0, 3.8))
    force = task.simulated.truth.dynamics.hands["RightHandCOM"]
    true = np.linalg.norm(force, axis=1) / G
    # Those that agree lie upon each other: the later, the thinner.
    widths = np.linspace(3.5, 0.6, len(SWEEP))
    for axis, way in zip(axes[0], ways, strict=False):
        sweep = zip(found[way], log_sweep(SWEEP), SERIES, widths, strict=False)
        for one, text, color, width in sweep:
            axis.plot(task.time_s, mass_kg(one, RIGHT), color=color, linewidth=width, label=text)
        label(axis, title=way, y="kg", x="time (s)")
    if mine is not None:
        axis, held_kg = axes[0, -1], payload(mine, "norm", (0.025, 0.5, 0.975)).quantiles_kg
        assert held_kg is not None
        low, high = held_kg[:, 0], held_kg[:, 2]
        axis.fill_between(task.time_s, low, high, color=OTHER, alpha=0.35, linewidth=0.0)
        axis.plot(task.time_s, held_kg[:, 1], color=OTHER, linewidth=0.7)
        label(axis, title="one step, the noise's; median and 95 % band", y="kg", x="time (s)")
    for axis in axes[0]:
        axis.plot(task.time_s, true, color=TRUE, linewidth=0.9, linestyle="--", label="truth")
        mark_interval(axis, task.time_s, held)
    legend_below(figure, axes[0, 0], 7)
    return figure


def _summary(masses: dict[str, list[float]], mine_kg: float) -> Figure:
    title = "2021 Fig. 15: object mass by the covariance of the hand's force"
    figure, axes = panels(1, 1, title, size=(6.5, 4.4))
    axis = axes[0, 0]
    axis.plot(SWEEP, PAPER_KG, "s--", color=MEASURED, label="paper, without NCWE")
    for way, color, mark in ((ZEROS, SERIES[1], "o-"), (ONE, ESTIMATED, "o-"), (TWO, OTHER, "^-")):
        axis.plot(SWEEP, masses[way], mark, color=color, markersize=5, label=f"ours, {way}")
    axis.axhline(TPOSE_KG, color=TRUE, linestyle=":", label="truth, 5 kg")
    text = f"ours, one step, the noise's: {mine_kg:.2f} kg"
    axis.plot([SWEEP[-1]], [mine_kg], "*", color="black", markersize=11, label=text)
    axis.set_xscale("log")
    label(axis, y="kg", x="covariance of the hand's force (N²)")
    axis.legend(fontsize=8, frameon=False)
    return figure
