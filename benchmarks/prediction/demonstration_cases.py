"""Demonstrations that are not what they seem, and what must become of each."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from benchmarks.prediction.input_world import Case, World, learned, same
from human import motion_from_configurations
from human.simulate import simulate_reaching, simulate_walking
from prediction import Demonstrations, demonstrations_from_motion, motion_findings

Array = NDArray[np.float64]


def _scaled(world: World, **factors: float) -> Demonstrations:
    shown = world.shown
    return world.samples(
        *(getattr(shown, name) * factors.get(name, 1.0) for name in ("q", "qdot", "time_s"))
    )


def _still(world: World, noise: float) -> Demonstrations:
    count = 300
    time_s = np.arange(count) / 30.0
    q = world.start + noise * np.random.default_rng(0).standard_normal((count, 24))
    return world.samples(q, np.gradient(q, time_s, axis=0), time_s)


def _line(world: World) -> Demonstrations:
    """The hand goes to and fro along one line, by least joint motion."""
    time_s = np.arange(0.0, 10.0, 1.0 / 30.0)
    q = np.empty((len(time_s), 24))
    q[0] = world.start
    rng = np.random.default_rng(1)
    speed = 0.2 * np.sin(2.0 * np.pi * time_s / 2.5)
    wander = 0.05 * rng.standard_normal(24)
    for k in range(len(time_s) - 1):
        _, _, J = world.chain.forward_and_jacobian(q[k])
        inverse = np.linalg.pinv(J)
        wander = 0.9 * wander + 0.03 * rng.standard_normal(24)
        free = wander - inverse @ (J @ wander)
        moved = inverse @ np.array([0.0, speed[k], 0.0, 0.0, 0.0, 0.0])
        q[k + 1] = q[k] + (moved + free) / 30.0
    return world.samples(q, np.gradient(q, time_s, axis=0), time_s)


def _frozen(world: World) -> Demonstrations:
    shown = world.shown
    q = shown.q.copy()
    q[10::10] = q[9:-1:10]
    return world.samples(q, shown.qdot, shown.time_s)


def _locked(world: World) -> Demonstrations:
    shown = world.shown
    q, qdot = shown.q.copy(), shown.qdot.copy()
    wrist = [name.startswith("jRightWrist") for name in shown.joint_names]
    q[:, wrist], qdot[:, wrist] = q[0, wrist], 0.0
    return world.samples(q, qdot, shown.time_s)


def _sampled(world: World, every_s: float) -> Demonstrations:
    shown = world.shown
    time_s = np.arange(shown.time_s[0], shown.time_s[-1], every_s)

    def at(values: Array) -> Array:
        return np.stack([np.interp(time_s, shown.time_s, column) for column in values.T], axis=1)

    return world.samples(at(shown.q), at(shown.qdot), time_s)


def _with(world: World, name: str, row: int, value: float) -> Demonstrations:
    values = {key: getattr(world.shown, key).copy() for key in ("q", "qdot", "time_s")}
    values[name][row] = value
    return world.samples(**values)


def _wrapped(world: World) -> Demonstrations:
    q = world.shown.q.copy()
    q[100:, 13] -= 2.0 * np.pi
    return world.samples(q, world.shown.qdot, world.shown.time_s)


def _short_takes(world: World) -> Demonstrations:
    return replace(world.shown, trajectory_id=np.arange(len(world.shown)) // 5)


def _fast_sampling(world: World) -> str:
    """A thousand samples a second teach what thirty do."""
    step = np.array([0.0, 0.15, 0.1])
    one = world.lead(step)
    two = world.lead(step, model=world.train(_sampled(world, 1e-3)))
    return same(one.central, two.central)


def _other_hand(world: World) -> str:
    rng = np.random.default_rng(3)
    motion = simulate_reaching(
        world.body, world.person, rng, movements=2, hand="left", rate_hz=30.0
    ).motion
    return "; ".join(motion_findings(world.chain, motion))


def _walk(world: World) -> str:
    motion = simulate_walking(
        world.body, world.person, np.random.default_rng(3), rate_hz=30.0
    ).motion
    found = "; ".join(motion_findings(world.chain, motion))
    demonstrations = demonstrations_from_motion(world.chain, motion, rate_hz=30.0)
    return f"{found}; {learned(lambda _: demonstrations)(world)}"


def _standing(world: World) -> str:
    q = np.repeat(world.motion.q[:1], 300, axis=0)
    q[:, 7:] += 1e-3 * np.random.default_rng(0).standard_normal((300, 66))
    motion = motion_from_configurations(world.body.dof_names, np.arange(300) / 60.0, q)
    return learned(lambda w: demonstrations_from_motion(w.chain, motion))(world)


DEMONSTRATIONS: Mapping[str, Case] = MappingProxyType(
    {
        "too few samples": Case(
            "refused", "at least .* needed", learned(lambda w: w.shown.take(slice(0, 40)))
        ),
        "one sample": Case("refused", "one sample", learned(lambda w: w.shown.take(slice(0, 1)))),
        "takes of five samples": Case("flagged", "too short", learned(_short_takes)),
        "a single direction of motion": Case("flagged", "one line", learned(_line)),
        "NaN in a gap": Case(
            "refused", "not finite at sample 50", learned(lambda w: _with(w, "q", 50, np.nan))
        ),
        "infinite velocity": Case(
            "refused", "not finite at sample 50", learned(lambda w: _with(w, "qdot", 50, np.inf))
        ),
        "a hole in a take": Case(
            "flagged", "hole", learned(lambda w: w.shown.take(np.r_[0:100, 140 : len(w.shown)]))
        ),
        "a time twice": Case(
            "refused",
            "does not increase at sample 50",
            learned(lambda w: _with(w, "time_s", 50, w.shown.time_s[49])),
        ),
        "duplicated frames": Case("flagged", "repeat the posture", learned(_frozen)),
        "constant joints": Case("flagged", "jRightWrist_rotx has no law", learned(_locked)),
        "nothing moves": Case("refused", "hand stays", learned(lambda w: _still(w, 0.0))),
        "a sensor's noise, standing": Case(
            "refused", "hand stays", learned(lambda w: _still(w, 1e-3))
        ),
        "a recording of standing still": Case("refused", "hand stays", _standing),
        "angles in degrees": Case(
            "refused", "in rad", learned(lambda w: _scaled(w, q=57.3, qdot=57.3))
        ),
        "velocities in degrees": Case("refused", "x57", learned(lambda w: _scaled(w, qdot=57.3))),
        "times in milliseconds": Case(
            "refused", "apart", learned(lambda w: _scaled(w, time_s=1e3))
        ),
        "an angle that wraps": Case(
            "refused", "jRightC7Shoulder_roty jumps by -6.28", learned(_wrapped)
        ),
        "sampled at 1 Hz": Case("refused", "1 s apart", learned(lambda w: _sampled(w, 1.0))),
        "sampled at 1000 Hz": Case("right", "within", _fast_sampling, slow=True),
        "velocities of another motion": Case(
            "refused",
            "correlation",
            learned(lambda w: w.samples(w.shown.q, w.shown.qdot[::-1].copy(), w.shown.time_s)),
        ),
        "the other hand moved": Case("flagged", "left hand goes", _other_hand),
        "walking instead of reaching": Case("flagged", "walks", _walk),
    }
)
