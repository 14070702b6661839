"""A simulated person, and what must become of input about them that is not what it seems."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from human import Chain, HumanModel, Motion, Subject, generate_model
from human.simulate import Operator, operator, simulate_reaching
from prediction import (
    Demonstrations,
    OperatorModel,
    Rollout,
    TrainingOptions,
    demonstrations_from_motion,
    demonstrations_from_samples,
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


def same(one: Array, two: Array) -> str:
    """Says how near two answers are, rad; fails if they are not the same."""
    apart = float(np.degrees(np.abs(one - two).max()))
    if not apart <= SAME_DEG:
        raise AssertionError(f"central paths differ by {apart:.2f} deg")
    return f"within {apart:.2f} deg of good input"
