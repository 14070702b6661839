"""Demonstrations and hand paths that are not what they seem, and what must become of each."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from human import Chain, HumanModel, Motion, Subject, generate_model, motion_from_configurations
from human.rotations import rotation_vector_to_matrix
from human.simulate import Operator, operator, simulate_reaching, simulate_walking
from prediction import (
    Demonstrations,
    HandNoise,
    OperatorModel,
    Rollout,
    TrainingOptions,
    demonstrations_from_motion,
    demonstrations_from_samples,
    generic_operator,
    motion_findings,
    train_operator,
)

Array = NDArray[np.float64]
Outcome = Literal["refused", "flagged", "right"]

#: Postures this unfamiliar are flagged by assessments as well.
FAMILIAR = 0.3
#: Central paths that agree to this are the same, deg.
SAME_DEG = 1.0


class World:
    """One simulated person, what they showed, and the model trained on it."""

    @cached_property
    def body(self) -> HumanModel:
        """The person's body."""
        return generate_model(Subject(1.75, 72.0))

    @cached_property
    def person(self) -> Operator:
        """The person's law."""
        return operator("average", np.random.default_rng(5), self.body)

    @cached_property
    def chain(self) -> Chain:
        """Pelvis to right hand."""
        return Chain(self.body)

    @cached_property
    def motion(self) -> Motion:
        """Reaching with the right hand."""
        rng = np.random.default_rng(6)
        return simulate_reaching(self.body, self.person, rng, movements=2, rate_hz=30.0).motion

    @cached_property
    def shown(self) -> Demonstrations:
        """The demonstrations of it, at 30 Hz."""
        return demonstrations_from_motion(self.chain, self.motion, rate_hz=30.0)

    @cached_property
    def model(self) -> OperatorModel:
        """The operator."""
        return self.train(self.shown, tasks=("pose", "position"))

    def train(self, demonstrations: Demonstrations, **options: Any) -> OperatorModel:
        """Trains the quickest method."""
        chosen = TrainingOptions(**{"method": "cov-ik", "tasks": ("pose",), "blocks": 2, **options})
        return train_operator(self.chain, demonstrations, seed=0, options=chosen)

    def samples(self, q: Array, qdot: Array, time_s: Array) -> Demonstrations:
        """Makes demonstrations of samples."""
        return demonstrations_from_samples(self.chain, q, qdot, time_s)

    @cached_property
    def start(self) -> Array:
        """A demonstrated posture, hand in front."""
        return self.shown.q[len(self.shown) // 3]

    def hand(self, q: Array) -> tuple[Array, Array]:
        """Positions and rotations of the hand."""
        position, rotation, _ = self.chain.forward_and_jacobian(q)
        return position, rotation

    def lead(
        self, step: Array, count: int = 31, duration_s: float = 1.0, **changes: Any
    ) -> Rollout:
        """Leads the hand straight from `start` by a step; arguments of the roll-out may change."""
        q0 = changes.pop("q0", self.start)
        position, rotation = self.hand(q0)
        share = np.linspace(0.0, 1.0, count)
        arguments: dict[str, Any] = {
            "target_position": position + share[:, None] * np.asarray(step, dtype=float),
            "target_rotation": np.repeat(rotation[None], count, axis=0),
            "time_s": duration_s * share,
            "q0": q0,
            "samples": 8,
            "rng": np.random.default_rng(0),
        }
        model = changes.pop("model", self.model)
        for name, change in changes.items():
            arguments[name] = change(arguments[name]) if callable(change) else change
        rollout: Rollout = model.rollout(**arguments)
        return rollout


@dataclass(frozen=True, slots=True)
class Case:
    """One bad input.

    Attributes:
        outcome: ``refused`` with an error; ``flagged``, answered with a word; or ``right``, the
            answer is the one of good input.
        words: What the error or the word must hold (regular expression).
        run: Feeds it in; returns the word, or for ``right`` how near the answer is.
        slow: Whether it takes more than a few seconds.
    """

    outcome: Outcome
    words: str
    run: Callable[[World], str]
    slow: bool = False


def learned(change: Callable[[World], Demonstrations]) -> Callable[[World], str]:
    """Trains on changed demonstrations and returns what the model says of them."""

    def run(world: World) -> str:
        model = world.train(change(world))
        followers = model.reduction.dropped_names
        found = list(model.training["findings"])
        return "; ".join([*found, *(f"{name} has no law of its own" for name in followers)])

    return run


def led(step: tuple[float, float, float], **changes: Any) -> Callable[[World], str]:
    """Leads the hand and returns how familiar the postures are."""

    def run(world: World) -> str:
        least = float(world.lead(np.array(step), **changes).familiarity.min())
        return f"familiarity {least:.2f}" if least < FAMILIAR else ""

    return run


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
    return _apart(one.central, two.central)


def _apart(one: Array, two: Array) -> str:
    apart = float(np.degrees(np.abs(one - two).max()))
    if not apart <= SAME_DEG:
        raise AssertionError(f"central paths differ by {apart:.2f} deg")
    return f"within {apart:.2f} deg of good input"


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


def _poses(world: World, q: Array) -> dict[str, Any]:
    position, rotation = world.hand(q)
    return {"target_position": position, "target_rotation": rotation}


def _overhead(world: World) -> str:
    """A way that this person can go and never went."""
    end = world.start.copy()
    names = list(world.chain.dof_names)
    for name, angle in (("jRightShoulder_rotx", -60.0), ("jRightElbow_rotz", 10.0)):
        end[names.index(name)] = np.radians(angle)
    q = world.start + np.linspace(0.0, 1.0, 61)[:, None] * (end - world.start)
    return led((0, 0, 0), count=61, duration_s=2.0, **_poses(world, q))(world)


def _coarse(world: World) -> str:
    """Five points a second, a decimetre apart: cut into steps that can be integrated."""
    step = np.array([0.05, 0.2, 0.15])
    fine = world.lead(step, count=51, duration_s=1.0)
    coarse = world.lead(step, count=6, duration_s=1.0)
    return _apart(fine.central[::10], coarse.central)


def _resting(world: World) -> str:
    return _apart(world.lead(np.zeros(3)).central, world.start)


def _outstretched(world: World) -> str:
    """Led towards the shoulder from an arm held straight out."""
    q0 = np.zeros(24)
    run = world.lead(np.array([0.0, 0.15, 0.0]), q0=q0)
    worst = 1e3 * float(run.hand_error_m.max())
    if not (np.isfinite(run.q).all() and worst < 1.0):
        raise AssertionError(f"the hand is {worst:.2f} mm off")
    return f"familiarity {run.familiarity.min():.2f}; hand within {worst:.2f} mm"


def _child(world: World) -> str:
    """The start of a smaller body, led where this one's hand was."""
    small = Chain(generate_model(Subject(1.45, 45.0)))
    place = small.forward(world.start)[0] - world.hand(world.start)[0]
    return led((0, 0.1, 0), target_position=lambda p: p + place)(world)


def _generic(world: World) -> str:
    return led((0, 0.1, 0.1), model=generic_operator(world.chain))(world)


def _nan_at(row: int, value: float) -> Callable[[Array], Array]:
    def change(values: Array) -> Array:
        values = values.copy()
        values[row] = value
        return values

    return change


PATHS: Mapping[str, Case] = MappingProxyType(
    {
        "out of reach": Case("refused", "out of reach", led((1.5, 0, 0), duration_s=4.0)),
        "far from the demonstrations": Case("flagged", "familiarity 0.[012]", _overhead),
        "no demonstrations at all": Case("flagged", "familiarity 0.00", _generic),
        "five points a second": Case("right", "within", _coarse),
        "steps of a nanosecond": Case("refused", "jumps", led((0, 0.1, 0), duration_s=3e-8)),
        "a million seconds between points": Case(
            "refused", "lasts 1e\\+06 s", led((0, 0.1, 0), time_s=lambda t: t + 1e6 * (t > 0.5))
        ),
        "times that run back": Case(
            "refused", "does not increase at point 7", led((0, 0.1, 0), time_s=_nan_at(7, 0.0))
        ),
        "NaN": Case(
            "refused", "not finite at point 7", led((0, 0, 0), target_position=_nan_at(7, np.nan))
        ),
        "infinity": Case(
            "refused", "not finite at point 7", led((0, 0, 0), time_s=_nan_at(7, np.inf))
        ),
        "millimetres": Case(
            "refused",
            "jumps|start posture holds",
            led((0, 0.1, 0), target_position=lambda p: 1e3 * p),
        ),
        "a point far off": Case(
            "refused", "jumps by", led((0, 0, 0), target_position=_nan_at(15, 3.0))
        ),
        "one point": Case("refused", "at least two points", led((0, 0, 0), count=1)),
        "no points": Case("refused", "at least two points", led((0, 0, 0), count=0)),
        "two coordinates": Case(
            "refused", "shape", led((0, 0, 0), target_position=lambda p: p[:, :2])
        ),
        "a mirrored rotation": Case(
            "refused", "not a rotation", led((0, 0, 0), target_rotation=lambda r: -r)
        ),
        "an orientation in degrees": Case(
            "refused",
            "jumps|start posture",
            led((0, 0, 0), target_rotation=lambda r: r @ rotation_vector_to_matrix([0, 0, 90.0])),
        ),
        "a hand that stays": Case("right", "within", _resting),
        "an arm held straight out": Case("flagged", "familiarity 0.0.*hand within", _outstretched),
        "a start of another body": Case("refused", "start posture holds the hand", _child),
        "a start of the other hand": Case(
            "refused",
            "start posture holds the hand",
            led((0, 0, 0), target_position=lambda p: p * [1.0, -1.0, 1.0]),
        ),
        "a start in degrees": Case(
            "refused", "in rad", lambda w: led((0, 0.05, 0), q0=np.degrees(w.start))(w)
        ),
        "a start with NaN": Case(
            "refused", "finite", lambda w: led((0, 0.05, 0), q0=_nan_at(3, np.nan)(w.start))(w)
        ),
        "a start of too few joints": Case("refused", r"expected \(24,\)", lambda w: _few(w)),
        "fewer samples than none": Case("refused", "samples", led((0, 0.05, 0), samples=-1)),
        "a robot of negative repeatability": Case(
            "refused", "", lambda w: led((0, 0.05, 0), sigma_x=HandNoise(-0.001))(w)
        ),
        "a robot of unknown repeatability": Case(
            "refused", "", lambda w: led((0, 0.05, 0), sigma_x=float("nan"))(w)
        ),
        "a task that was not trained": Case(
            "refused",
            "position",
            lambda w: led((0, 0.05, 0), target_rotation=None, model=w.train(w.shown))(w),
        ),
    }
)


def _few(world: World) -> str:
    position, rotation = world.hand(world.start)
    world.model.rollout(
        np.repeat(position[None], 5, axis=0),
        np.repeat(rotation[None], 5, axis=0),
        np.arange(5) / 10.0,
        world.start[:20],
        4,
        np.random.default_rng(0),
    )
    return ""
