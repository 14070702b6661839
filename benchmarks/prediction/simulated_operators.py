"""Simulated people with a known law: what they are seen doing, and the law itself as a method."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from human import Chain, Subject, generate_model
from human.simulate import (
    Operator,
    operator,
    robot_trajectories,
    simulate_following,
    simulate_reaching,
)
from prediction import (
    Demonstrations,
    Familiarity,
    FittedMethod,
    JointLimits,
    JointReduction,
    NullSpaceBasis,
    NullSpaceMemory,
    OperatorModel,
    demonstrations_from_motion,
    join,
)
from prediction.laws.joint_gaussian import JointGaussian
from prediction.laws.moment_fit import MomentFit
from prediction.training.held_out import calibrate

Array = NDArray[np.float64]

RATE_HZ = 30.0
#: Ways between two poses a robot leads the hand along, how often each, and free movements.
WAYS, REPETITIONS, FREE = 4, 4, 6


@dataclass(frozen=True, slots=True)
class Person:
    """One simulated operator and what they did, in the order they did it.

    Attributes:
        operator: Who it is.
        chain: Pelvis to right hand.
        led: Takes along the robot's ways, each way `REPETITIONS` times.
        free: Reaching to places of their own.
    """

    operator: Operator
    chain: Chain
    led: tuple[Demonstrations, ...]
    free: Demonstrations

    @classmethod
    def of(cls, kind: str, seed: int) -> Self:
        """Simulates a person of a kind."""
        model = generate_model(Subject(1.75, 72.0))
        rng = np.random.default_rng(seed)
        person = operator(kind, rng, model)
        scene = robot_trajectories(model, person, rng, count=WAYS)
        motions = [
            simulate_following(
                model, person, way.path(), rng, q_start=scene.q_start, rate_hz=RATE_HZ
            ).motion
            for _ in range(REPETITIONS)
            for way in scene.trajectories
        ]
        motions.append(
            simulate_reaching(model, person, rng, movements=FREE, rate_hz=RATE_HZ).motion
        )
        chain = Chain(model)
        takes = [
            demonstrations_from_motion(chain, motion, trajectory_id=k, rate_hz=RATE_HZ)
            for k, motion in enumerate(motions)
        ]
        return cls(person, chain, tuple(takes[:-1]), takes[-1])

    def interleaved(self) -> tuple[Demonstrations, Demonstrations]:
        """Returns training and test of the same motion: each way is held out once, at its turn."""
        return self._split([k // WAYS == k % WAYS for k in range(len(self.led))])

    def later(self) -> tuple[Demonstrations, Demonstrations]:
        """Returns training and test of the same motion: the last time of each way is held out."""
        return self._split([k >= len(self.led) - WAYS for k in range(len(self.led))])

    def _split(self, held: list[bool]) -> tuple[Demonstrations, Demonstrations]:
        train = [take for take, out in zip(self.led, held, strict=True) if not out]
        test = [take for take, out in zip(self.led, held, strict=True) if out]
        return join(train), join(test)


@dataclass(frozen=True, slots=True)
class TrueLaw(MomentFit, JointGaussian):
    """The law a simulated person follows, without the course of their noise.

    ``qdot = J_W^+ xdot + (I - J_W^+ J) (z + e)`` with ``e ~ N(0, noise^2 W)`` is
    ``N(z, noise^2 W)`` conditioned on the hand. That is no floor: e lasts, so where the posture
    strays from the usual one tells a little of it.

    Attributes:
        mobility: W, ``(n, n)``.
        noise: rad/s of a joint of mobility one.
        person: Whose comfort z is.
        dof: The chain's joints among the person's.
        reference: Null-space axes.
    """

    name: ClassVar[str] = "the law itself"

    mobility: Array
    noise: float
    person: Operator
    dof: NDArray[np.intp]
    reference: NullSpaceBasis

    @classmethod
    def of_person(cls, person: Person, demonstrations: Demonstrations) -> Self:
        """Takes the law from the simulator."""
        dof = person.chain.dof_indices
        mobility = person.operator.mobility[dof]
        noise = float((person.operator.null_noise[dof] / np.sqrt(mobility)).mean())
        basis = NullSpaceBasis.around(demonstrations.jacobian)
        return cls(np.diag(mobility), noise, person.operator, dof, basis)

    @classmethod
    def of_moments(cls, demonstrations: Demonstrations) -> Self:
        """It is not learned."""
        raise NotImplementedError("a true law is taken from a person")

    @property
    def weights(self) -> Array:
        """W."""
        return self.mobility

    def joint_mean(self, q: Array, xdot: Array) -> Array:
        """What the person would do if nothing bound them."""
        return self.person.comfort.of(self.dof).null_velocity(q)

    def joint_variance(self, q: Array, xdot: Array) -> Array:
        """Of the noise."""
        return np.full(q.shape[:-1], self.noise**2)

    def rescaled(self, factor: float) -> Self:
        """Returns the same law: it needs no calibration."""
        return self

    def refitted(self, demonstrations: Demonstrations) -> Self:
        """Returns the same law: nothing was fitted."""
        return self

    def to_arrays(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """It is not written to files."""
        raise NotImplementedError("a true law is no model")

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array], values: Mapping[str, Any]) -> Self:
        """It is not read from files."""
        raise NotImplementedError("a true law is no model")


def with_true_law(model: OperatorModel, person: Person, train: Demonstrations) -> OperatorModel:
    """Returns a model that holds the law itself alone, its band measured like any other."""
    law = TrueLaw.of_person(person, train)
    reduction = JointReduction.identity(person.chain.dof_names)
    limits = JointLimits(reduction.expansion, person.chain.lower, person.chain.upper)
    found = calibrate(
        law,
        train,
        person.chain,
        reduction,
        limits.widened_to(train.q),
        "pose",
        np.random.default_rng(0),
    )
    memory = NullSpaceMemory(person.operator.noise_time_s, 1.0)
    fitted = FittedMethod(law, found.band, {}, memory)
    return replace(
        model,
        methods={(law.name, "pose"): fitted},
        method=law.name,
        reduction=reduction,
        familiarity=Familiarity.of(train),
    )
