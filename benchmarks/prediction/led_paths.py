"""A trained operator led along hand paths that people really drew with a robot.

Run ``python -m benchmarks.prediction.led_paths [FOLDER] [--full]``; without FOLDER the recordings
are those of the environment variable ``ERGOCAST_RECORDINGS``.

``panda_comanipulation`` holds the end-effector of a Franka Panda that people guided by hand over a
horizontal plane, 0.1 by 0.15 m, at most 0.16 m/s, about 1 kHz. Nobody's joints were recorded, nor
where the person stood, nor the time stamps: this shows that real led motion is followed, how
exactly and how familiar it is taken to be, and says nothing of whether the postures are right.
Assumed: the plane stays horizontal, the drawing begins where the operator's hand was led before,
the robot stands in one of four directions; time from the recorded speed.
"""

import argparse
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.figure import Figure, shown
from human import Subject, generate_model
from human.simulate import operator, robot_trajectories, simulate_following
from prediction import (
    Demonstrations,
    OperatorModel,
    Rollout,
    TrainingOptions,
    TrajectoryError,
    demonstrations_from_motion,
    join,
    led_chain,
    train_operator,
)

Array = NDArray[np.float64]

FILE = "panda_comanipulation/symbol17_rec0-3.npz"
RATE_HZ = 30.0
#: Slower, the ratio of way to speed says little of the time between two samples, m/s.
MOVING_M_S = 0.03
HEADINGS_DEG = (0.0, 90.0, 180.0, 270.0)
#: How far away from where the operator was led a path is put to see that it is told, m.
ELSEWHERE_M = (-0.25, 0.1, 0.25)
OUT_OF_REACH_M = (1.0, 0.0, 0.0)
SAMPLES, SEED = 50, 5
HAND_BAR_MM = 0.2
LED = 8


@dataclass(frozen=True, slots=True)
class DrawnPath:
    """What a person drew with the robot.

    Attributes:
        name: Of the recording.
        time_s: ``(T,)`` s, from the recorded speed.
        position: ``(T, 3)`` m, robot axes, from its first point.
    """

    name: str
    time_s: Array
    position: Array


def drawn_paths(file: Path) -> list[DrawnPath]:
    """Reads positions and speeds, and thins them to `RATE_HZ`."""
    out = []
    with np.load(file) as arrays:
        for name in sorted(key.removesuffix("_pos") for key in arrays if key.endswith("_pos")):
            position = arrays[f"{name}_pos"].astype(np.float64)
            speed = np.linalg.norm(arrays[f"{name}_vel"], axis=1)[1:]
            way = np.linalg.norm(np.diff(position, axis=0), axis=1)
            moving = speed > MOVING_M_S
            step = float(np.median(way[moving] / speed[moving]))
            kept = np.arange(0, len(position), round(1.0 / (RATE_HZ * step)))
            drawn: Array = np.asarray(kept * step, dtype=np.float64)
            out.append(DrawnPath(name, drawn, position[kept] - position[0]))
    return out


def trained(kind: str = "average") -> tuple[OperatorModel, Demonstrations]:
    """Trains a simulated operator on led ways, for the position of the hand alone."""
    model = generate_model(Subject(1.75, 72.0))
    rng = np.random.default_rng(SEED)
    person = operator(kind, rng, model)
    scene = robot_trajectories(model, person, rng, count=LED)
    chain = led_chain(model)
    takes = []
    for number, way in enumerate(scene.trajectories):
        motion = simulate_following(
            model, person, way.path(), rng, q_start=scene.q_start, rate_hz=RATE_HZ
        ).motion
        takes.append(
            demonstrations_from_motion(chain, motion, trajectory_id=number, rate_hz=RATE_HZ)
        )
    led = join(takes)
    options = TrainingOptions(tasks=("position",), optimizer="gradient")
    return train_operator(chain, led, seed=SEED, options=options), led


def turned(position: Array, heading_deg: float) -> Array:
    """Returns positions turned about the vertical."""
    c, s = np.cos(np.radians(heading_deg)), np.sin(np.radians(heading_deg))
    return np.asarray(position @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))


def start_posture(model: OperatorModel, led: Demonstrations, offset: Array) -> Array:
    """Returns the demonstrated posture whose hand is nearest to their middle, moved by an offset.

    The hand is brought there by the model itself, along a straight line of three seconds.
    """
    position, _, _ = model.chain.forward_and_jacobian(led.q)
    middle = position.mean(axis=0)
    q0 = led.q[int(np.argmin(np.linalg.norm(position - middle, axis=1)))]
    if not offset.any():
        return np.asarray(q0)
    start, _, _ = model.chain.forward_and_jacobian(q0)
    share = np.linspace(0.0, 1.0, 91)[:, None]
    way = start + share * offset
    rng = np.random.default_rng(SEED)
    return np.asarray(model.rollout(way, None, 3.0 * share[:, 0], q0, 0, rng).central[-1])


def follow(model: OperatorModel, path: DrawnPath, heading_deg: float, q0: Array) -> Rollout:
    """Leads the operator along a drawn path from a posture.

    Raises:
        TrajectoryError: The hand cannot follow.
    """
    start, _, _ = model.chain.forward_and_jacobian(q0)
    way = start + turned(path.position, heading_deg)
    rng = np.random.default_rng(SEED)
    return model.rollout(way, None, path.time_s, q0, SAMPLES, rng)


def figures(folder: Path, full: bool = False) -> Iterator[Figure]:
    """Leads the operator along every drawn path and yields the figures.

    Args:
        folder: The recordings.
        full: From all four directions; from one otherwise.
    """
    paths = drawn_paths(folder / FILE)
    model, led = trained()
    print(f"operator: simulated, {len(led)} samples of {LED} led ways; uses {model.method}")
    print(f"  {'':8}{'deg':>5}{'s':>7}{'m/s max':>9}{'hand mm mean/max':>20}{'width deg':>11}"
          f"{'familiar':>10}{'elsewhere':>11}")  # fmt: skip
    near, far = (start_posture(model, led, np.array(o)) for o in ((0.0, 0.0, 0.0), ELSEWHERE_M))
    errors, known, unknown, unreached = [], [], [], 0
    for path in paths:
        for heading in HEADINGS_DEG if full else HEADINGS_DEG[:1]:
            try:
                run, away = (follow(model, path, heading, q0) for q0 in (near, far))
            except TrajectoryError as error:
                print(f"  {path.name:8}{heading:5.0f}  {error}")
                unreached += 1
                continue
            speed = np.linalg.norm(np.diff(path.position, axis=0), axis=1) / np.diff(path.time_s)
            low, high = np.quantile(run.q[:, -1], [0.05, 0.95], axis=0)
            errors += [run.hand_error_m.mean(), away.hand_error_m.mean()]
            known.append(run.familiarity.mean())
            unknown.append(away.familiarity.mean())
            print(
                f"  {path.name:8}{heading:5.0f}{path.time_s[-1]:7.2f}{speed.max():9.3f}"
                f"{1e3 * run.hand_error_m.mean():12.4f} / {1e3 * run.hand_error_m.max():.3f}"
                f"{np.degrees(high - low).mean():11.2f}{known[-1]:10.2f}{unknown[-1]:11.2f}"
            )
    refused = 0
    for path in paths:
        beyond = DrawnPath(path.name, path.time_s, path.position + np.linspace(
            0.0, 1.0, len(path.position))[:, None] * OUT_OF_REACH_M)  # fmt: skip
        try:
            follow(model, beyond, 0.0, near)
        except TrajectoryError:
            refused += 1
    asked = len(paths) * (len(HEADINGS_DEG) if full else 1)
    yield Figure(
        "robot paths drawn by people: mean hand error, worst path", 1e3 * max(errors), "mm",
        most=HAND_BAR_MM, beside="1.2-1.9 mm without the correction",
    )  # fmt: skip
    yield Figure("robot paths drawn by people: followed", asked - unreached, "of them", least=asked)
    yield Figure("robot paths drawn out of reach: refused", refused, "of them", least=len(paths))
    yield Figure(
        "robot paths drawn by people: familiarity where led before, less elsewhere",
        float(np.mean(known) - np.mean(unknown)), least=0.1,
        beside=f"{np.mean(known):.2f} and {np.mean(unknown):.2f} elsewhere",
    )  # fmt: skip


def main() -> None:
    """Runs everything."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--full", action="store_true", help="from four directions")
    options = parser.parse_args()
    folder = options.folder or os.environ.get("ERGOCAST_RECORDINGS")
    if not folder:
        parser.error("give the folder of recordings, or set ERGOCAST_RECORDINGS to it")
    sys.exit(shown(figures(Path(folder), options.full)))


if __name__ == "__main__":
    main()
