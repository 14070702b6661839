"""Fig. 6 b: error against the horizon, of the hand without correction and of the joints with it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure as Picture
from numpy.typing import NDArray

from benchmarks.estimation.papers.drawing import SERIES, label, legend_below, panels
from benchmarks.figure import Figure
from benchmarks.prediction.paper_figures.experiments import (
    Design,
    Experiment,
    experiment,
    followers,
)
from prediction import Follower, Stretches, run_held_out
from prediction.chain import ReducedChain
from prediction.following.hand_path import orientation_error

Array = NDArray[np.float64]

DESIGNS: tuple[Design, ...] = ("EXP1", "EXP2")
HORIZONS_S = (0.25, 0.5, 1.0, 2.0)
#: Pieces a test is cut into, each two seconds from a measured start.
PIECES = 20
HAND = ("GP", "MI-NsGP")
JOINTS = ("MI-NsGP", "MI-NsGP, paper's", "CC-GP", "LoCov-IK", "W-IK", "Cov-IK", "minimum norm")
STYLES = ("-", "--", "-", "-", ":", "-.", ":")
COLORS = (*SERIES, "#888888")


@dataclass(frozen=True, slots=True)
class Errors:
    """Root mean squares over all pieces of all people, from the start to two seconds.

    Attributes:
        time_s: ``(T,)``.
        hand_m: By row, ``(T,)``, integrated as in the paper: no correction after a step.
        joints_deg: By row, ``(T,)``, with the correction; of the joints that were learned.
        by_person: By row, joint error at `HORIZONS_S` of each person, ``(P, 4)`` degrees.
    """

    time_s: Array
    hand_m: Mapping[str, Array]
    joints_deg: Mapping[str, Array]
    by_person: Mapping[str, Array]


def uncorrected_hand(data: Experiment, follower: Follower, pieces: Stretches) -> Array:
    """Integrates the mean law, re-aimed at every step, and returns the hand's error ``(C, T)`` m.

    Source: Vianello et al. 2021, section V-C, without its noise.
    """
    q_true, time_s = data.test.q[pieces.index], data.test.time_s[pieces.index]
    chain = ReducedChain(data.person.chain, follower.reduction, q_true[:, 0], "pose")
    position, rotation, _ = data.person.chain.forward_and_jacobian(q_true)
    q = q_true[:, 0][:, follower.reduction.kept]
    error = np.zeros(pieces.index.shape)
    for step in range(1, pieces.index.shape[1]):
        at, turned, jacobian = chain.forward_and_jacobian(q)
        turned = turned.reshape(-1, 3, 3)
        dt = (time_s[:, step] - time_s[:, step - 1])[:, None]
        missing = np.concatenate(
            [position[:, step] - at, orientation_error(rotation[:, step], turned)], axis=-1
        )
        q = q + dt * follower.predictor.predict(q, missing / dt, jacobian).mean
        reached = chain.forward_and_jacobian(q)[0]
        error[:, step] = np.linalg.norm(position[:, step] - reached, axis=-1)
    return error


def errors(design: Design, people: Sequence[tuple[str, int]]) -> Errors:
    """Rolls out every method on every person's test."""
    hand: dict[str, list[Array]] = {name: [] for name in HAND}
    joints: dict[str, list[Array]] = {name: [] for name in JOINTS}
    elapsed = np.empty(0)
    for kind, seed in people:
        data = experiment(design, kind, seed)
        pieces = Stretches.of(data.test, at_most=PIECES)
        for name, follower in followers(design, kind, seed).items():
            if name in hand:
                hand[name].append((uncorrected_hand(data, follower, pieces) ** 2).mean(axis=0))
            if name in joints:
                held = run_held_out(follower, data.test, pieces, 0, np.random.default_rng(0))
                kept = held.error[..., follower.reduction.kept]
                joints[name].append((kept**2).mean(axis=(0, 2)))
                elapsed = held.elapsed_s[0]
    columns = [int(np.argmin(np.abs(elapsed - horizon))) for horizon in HORIZONS_S]
    return Errors(
        elapsed,
        {name: np.sqrt(np.mean(rows, axis=0)) for name, rows in hand.items()},
        {name: np.degrees(np.sqrt(np.mean(rows, axis=0))) for name, rows in joints.items()},
        {name: np.degrees(np.sqrt(np.array(rows)))[:, columns] for name, rows in joints.items()},
    )


def table(design: Design, found: Errors) -> str:
    """Returns joint errors at the horizons, and each as a share of Cov-IK's over people."""
    people = len(found.by_person["Cov-IK"])
    lines = [
        f"\n{design}: joint RMSE of roll-outs, degrees, {people} people; x: geometric mean of the "
        "ratio to Cov-IK",
        f"{'':20}" + "".join(f"{horizon:>8g} s   x    " for horizon in HORIZONS_S),
    ]
    for name, rows in found.by_person.items():
        ratio = np.exp(np.log(rows / found.by_person["Cov-IK"]).mean(axis=0))
        root = np.sqrt((rows**2).mean(axis=0))
        cells = "".join(f"{r:8.2f} {x:6.2f}  " for r, x in zip(root, ratio, strict=True))
        lines.append(f"{name:20}{cells}")
    return "\n".join(lines)


def figures(design: Design, found: Errors) -> Iterator[Figure]:
    """Yields what the paper's Fig. 6 b shows, and the headline beside the baseline."""
    yield Figure(
        f"Fig. 6b, {design}: hand error after 2 s, MI-NsGP without correction",
        1e3 * float(found.hand_m["MI-NsGP"][-1]),
        "mm",
        beside=f"GP {1e3 * found.hand_m['GP'][-1]:.0f} mm",
    )
    ours, base = found.by_person["MI-NsGP"][:, 2], found.by_person["Cov-IK"][:, 2]
    yield Figure(
        f"Fig. 6b, {design}: joint RMSE at 1 s, MI-NsGP over Cov-IK",
        float(np.exp(np.log(ours / base).mean())),
        "x",
        most=1.0,
        beside=f"Cov-IK {np.sqrt((base**2).mean()):.2f} deg",
    )


def picture(found: Mapping[Design, Errors]) -> Picture:
    """Draws hand and joints for each design."""
    drawn, axes = panels(
        1,
        2 * len(found),
        "Error against the horizon, from measured starts (paper's Fig. 6b); root mean squares",
        size=(13.5, 4.2),
    )
    for number, (design, each) in enumerate(found.items()):
        hand, joints = axes[0, 2 * number], axes[0, 2 * number + 1]
        for name, color in zip(HAND, (SERIES[3], SERIES[0]), strict=True):
            hand.plot(each.time_s[1:], 1e3 * each.hand_m[name][1:], color=color)
            hand.annotate(
                name,
                (each.time_s[-1], 1e3 * each.hand_m[name][-1]),
                fontsize=8,
                ha="right",
                va="bottom",
                color=color,
            )
        hand.set_yscale("log")
        label(hand, title=f"{design}: hand, no correction after a step", x="s", y="mm")
        for index, name in enumerate(JOINTS):
            joints.plot(
                each.time_s,
                each.joints_deg[name],
                STYLES[index],
                color=COLORS[index],
                label=name if number == 0 else None,
            )
        top = 1.15 * max(
            values.max() for name, values in each.joints_deg.items() if "min" not in name
        )
        joints.set_ylim(0.0, top)
        label(joints, title=f"{design}: joints", x="s", y="degrees")
    legend_below(drawn, axes[0, 1], 7)
    return drawn
