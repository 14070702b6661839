"""2019, Fig. 6 and Algorithm 1: which feet stand, and how fast the base moves by that."""

import numpy as np
from matplotlib.figure import Figure

from benchmarks.estimation.papers.drawing import (
    ESTIMATED,
    MEASURED,
    TRUE,
    label,
    legend_below,
    panels,
)
from benchmarks.estimation.papers.measuring import FEET, Measured, foot_wrenches
from benchmarks.estimation.papers.reports import Report, Table
from benchmarks.estimation.papers.scenes import Scenes
from estimation import Contact, Contacts, base_velocity, classify_by_force
from human import forward_kinematics

LEVELS = ("left", "double", "right")


def experiment(scenes: Scenes) -> Report:
    """Classifies T1 to T4 by the vertical forces of the shoes."""
    rows, drawn = [], {}
    for name, task in scenes.tasks.items():
        force = _vertical(task)
        truth = task.simulated.truth
        feet = truth.dynamics.feet
        assert feet is not None
        # A foot that rests without bearing anything cannot be found by force.
        loaded = (
            np.stack([feet[0, :, 2], feet[1, :, 2]], axis=1)
            > 0.02 * feet[..., 2].sum(axis=0)[:, None]
        )
        ways = {"Algorithm 1 as printed": as_printed(force), "ours": classify_by_force(force)}
        drawn[name] = (task, loaded, ways)
        for way, found in ways.items():
            right = float(np.mean(np.all(found.feet == loaded, axis=1)))
            error = _base_error(task, found)
            good = right >= 0.98 if way == "ours" else None
            rows.append((name, way, f"{100.0 * right:.1f} %", error, good))
    table = Table(
        "Frames classified as the feet are loaded (at least 98 %), and the base velocity that "
        "follows by eq. 8-10",
        ("task", "rule", "right", "base error, m/s", ""),
        rows,
    )
    notes = (
        "Algorithm 1 holds |fR - fL| against the mean of fR + fL, which is body weight; in single "
        "support the difference is body weight, too, so noise decides. Ours holds it against a "
        "share of each frame's own sum.",
    )
    return Report(
        "2019 Fig. 6, Algorithm 1: contacts",
        (table,),
        {"2019_fig06_contacts": _figure(drawn)},
        notes,
    )


def as_printed(force: np.ndarray) -> Contacts:
    """Algorithm 1 of the paper to the letter.

    Args:
        force: ``T x 2`` N, upwards, right and left.
    """
    difference = force[:, 0] - force[:, 1]
    double = np.abs(difference) <= force.sum(axis=1).mean()
    return Contacts(np.stack([double | (difference > 0.0), double | (difference <= 0.0)], axis=-1))


def _vertical(task: Measured) -> np.ndarray:
    """Vertical forces ``T x 2`` N that the shoes read, lost frames repeating the last."""
    poses = forward_kinematics(task.model, task.simulated.motion.q)
    read, _ = foot_wrenches(task)
    up = [
        np.einsum("tj,tj->t", poses.of(name)[0][:, 2, :], wrench[:, :3])
        for name, wrench in zip(FEET, read, strict=True)
    ]
    return np.stack(up, axis=1)


def _base_error(task: Measured, found: Contacts) -> float:
    motion = task.simulated.motion
    feet = [Contact("RightFoot", active=found.right), Contact("LeftFoot", active=found.left)]
    moved = base_velocity(task.model, motion.q, motion.joint_rates, feet, allow_unsupported=True)
    assert motion.v is not None
    apart = moved.twist_body[moved.supported, :3] - motion.v[moved.supported, :3]
    return float(np.sqrt(np.mean(apart**2)))


def _figure(drawn: dict[str, tuple[Measured, np.ndarray, dict[str, Contacts]]]) -> Figure:
    figure, axes = panels(len(drawn), 1, "2019 Fig. 6: which feet stand", size=(9.0, 6.5))
    for axis, (name, (task, loaded, ways)) in zip(axes[:, 0], drawn.items(), strict=True):
        axis.plot(task.time_s, _level(loaded), color=TRUE, linewidth=2.2, label="truly loaded")
        for (way, found), color, shift in zip(
            ways.items(), (MEASURED, ESTIMATED), (-0.12, 0.12), strict=True
        ):
            level = _level(found.feet) + shift
            axis.plot(task.time_s, level, color=color, linewidth=0.8, label=way)
        axis.set_yticks([0, 1, 2], LEVELS)
        axis.set_ylim(-0.4, 2.4)
        label(axis, title=name, x="time (s)" if name == "T4" else "")
    legend_below(figure, axes[0, 0])
    return figure


def _level(feet: np.ndarray) -> np.ndarray:
    return np.where(feet.all(axis=1), 1.0, np.where(feet[:, 0], 2.0, 0.0))
