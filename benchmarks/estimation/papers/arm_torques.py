"""2021: torques and efforts of the right arm in the T-pose, without and with 5 kg. Figs 10 and 16.

The baseline is the paper's: the ideal T-pose, at rest.
"""

import numpy as np
from matplotlib.figure import Figure

from benchmarks.estimation.papers.drawing import (
    ESTIMATED,
    MEASURED,
    OTHER,
    TRUE,
    band,
    label,
    legend_below,
    mark_interval,
    panels,
)
from benchmarks.estimation.papers.loads import ours, with_ncwe, without_ncwe
from benchmarks.estimation.papers.measuring import Measured
from benchmarks.estimation.papers.reports import Report, Table, rms
from benchmarks.estimation.papers.scenes import TPOSE, TPOSE_KG, Scenes
from benchmarks.estimation.papers.tpose_effort import JOINTS, tpose_efforts
from estimation import TPOSE_LOAD, TPOSE_NO_LOAD, Estimate, estimate, real_tree
from human import HumanModel


def experiment(scenes: Scenes) -> Report:
    """Estimates both T-poses."""
    bare, loaded = scenes.tpose_unloaded, scenes.tpose_loaded
    cases = (
        ("0 kg", bare, without_ncwe(bare, TPOSE_NO_LOAD, ()), ours(bare, ()), 0.0),
        ("5 kg", loaded, with_ncwe(loaded, TPOSE_LOAD), ours(loaded), TPOSE_KG),
    )
    rows, errors, figures = [], [], {}
    for name, task, paper, mine, load_kg in cases:
        held = task.simulated.truth.segment_id == TPOSE
        blind = _computed(task)
        ideal = tpose_efforts(scenes.model, load_kg)
        for joint, baseline in zip(JOINTS, ideal, strict=True):
            values = [
                _effort(scenes.model, joint, torque)[held].mean()
                for torque in (paper.torque, mine.torque, blind, task.torque())
            ]
            rows.append((name, joint, baseline, *map(float, values)))
        for way, found in (("the paper's", paper), ("ours", mine)):
            assert found.torque_sd is not None
            error = (found.torque - task.torque())[held]
            cover = np.mean(np.abs(error) < 1.96 * found.torque_sd[held])
            errors.append((name, way, float(rms(error)), f"{100.0 * float(cover):.1f} %"))
        stem = "2021_fig10_tpose_torques" if load_kg == 0.0 else "2021_fig16_tpose_5kg_torques"
        number = "10" if load_kg == 0.0 else "16"
        title = f"2021 Fig. {number}: right arm, T-pose with {name}; dotted: the ideal T-pose"
        figures[stem] = _figure(scenes.model, task, held, title, paper, mine, blind, ideal)
    tables = (
        Table(
            "Effort while the T-pose is held, mean, N m (L2 of a joint's three torques)",
            ("load", "joint", "ideal", "paper's way", "ours", "from the feet", "truth"),
            rows,
        ),
        Table(
            "All 66 torques in the T-pose against the truth",
            ("load", "covariances", "RMSE, N m", "95 % bands cover"),
            errors,
        ),
    )
    return Report(
        "2021 Figs 10, 16: torques of the arm in the T-pose",
        tables,
        figures,
        (
            "Without load all ways agree. With 5 kg the paper's two steps find the arm's torques, "
            "and so does one step with the noise as covariance; inverse dynamics from motion and "
            "feet alone know nothing of the hand.",
            "The paper's bands are tuning: they cover a small part of the truth.",
        ),
    )


def _computed(task: Measured) -> np.ndarray:
    """Inverse dynamics of what was measured, nothing in the hands."""
    q, v, a = task.state()
    return estimate(
        real_tree(task.model), q, v, a, list(task.sensors), method="deterministic"
    ).torque


def _dofs(model: HumanModel, joint: str) -> list[int]:
    return [model.dof_names.index(f"{joint}_rot{axis}") for axis in "xyz"]


def _effort(model: HumanModel, joint: str, torque: np.ndarray) -> np.ndarray:
    return np.linalg.norm(torque[:, _dofs(model, joint)], axis=1)


def _figure(
    model: HumanModel,
    task: Measured,
    held: np.ndarray,
    title: str,
    paper: Estimate,
    mine: Estimate,
    blind: np.ndarray,
    ideal: tuple[float, ...],
) -> Figure:
    figure, axes = panels(3, 4, title, size=(12.5, 7.0), sharex=True)
    t, true = task.time_s, task.torque()
    assert mine.torque_sd is not None
    for row, joint in enumerate(JOINTS):
        for column, dof in enumerate(_dofs(model, joint)):
            axis = axes[row, column]
            band(axis, t, mine.torque[:, dof], mine.torque_sd[:, dof], OTHER, "ours, 95 % band")
            axis.plot(t, blind[:, dof], color=MEASURED, linewidth=0.8, label="from motion and feet")
            axis.plot(
                t, paper.torque[:, dof], color=ESTIMATED, linewidth=0.8, label="the paper's way"
            )
            axis.plot(t, true[:, dof], color=TRUE, linewidth=0.7, label="truth")
            label(axis, title=f"{joint}_rot{'xyz'[column]}", y="N m" if column == 0 else "")
        axis = axes[row, 3]
        for torque, color, wide in (
            (mine.torque, OTHER, 1.4),
            (blind, MEASURED, 0.8),
            (paper.torque, ESTIMATED, 0.8),
            (true, TRUE, 0.7),
        ):
            axis.plot(t, _effort(model, joint, torque), color=color, linewidth=wide)
        axis.axhline(ideal[row], color="#666666", linestyle=":", linewidth=1.5)
        label(axis, title=f"{joint} effort")
    for axis in axes.flat:
        mark_interval(axis, t, held)
    for axis in axes[-1]:
        axis.set_xlabel("time (s)", fontsize=8)
    legend_below(figure, axes[0, 0])
    return figure
