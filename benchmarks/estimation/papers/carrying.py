"""2021, section IV-C3: 9.55 kg in both hands, balancing and walking, on shoes. Figs 17 and 18."""

from dataclasses import dataclass

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
    panels,
    shade_supports,
)
from benchmarks.estimation.papers.loads import BOTH, G, hand_forces, mass_kg, ours, with_ncwe
from benchmarks.estimation.papers.measuring import FEET, Measured, foot_wrenches
from benchmarks.estimation.papers.reports import Report, Table, rms
from benchmarks.estimation.papers.scenes import CARRIED_KG, Scenes
from estimation import APPLICATION, Estimate, Payload, payload
from human import forward_kinematics

#: Before anything moves.
FIRST_FRAMES = 5
PAPER = "two steps (NCWE)"
WEIGHT = "two steps, momentum from weight alone"


@dataclass(frozen=True, slots=True)
class Carried:
    """One scenario: estimates, and the object's mass in every way, kg.

    Attributes:
        task: the readings.
        paper: the two steps with the application's covariances.
        mine: one step with the noise as covariance.
        held: the payload of ``mine``.
        mass: way to ``T`` kg.
        truth: ``T`` kg.
    """

    task: Measured
    paper: Estimate
    mine: Estimate
    held: Payload
    mass: dict[str, np.ndarray]
    truth: np.ndarray


def experiment(scenes: Scenes) -> Report:
    """Estimates both scenarios."""
    balancing, walking = carried(scenes.balancing), carried(scenes.carrying)
    names = {"quasi-static": balancing, "walking": walking}
    return Report(
        "2021 Figs 17, 18: 9.55 kg in both hands, through changes of support",
        (_table(names), _bars(names)),
        {
            "2021_fig17_quasi_static": _figure(
                balancing, "2021 Fig. 17: takes 9.55 kg, stands on the left foot, then the right"
            ),
            "2021_fig18_walking": _figure(walking, "2021 Fig. 18: takes 9.55 kg and walks"),
        },
        (
            "The rise of the feet's force finds the load at rest and swings with every step, "
            "since a body that goes up and down pushes as a load does. The balance with the "
            "whole rate of change of momentum does not; with the weight alone, as published "
            "software has it, it swings the same.",
            "Only the sum of both hands' forces is known: six equations for twelve numbers. Half "
            "and half, as both methods say, is what the covariances say, and true here by "
            "construction.",
            "Frames in which a shoe's sensor was lost are left out of the table: two steps take "
            "the last reading for true; in one step their band is as wide as ignorance is.",
        ),
    )


def carried(task: Measured) -> Carried:
    """Estimates one scenario in every way."""
    paper, mine = with_ncwe(task, APPLICATION, BOTH), ours(task, BOTH)
    held = payload(mine, "inertial", (0.025, 0.5, 0.975))
    alone = with_ncwe(task, APPLICATION, BOTH, accelerations=False)
    mass = {
        "rise of the feet's force": _rise(task),
        WEIGHT: mass_kg(alone, BOTH),
        PAPER: mass_kg(paper, BOTH),
        "one step, the noise's": held.mass_kg,
    }
    truth = np.sum(list(task.simulated.truth.load_kg.values()), axis=0)
    return Carried(task, paper, mine, held, mass, truth)


def supports(one: Carried) -> dict[str, np.ndarray]:
    """Returns the frames of each phase in which every sensor of the feet arrived."""
    truth = one.task.simulated.truth
    right, left, ok = truth.contact_right, truth.contact_left, one.task.feet_arrived
    loaded = one.truth > 0.999 * CARRIED_KG
    return {
        "unloaded": (one.truth < 1e-3) & ok,
        "loaded, both feet": loaded & right & left & ok,
        "loaded, left foot": loaded & left & ~right & ok,
        "loaded, right foot": loaded & right & ~left & ok,
    }


def _rise(task: Measured) -> np.ndarray:
    """The paper's other mass: how much the feet's force has grown since the first stance, kg."""
    poses = forward_kinematics(task.model, task.simulated.motion.q)
    read, _ = foot_wrenches(task)
    force = sum(
        np.einsum("tij,tj->ti", poses.of(name)[0], wrench[:, :3])
        for name, wrench in zip(FEET, read, strict=True)
    )
    before = np.mean(force[:FIRST_FRAMES], axis=0)
    return np.linalg.norm(force - before, axis=1) / G


def _table(names: dict[str, Carried]) -> Table:
    rows = []
    for name, one in names.items():
        for k, (phase, frames) in enumerate(supports(one).items()):
            cells = [f"{x[frames].mean():.2f} ± {x[frames].std():.2f}" for x in one.mass.values()]
            rows.append((name if k == 0 else "", phase, float(one.truth[frames].mean()), *cells))
    return Table(
        "Object mass, mean ± sd over the frames, kg (norm of the force over g; ours: inertial)",
        ("scenario", "phase", "truth", *names["walking"].mass),
        rows,
    )


def _bars(names: dict[str, Carried]) -> Table:
    rows: list[tuple[object, ...]] = []
    for name, one in names.items():
        frames = np.any(
            [frames for phase, frames in supports(one).items() if phase != "unloaded"], axis=0
        )
        assert one.held.sd_kg is not None and one.held.quantiles_kg is not None
        for way, found in ((PAPER, one.paper), ("one step, the noise's", one.mine)):
            kg = payload(found).mass_kg[frames]
            error = float(rms((found.torque - one.task.torque())[frames]))
            rows.append(
                (
                    name,
                    way,
                    f"{kg.mean():.2f} ± {kg.std():.2f}",
                    abs(float(kg.mean()) - CARRIED_KG) <= 0.3,
                    float(one.held.sd_kg[frames].mean()) if found is one.mine else "",
                    error,
                )
            )
        low, high = one.held.quantiles_kg[:, 0], one.held.quantiles_kg[:, 2]
        inside = np.mean(((low < one.truth) & (one.truth < high))[frames])
        rows.append((name, "its 95 % band of the payload covers", f"{100 * inside:.0f} %"))
    width = 6
    return Table(
        "Both hands' sum, inertial, kg (9.55 ± 0.3); torques while loaded, N m",
        ("scenario", "way", "payload", "", "stated sd", "torque RMSE"),
        [(*row, *[""] * (width - len(row))) for row in rows],
    )


def _figure(one: Carried, title: str) -> Figure:
    figure, axes = panels(3, 1, title, size=(10.5, 8.5), sharex=True)
    task, t = one.task, one.task.time_s
    truth = task.simulated.truth
    for axis in axes[:, 0]:
        shade_supports(axis, t, truth.contact_right, truth.contact_left)
    lost = ~task.feet_arrived
    for axis, site, force in zip(axes[:2, 0], BOTH, hand_forces(one.paper, BOTH), strict=True):
        for k, (name, color) in enumerate(zip("xyz", SERIES, strict=False)):
            shown = np.where(lost, np.nan, force[:, k])
            axis.plot(t, shown, color=color, linewidth=0.8, label=f"f{name}, NCWE")
            true = truth.dynamics.hands[site][:, k]
            text = "truth" if k == 2 else None
            axis.plot(t, true, color=TRUE, linewidth=0.8, linestyle="--", label=text)
        hand = "right hand" if site.startswith("Right") else "left hand"
        label(axis, title=f"{hand}, force in world axes; measured as zero", y="N")
        axis.legend(fontsize=8, ncols=4, frameon=False, loc="center right")
    axis = axes[2, 0]
    colors = ("#CC79A7", MEASURED, ESTIMATED, OTHER)
    assert one.held.quantiles_kg is not None
    low, high = (np.where(lost, np.nan, one.held.quantiles_kg[:, k]) for k in (0, 2))
    axis.fill_between(
        t, low, high, color=OTHER, alpha=0.3, linewidth=0.0, label="one step, its 95 % band"
    )
    for (way, mass), color in zip(one.mass.items(), colors, strict=True):
        axis.plot(t, np.where(lost, np.nan, mass), color=color, linewidth=0.8, label=way)
    axis.plot(t, one.truth, color=TRUE, linewidth=1.2, linestyle="--", label="truth")
    axis.set_ylim(-1.0, 25.0)
    label(axis, title="object mass; shaded: single support", y="kg", x="time (s)")
    legend_below(figure, axis, 3)
    return figure
