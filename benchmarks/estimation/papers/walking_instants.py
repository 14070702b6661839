"""2021, Fig. 19: moments of the walk with 9.55 kg, hands' forces and efforts on the body."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from benchmarks.estimation.papers.carrying import Carried, carried, supports
from benchmarks.estimation.papers.drawing import ESTIMATED, MEASURED, label, panels
from benchmarks.estimation.papers.loads import BOTH, hand_forces
from benchmarks.estimation.papers.measuring import FEET
from benchmarks.estimation.papers.reports import Report, Table
from benchmarks.estimation.papers.scenes import Scenes
from estimation import JointEfforts, joint_efforts
from human import HumanModel, forward_kinematics

#: Metres drawn for a newton.
_SCALE = 1.0 / 1500.0
_HIGHEST_NM = 150.0
_LEGS = ("Hip", "Knee", "Ankle")


def experiment(scenes: Scenes) -> Report:
    """Picks four moments and draws the body from the right."""
    one = carried(scenes.carrying)
    moments = _moments(one)
    efforts = joint_efforts(one.mine)
    rows = []
    for name, frame in moments.items():
        sides = [
            [
                float(efforts.effort_nm[frame, efforts.joint_names.index(f"j{side}{part}")])
                for part in _LEGS
            ]
            for side in ("Left", "Right")
        ]
        trunk = float(efforts.effort_nm[frame, efforts.joint_names.index("jL5S1")])
        kg = float(one.held.mass_kg[frame])
        legs = [" / ".join(f"{x:.0f}" for x in side) for side in sides]
        rows.append((name, float(one.truth[frame]), kg, *legs, trunk))
    table = Table(
        "Object mass, kg, and efforts, N m (one step, the noise's); hip / knee / ankle",
        ("moment", "truth", "estimated", "left leg", "right leg", "L5S1"),
        rows,
    )
    notes = ("the leg that stands works harder, and the load is seen through every change of feet",)
    return Report(
        "2021 Fig. 19: moments of walking with 9.55 kg",
        (table,),
        {"2021_fig19_walking_moments": _figure(scenes.model, one, moments, efforts)},
        notes,
    )


def _moments(one: Carried) -> dict[str, int]:
    """Frames in the middle of each phase."""
    phases = {phase: np.flatnonzero(frames) for phase, frames in supports(one).items()}
    first_step = min(phases["loaded, left foot"][0], phases["loaded, right foot"][0])
    standing = phases["loaded, both feet"]
    return {
        "unloaded": int(phases["unloaded"][0]),
        "loaded, standing": int(standing[standing < first_step][-20]),
        "walking, left foot": _middle(phases["loaded, left foot"]),
        "walking, right foot": _middle(phases["loaded, right foot"]),
    }


def _middle(frames: np.ndarray) -> int:
    return int(frames[len(frames) // 2])


def _figure(
    model: HumanModel, one: Carried, moments: dict[str, int], efforts: JointEfforts
) -> Figure:
    title = "2021 Fig. 19: seen from the right; blue: load on the hands (x 3), orange: ground"
    figure, axes = panels(1, len(moments), title, size=(12.0, 4.4), sharey=True)
    norm = Normalize(0.0, _HIGHEST_NM)
    for axis, (name, frame) in zip(axes[0], moments.items(), strict=True):
        _body(axis, model, one, frame, efforts, norm)
        kg = one.held.mass_kg[frame]
        label(axis, title=f"{name}\nestimated {kg:.2f} kg, truth {one.truth[frame]:.2f} kg")
        axis.set_xlabel("x (m)", fontsize=8)
        axis.set_aspect("equal")
    axes[0, 0].set_ylabel("z (m)", fontsize=8)
    bar = figure.colorbar(ScalarMappable(norm, "viridis"), ax=axes[0, -1], shrink=0.8, extend="max")
    bar.set_label("joint effort (N m)", fontsize=8)
    return figure


def _body(
    axis: Axes, model: HumanModel, one: Carried, frame: int, efforts: JointEfforts, norm: Normalize
) -> None:
    poses = forward_kinematics(model, one.task.simulated.motion.q[[frame]])
    at = {name: poses.of(name)[1][0, [0, 2]] for name in model.segment_names}
    bones = [
        (at[model.segment_names[parent]], at[name])
        for name, parent in zip(model.segment_names[1:], model.parents[1:], strict=True)
    ]
    axis.add_collection(LineCollection(bones, colors="#888888", linewidths=2.0))
    children = {joint: model.segment_names[k + 1] for k, joint in enumerate(model.joint_names)}
    points = np.array([at[children[name]] for name in efforts.joint_names])
    axis.scatter(
        points[:, 0],
        points[:, 1],
        c=efforts.effort_nm[frame],
        norm=norm,
        cmap="viridis",
        s=34,
        zorder=3,
        edgecolors="black",
        linewidths=0.4,
    )
    hands = hand_forces(one.mine, BOTH)[:, frame]
    for site, force in zip(BOTH, hands, strict=True):
        _arrow(axis, at[site.removesuffix("COM")], force, ESTIMATED)
    feet = one.task.simulated.truth.dynamics.feet
    assert feet is not None
    for name, wrench in zip(FEET, feet[:, frame], strict=True):
        _arrow(axis, at[name], wrench[:3], MEASURED)
    middle = at["Pelvis"][0]
    axis.set_xlim(middle - 0.7, middle + 0.9)
    axis.set_ylim(-0.05, 1.95)


def _arrow(axis: Axes, start: np.ndarray, force: np.ndarray, color: str) -> None:
    if np.linalg.norm(force) < 5.0:
        return
    way = _SCALE * force[[0, 2]] * (3.0 if color == ESTIMATED else 1.0)
    axis.annotate(
        "",
        tuple(start + way),
        tuple(start),
        arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 1.8, "shrinkA": 0},
        zorder=4,
    )
