"""Candidate robot trajectories between two hand poses, some kind to the person and some not."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from human.model import HumanModel
from human.simulate.errors import SimulationError
from human.simulate.operators import Operator
from human.simulate.paths import PosePath, minimum_jerk_path, spline_path
from human.simulate.reaching import chain_law, hand_frame, standing_configuration
from human.simulate.resolve import Law, follow

Array = NDArray[np.float64]

#: Where the hand passes on the way, for the right hand of a person of 1.75 m, from the pelvis [m],
#: and in words. The plain way comes first, then they alternate between easy and hard.
_WAYS: Mapping[str, tuple[tuple[float, float, float], str]] = MappingProxyType(
    {
        "direct": ((0.42, -0.12, 0.12), "the straight way at elbow height"),
        "overhead": ((0.50, -0.12, 0.70), "overhead and away from the body"),
        "close": ((0.33, -0.16, 0.20), "chest high and close to the body"),
        "low-side": ((0.30, -0.55, -0.22), "low and out to the side"),
        "twist": ((0.02, -0.58, 0.10), "round behind the side, turning the trunk"),
        "far": ((0.68, -0.10, 0.10), "far in front, arm stretched"),
        "low-front": ((0.52, -0.15, -0.28), "low in front, bending the trunk"),
        "shoulder-high": ((0.45, -0.15, 0.42), "at shoulder height"),
    }
)
#: Where the trajectories end, likewise.
_GOAL = (0.42, 0.08, 0.10)
#: How far a way is drawn back to the straight one each time it proves out of reach.
_EASIER = 0.85
_TRIES = 12


@dataclass(frozen=True, slots=True)
class RobotTrajectory:
    """One candidate: where a robot would lead the hand.

    Attributes:
        id: short name.
        intent: what it does, in words.
        time_s: ``K`` [s].
        position_m: hand, world, ``K x 3``.
        orientation_xyzw: hand axes in world axes, ``K x 4``.
    """

    id: str
    intent: str
    time_s: Array
    position_m: Array
    orientation_xyzw: Array

    def path(self) -> PosePath:
        """Returns the same as a smooth path."""
        return spline_path(self.time_s, self.position_m, self.orientation_xyzw)


@dataclass(frozen=True, slots=True)
class RobotScene:
    """A person at ease, and what a robot might do with their hand.

    Attributes:
        hand: ``right`` or ``left``.
        q_start: whole-body configuration of the person at the start of every trajectory.
        trajectories: the candidates; all begin and end with the same hand pose.
    """

    hand: str
    q_start: Array
    trajectories: tuple[RobotTrajectory, ...]


def robot_trajectories(
    model: HumanModel,
    operator: Operator,
    rng: np.random.Generator,
    *,
    count: int = 6,
    hand: str = "right",
    duration_s: float = 4.0,
    points: int = 51,
) -> RobotScene:
    """Makes candidates of different quality between the same two poses.

    Each way was walked by the operator without noise before it is handed out, so it is within reach
    and within the joint limits; a way that is not is drawn nearer to the straight one until it is.

    Args:
        model: the person's body.
        operator: the person.
        rng: source of what distinguishes candidates beyond the eight plain ways.
        count: number of candidates.
        hand: which hand is led.
        duration_s: how long each takes.
        points: samples of each.

    Raises:
        SimulationError: not even the straight way is within reach.
    """
    if count < 1 or points < 8 or not duration_s > 0.0:
        raise SimulationError(
            f"expected count >= 1, points >= 8, duration_s > 0; got {count}, {points}, {duration_s}"
        )
    law = chain_law(model, operator, (hand_frame(hand),))
    q_start = standing_configuration(model, operator)
    pelvis = q_start[:3], Rotation.from_quat(q_start[3:7]).as_matrix()
    position, rotation, _ = law.chain.pose_and_jacobian(q_start[7 + law.chain.dof])
    start = position[0], rotation[0]
    body = (model.subject.height_m if model.subject else 1.75) / 1.75
    side = np.array([1.0, 1.0 if hand == "right" else -1.0, 1.0]) * body
    goal = np.array(_GOAL) * side
    middle = 0.5 * (start[0] + goal)
    plain = list(_WAYS.items())
    chosen: list[RobotTrajectory] = []
    goal_rotation: Array | None = None
    for i in range(count):
        name, (via, intent) = plain[i % len(plain)]
        target = np.array(via) * side
        if i >= len(plain):
            target = middle + rng.uniform(0.3, 0.9) * (target - middle) + rng.normal(0, 0.03, 3)
            name, intent = f"{name}-{i // len(plain) + 1}", f"between the straight way and {intent}"
        for _ in range(_TRIES):
            try:
                poses = _walked(
                    law, q_start, start, target, goal, goal_rotation, duration_s, points
                )
            except SimulationError:
                target = middle + _EASIER * (target - middle)
                continue
            break
        else:
            raise SimulationError(f"{name}: no reachable way from {start[0]} to {goal} was found")
        time_s, positions, rotations = poses
        goal_rotation = rotations[-1]
        chosen.append(
            RobotTrajectory(
                name,
                intent,
                time_s,
                positions @ pelvis[1].T + pelvis[0],
                Rotation.from_matrix(pelvis[1] @ rotations).as_quat(),
            )
        )
    return RobotScene(hand, q_start, tuple(chosen))


def _walked(
    law: Law,
    q_start: Array,
    start: tuple[Array, Array],
    via: Array,
    goal: Array,
    goal_rotation: Array | None,
    duration_s: float,
    points: int,
) -> tuple[Array, Array, Array]:
    """Returns times, positions and rotations (pelvis axes) of a way the operator can go.

    First the hand is led by its position alone, which shows how it would be turned on the way;
    then a smooth path through those poses is tried with the whole pose prescribed.
    """
    dof = law.chain.dof
    free = Law(law.chain.position_only(), law.mobility, law.comfort)
    knots = duration_s * np.array([0.0, 0.5, 1.0])
    smooth = spline_path(knots, np.array([start[0], via, goal]), [0.0, 0.0, 0.0, 1.0])

    def calm(t: Array) -> Array:
        return np.zeros((t.size, dof.size))

    coarse = np.linspace(0.0, duration_s, 61)
    trial = follow(free, lambda t: [smooth.sample(t)], coarse, q_start[7 + dof], calm)
    turned = [law.chain.pose_and_jacobian(q)[1][0] for q in trial.q[[30, 60]]]
    last = turned[1] if goal_rotation is None else goal_rotation
    turns = minimum_jerk_path(knots, np.zeros((3, 3)), np.array([start[1], turned[0], last]))
    time_s = np.linspace(0.0, duration_s, points)
    positions = smooth.sample(time_s).position
    rotations = turns.sample(time_s).rotation
    full = spline_path(time_s, positions, Rotation.from_matrix(rotations).as_quat())
    follow(law, lambda t: [full.sample(t)], coarse, q_start[7 + dof], calm)
    return time_s, positions, rotations
