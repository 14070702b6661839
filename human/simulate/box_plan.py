"""When and where a box, the hands on it, the feet and the pelvis go, before anybody moves."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from human.model import HumanModel
from human.simulate.balance import Bearing, grid_of, smoothed
from human.simulate.gait import Cadence, Footfalls, lay_footsteps, walk_duration_s
from human.simulate.legs import Leg
from human.simulate.operators import Operator
from human.simulate.paths import (
    MinimumJerkPath,
    PosePath,
    RidingPath,
    SplinePath,
    minimum_jerk_path,
    spline_path,
)
from human.simulate.reaching import chain_law, standing_configuration
from human.simulate.stance import Stance, standing_height
from human.simulate.walking import mean_heading, pelvis_yaw

Array = NDArray[np.float64]

#: Time for which the hands rest at the box while its weight comes or goes [s].
_GRIP_S = 0.4
#: What is carried rides on the mean pose of the feet, smoothed over this [s].
_RIDE_S = 0.9
#: Fingers point this far down at a box on the floor, and forward at one at elbow height [rad].
_GRIP_PITCH = 0.9
#: Share of the reach of an arm that is used without legs or back.
_EASY_ARM = 0.9
#: Height of the shoulders over the pelvis as a share of stature, and how far it takes to stoop
#: [rad].
_TRUNK_SHARE, _DEEPEST_STOOP = 0.27, 1.3
#: Part of a stoop that the pelvis makes; the spine makes the rest.
_PELVIS_SHARE = 0.55
#: Deepest squat on flat feet, as a share of the standing height of the pelvis.
_DEEPEST_SQUAT = 0.28
#: Where a box is carried: ahead, and above the pelvis, for a person of 1.75 m [m].
_CARRY = (0.36, 0.12)
#: A person moves a box at this many times the pace of a free hand that is led.
_BRISK = 2.0


@dataclass(frozen=True, slots=True)
class Station:
    """A place where a box is taken or left.

    Attributes:
        box: where the middle of the box is, world, ``3`` [m].
        stance: where the person stands to reach it.
    """

    box: tuple[float, float, float]
    stance: Stance = field(default_factory=Stance)


#: One carry: from a low shelf in front, over a quarter turn and two steps, to a table.
DEFAULT_STATIONS: tuple[Station, ...] = (
    Station((0.42, 0.0, 0.45), Stance()),
    Station((1.2, 1.22, 0.95), Stance(1.2, 0.8, float(np.pi / 2))),
)


@dataclass(frozen=True, slots=True)
class BoxPlan:
    """The course of events.

    Attributes:
        footfalls: the feet.
        hands: hand paths, world, one for each hand that is led.
        end_s: when all is over [s].
        phases: start and end of each phase, ``P x 2`` [s], in order.
    """

    footfalls: Footfalls
    hands: tuple[PosePath, ...]
    end_s: float
    phases: Array
    _crouch: MinimumJerkPath

    def bearing(self, grid: Array) -> Bearing:
        """Returns how the pelvis is meant to be held, on the grid."""
        crouch = self._crouch.sample(grid).position
        return Bearing(grid, crouch[:, 0], crouch[:, 1], pelvis_yaw(self.footfalls, grid))

    def load(self, time_s: Array) -> Array:
        """Returns the share of the box's weight that the hands bear, ``T``."""
        return self._crouch.sample(time_s).position[:, 2]

    def phase(self, time_s: Array) -> NDArray[np.int64]:
        """Returns the number of the phase at each time, ``T``; -1 between them."""
        at = np.searchsorted(self.phases[:, 0], time_s, side="right") - 1
        inside = (at >= 0) & (time_s < self.phases[np.maximum(at, 0), 1])
        return np.where(inside, at, -1).astype(np.int64)


class _Script:
    """Events in the making: where hands and crouch are at which time, in riding axes."""

    def __init__(self, rest: tuple[Array, Array], begin_s: float) -> None:
        self.now = begin_s
        self.times = [begin_s]
        self.positions = [rest[0]]
        self.rotations = [rest[1]]
        self.crouches = [np.zeros(3)]
        self.phases: list[tuple[float, float]] = []

    def go(
        self, duration_s: float, hands: tuple[Array, Array], crouch: Array, *, phase: bool
    ) -> None:
        """Lets the hands go to poses ``k x 3``, ``k x 3 x 3`` and the body to a crouch."""
        if phase:
            self.phases.append((self.now, self.now + duration_s))
        self.now += duration_s
        self.times.append(self.now)
        self.positions.append(hands[0])
        self.rotations.append(hands[1])
        self.crouches.append(crouch)

    def wait(self, duration_s: float, load: float | None = None, *, phase: bool = False) -> None:
        """Lets the hands stay where they are, while the load may change."""
        crouch = self.crouches[-1].copy()
        if load is not None:
            crouch[2] = load
        self.go(duration_s, (self.positions[-1], self.rotations[-1]), crouch, phase=phase)


def plan_box_handling(
    model: HumanModel,
    operator: Operator,
    legs: tuple[Leg, Leg],
    stations: Sequence[Station],
    cadence: Cadence,
    box_width_m: float,
    tips: tuple[str, ...],
) -> BoxPlan:
    """Returns the course of events from standing at ease at the first station to the last.

    Args:
        model: the person's body.
        operator: the person.
        legs: right and left leg of the model.
        stations: where the box is taken and left.
        cadence: how they walk.
        box_width_m: distance of the hands on the box.
        tips: the hands that hold it.
    """
    body = _Body.of(model, operator, legs, box_width_m, tips)
    script = _Script(body.rest, 0.0)
    script.wait(operator.reaction_s + 0.2)
    walks: list[tuple[float, Sequence[Stance]]] = []
    for here, there in pairwise(stations):
        take, leave = body.local(here), body.local(there)
        script.go(body.time_s(script, take), body.grip(take), body.crouch(take), phase=True)
        script.wait(_GRIP_S, 1.0)
        loaded = np.array([0.0, 0.0, 1.0])
        script.go(body.time_s(script, body.carry), body.grip(body.carry), loaded, phase=True)
        walk_s = walk_duration_s(here.stance, [there.stance], cadence)
        if walk_s:
            walks.append((script.now, [there.stance]))
            script.wait(walk_s, phase=True)
        script.go(
            body.time_s(script, leave), body.grip(leave), body.crouch(leave) + loaded, phase=True
        )
        script.wait(_GRIP_S, 0.0)
        script.go(body.time_s(script, body.rest[0][0]), body.rest, np.zeros(3), phase=True)
        script.wait(operator.reaction_s)
    footfalls = lay_footsteps(legs, walks, start=stations[0].stance, begin_s=0.0, cadence=cadence)
    ride = _ride(footfalls, script.now)
    hands = tuple(
        RidingPath(
            ride,
            minimum_jerk_path(
                script.times,
                np.array([p[k] for p in script.positions]),
                np.array([R[k] for R in script.rotations]),
            ),
        )
        for k in range(len(tips))
    )
    crouch = minimum_jerk_path(script.times, np.array(script.crouches), np.eye(3))
    return BoxPlan(footfalls, hands, script.now, np.array(script.phases), crouch)


@dataclass(frozen=True, slots=True)
class _Body:
    """What the plan needs to know of the person."""

    rest: tuple[Array, Array]
    carry: Array
    height: float
    shoulder: float
    trunk: float
    arm: float
    leg_share: float
    speed: float
    asides: Array
    palms: Array

    @staticmethod
    def of(
        model: HumanModel,
        operator: Operator,
        legs: tuple[Leg, Leg],
        box_width_m: float,
        tips: tuple[str, ...],
    ) -> "_Body":
        offsets = dict(zip(model.joint_names, model.offsets, strict=True))
        forearm = np.linalg.norm(offsets["jRightElbow"]) + np.linalg.norm(offsets["jRightWrist"])
        arm = float(forearm + np.linalg.norm(model.frames["RightHandCOM"].position))
        stature = model.subject.height_m if model.subject else 1.75
        height, scale = standing_height(legs), stature / 1.75
        law = chain_law(model, operator, tips)
        q = standing_configuration(model, operator)
        position, rotation, _ = law.chain.pose_and_jacobian(q[7 + law.chain.dof])
        sides = np.array([-1.0 if tip.startswith("Right") else 1.0 for tip in tips])
        spread = 0.5 * box_width_m if len(tips) == 2 else 0.0
        # Palms face each other, fingers forward, the hand's x axis up.
        palms = np.array([[[0, s, 0], [0, 0, s], [1, 0, 0]] for s in sides], dtype=np.float64)
        return _Body(
            rest=(position + q[:3], rotation),
            carry=np.array(
                [_CARRY[0] * scale, 0.0 if len(tips) == 2 else -0.15, height + _CARRY[1] * scale]
            ),
            height=height,
            shoulder=height + _TRUNK_SHARE * stature,
            trunk=_TRUNK_SHARE * stature,
            arm=_EASY_ARM * arm,
            leg_share=operator.leg_share,
            speed=_BRISK * operator.pace_m_s,
            asides=sides * spread,
            palms=palms,
        )

    def local(self, station: Station) -> Array:
        """Returns the middle of the box as seen from the stance."""
        return np.asarray(
            station.stance.rotation.T @ (np.array(station.box) - station.stance.origin)
        )

    def grip(self, box: Array) -> tuple[Array, Array]:
        """Returns the hand poses on a box, riding axes: fingers down at a low one, up at a high."""
        elbow = self.height + 0.1
        pitch = _GRIP_PITCH * float(np.clip((elbow - box[2]) / elbow, -1.0, 1.0))
        down = Rotation.from_euler("y", pitch).as_matrix()
        aside = np.zeros((self.asides.size, 3))
        aside[:, 1] = self.asides
        return box + aside, down @ self.palms

    def crouch(self, box: Array) -> Array:
        """Returns drop [m], pitch [rad] and zero load with which the hands can reach a box.

        Derived here: what the shoulders must come down is shared out; the trunk's part n takes a
        stoop with ``1 - cos = n / trunk``.
        """
        ahead = 0.75 * float(np.hypot(box[0], box[1]))
        hanging = np.sqrt(max(self.arm**2 - ahead**2, 0.0))
        lacking = max(0.0, self.shoulder - hanging - float(box[2]))
        drop = min(self.leg_share * lacking, _DEEPEST_SQUAT * self.height)
        bend = np.arccos(np.clip(1.0 - (lacking - drop) / self.trunk, -1.0, 1.0))
        return np.array([drop, _PELVIS_SHARE * min(float(bend), _DEEPEST_STOOP), 0.0])

    def time_s(self, script: _Script, goal: Array) -> float:
        """Returns how long the way from where the hands are takes [s]."""
        way = np.linalg.norm(script.positions[-1].mean(axis=0) - goal)
        return float(np.clip(way / self.speed, 1.2, 3.0))


def _ride(footfalls: Footfalls, end_s: float) -> SplinePath:
    """Returns the smoothed mean pose of the feet, on the floor: the stance while they rest."""
    grid = grid_of(-1.0, max(end_s, footfalls.end_s) + 1.0)
    right, left = (f.sample(grid).position for f in footfalls.feet)
    position = smoothed(0.5 * (right + left), _RIDE_S)
    position[:, 2] = 0.0
    yaw = smoothed(mean_heading(footfalls, grid), _RIDE_S)
    knots = slice(None, None, 5)
    return spline_path(
        grid[knots], position[knots], Rotation.from_euler("z", yaw[knots, None]).as_quat()
    )
