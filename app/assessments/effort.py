"""What the joints from the hand to L5S1 bear along predicted postures, with the load in the hand.

Effort is the norm of the joint's moment vector: the same in any axes.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from app.assessments.footing import Footing
from app.assessments.poses import Array
from app.assessments.schemas import FootSplit
from human import (
    HumanModel,
    Wrench,
    forward_kinematics,
    frame_poses,
    inverse_dynamics,
    joint_loads,
)
from human.differentiate import LocalCubic
from human.dynamics import GRAVITY

#: Window over which postures are smoothed, and differentiated, s.
SMOOTHING_S = 0.5

_TRUNK = ("jL5S1", "jL4L3", "jL1T12", "jT9T8")
_ARM = ("C7Shoulder", "Shoulder", "Elbow", "Wrist")
_LEG = ("Hip", "Knee", "Ankle")


@dataclass(frozen=True, slots=True)
class Efforts:
    """Joint efforts of roll-outs.

    Attributes:
        joint_names: ``m`` joints, from the lumbar spine to the hand, then the legs if asked for.
        moment_norm: ``(S, T, m)`` N·m.
    """

    joint_names: tuple[str, ...]
    moment_norm: Array


@dataclass(frozen=True, slots=True)
class HandLoad:
    """What acts on the person at the hand.

    Attributes:
        tips: The frames it acts at, ``RightHandCOM`` or ``LeftHandCOM``, or both, half at each.
        borne_kg: Mass whose weight and inertia the person bears, kg.
        force_n: Further force, ``(3,)`` N, world axes.
    """

    tips: tuple[str, ...]
    borne_kg: float
    force_n: Array

    def wrenches(self, acceleration: Array) -> list[Wrench]:
        """Returns the loads on the person while the load accelerates by ``(..., 3)`` m/s^2."""
        force = self.borne_kg * (np.asarray(GRAVITY) - acceleration) + self.force_n
        return [Wrench(tip, force / len(self.tips)) for tip in self.tips]


def arm_joints(hand: str) -> tuple[str, ...]:
    """Returns the joints from L5S1 to the wrist of ``hand``: ``right``, ``left`` or ``both``."""
    sides = ("Right", "Left") if hand == "both" else (hand.capitalize(),)
    return (*_TRUNK, *(f"j{side}{name}" for side in sides for name in _ARM))


def leg_joints() -> tuple[str, ...]:
    """Returns the joints of both legs that bear the body."""
    return tuple(f"j{side}{name}" for side in ("Right", "Left") for name in _LEG)


def velocities(
    model: HumanModel,
    q: Array,
    time_s: Array,
    moving: NDArray[np.intp],
    central: Array | None = None,
    footing: Footing | None = None,
) -> tuple[Array, Array, Array]:
    """Returns smoothed configurations and the first and second derivatives of the motion.

    The joints that are not predicted stand still; so does the base, unless the feet carry it.
    Sampled deviations are an
    Ornstein-Uhlenbeck process, which says where a posture may be and has no acceleration: what a
    filter makes of it depends on the filter alone. So all samples move as the central path does,
    each from its own posture.

    Args:
        model: The person.
        q: ``(S, T, nq)``.
        time_s: ``(T,)``.
        moving: Joint angles that are predicted, indices.
        central: The path without deviation, ``(T, nq)``; None if that is what ``q`` holds.
        footing: What stays in place; the pelvis if not given.

    Returns:
        ``(S, T, nq)``, ``(S, T, nv)``, ``(S, T, nv)``.
    """
    cubic = _local_cubic(time_s.tobytes())
    angles = q[..., 7 + moving]
    along = _derivatives(cubic, angles)
    smooth = q.copy()
    smooth[..., 7 + moving] = along[0]
    led = along if central is None else _derivatives(cubic, central[:, 7 + moving])
    v, a = np.zeros((*q.shape[:-1], model.nv)), np.zeros((*q.shape[:-1], model.nv))
    v[..., 6 + moving], a[..., 6 + moving] = led[1], led[2]
    if footing is not None and footing.carried is not None:
        footing.stand(smooth)
        path = smooth if central is None else central.copy()
        path[..., 7 + moving] = led[0]
        rates = np.zeros((*path.shape[:-1], model.n_dof))
        rates[..., moving] = led[1]
        twist = footing.twist(path[..., 7:], rates)
        v[..., :6], a[..., :6] = twist, _derivatives(cubic, twist)[1]
    return smooth, v, a


@lru_cache(maxsize=4)
def _local_cubic(time_s: bytes) -> LocalCubic:
    """The filter of these times, remembered: candidates of one planner mostly share theirs."""
    # The grid has no gaps: a step four times the usual one is as meant as the others.
    return LocalCubic(np.frombuffer(time_s), window_s=SMOOTHING_S, gap_factor=np.inf)


def _derivatives(cubic: LocalCubic, signal: Array) -> tuple[Array, Array, Array]:
    """Returns the value and two derivatives of ``(..., T, k)`` along time."""
    ahead = np.moveaxis(signal, -2, 0)
    found = cubic.derivatives(ahead.reshape(len(ahead), -1))
    parts = (found.value, found.first, found.second)
    value, first, second = (np.moveaxis(part.reshape(ahead.shape), 0, -2) for part in parts)
    return value, first, second


def joint_efforts(
    model: HumanModel,
    q: Array,
    time_s: Array,
    hand_position: Array,
    hand: str,
    load: HandLoad,
    moving: NDArray[np.intp],
    foot_split: FootSplit | None,
    central: Array | None = None,
    footing: Footing | None = None,
) -> Efforts:
    """Returns the efforts from hand to L5S1, and of the legs where the foot split is stated.

    Args:
        model: The person.
        q: ``(S, T, nq)`` predicted configurations.
        time_s: ``(T,)`` s.
        hand_position: Where the hand is led, or the middle of both, ``(T, 3)`` or ``(S, T, 3)`` m,
            world; its acceleration is the load's.
        hand: ``right``, ``left`` or ``both``.
        load: What acts at the hand.
        moving: Joint angles that are predicted, indices.
        foot_split: Share of the support by foot, or None.
        central: See `velocities`.
        footing: See `velocities`.
    """
    smooth, v, a = velocities(model, q, time_s, moving, central, footing)
    held = load.wrenches(_derivatives(_local_cubic(time_s.tobytes()), hand_position)[2])
    joints = arm_joints(hand)
    loads = joint_loads(model, smooth, v, a, held, joints=joints)
    norms = {
        name: np.linalg.norm(loads.moment[..., k, :], axis=-1)
        for k, name in enumerate(loads.joint_names)
    }
    if foot_split is not None:
        norms |= _leg_efforts(model, smooth, v, a, held, foot_split)
        joints = (*joints, *leg_joints())
    return Efforts(joints, np.stack([norms[name] for name in joints], axis=-1))


def _leg_efforts(
    model: HumanModel, q: Array, v: Array, a: Array, held: list[Wrench], split: FootSplit
) -> dict[str, Array]:
    """Returns leg efforts when the ground bears what the whole body needs, shared as stated.

    The wrench that must hold the base is what the ground gives. Its force is shared as stated; each
    share acts at its foot, and what moment is then still missing is shared likewise. Derived here.
    """
    base = inverse_dynamics(model, q, v, a, held)[..., :6]
    poses = forward_kinematics(model, q)
    rotation, origin = poses.of("Pelvis")
    force = (rotation @ base[..., :3, None])[..., 0]
    moment = (rotation @ base[..., 3:, None])[..., 0]
    feet = {"LeftFoot": split.left, "RightFoot": split.right}
    missing = moment.copy()
    for foot, share in feet.items():
        _, place = frame_poses(model, poses, foot)
        missing -= np.cross(place - origin, share * force)
    ground = [Wrench(foot, share * force, share * missing) for foot, share in feet.items()]
    wrenches = [*held, *ground]
    loads = joint_loads(model, q, v, a, wrenches, joints=leg_joints())
    return {
        name: np.linalg.norm(loads.moment[..., k, :], axis=-1)
        for k, name in enumerate(loads.joint_names)
    }
