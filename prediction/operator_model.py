"""What is known of one operator: body, demonstrated postures and the fitted methods."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from human import Chain, HumanModel, Subject, scale_model
from prediction.chain import JointReduction, Task, TaskChain
from prediction.errors import PredictionError, UnsupportedMethodError
from prediction.following.familiarity import Familiarity
from prediction.following.hand_noise import HandNoise
from prediction.following.hand_path import HandPath
from prediction.following.joint_limits import JointLimits
from prediction.following.posture_band import PostureBand
from prediction.following.propagation import Noise
from prediction.following.rollout import Follower, Rollout
from prediction.laws.memory import NullSpaceMemory
from prediction.laws.predictor import Predictor
from prediction.led_chain import Base, Hand, base_of, hand_of
from prediction.training.kept_samples import KeptSamples

Array = NDArray[np.float64]

#: Demonstrated postures that an unknown start is guessed from, at most.
_STARTS = 400


@dataclass(frozen=True, slots=True)
class Skeleton:
    """The body the demonstrations were recorded on, enough to build it again exactly.

    Attributes:
        subject: Height, mass, sex.
        joint_names: Joints whose offsets are given.
        offsets: Joint centres in the parent segment's axes at the T-pose, ``(joints, 3)`` m.
        led: Frames of the led hands.
        base: Segment the chain starts from.
        held: Further tips of the chain, kept in place.
    """

    subject: Subject
    joint_names: tuple[str, ...]
    offsets: Array
    led: tuple[str, ...] = ("RightHandCOM",)
    base: str = "Pelvis"
    held: tuple[str, ...] = ()

    @classmethod
    def of(cls, chain: Chain) -> "Skeleton":
        """Takes the skeleton of a chain's model.

        Raises:
            PredictionError: The model does not say whose it is.
        """
        model = chain.model
        if model.subject is None:
            raise PredictionError(
                "the human model has no subject (height, mass, sex): generate it from one, so that "
                "the operator model can build it again"
            )
        offsets = np.array(model.offsets)
        return cls(model.subject, model.joint_names, offsets, chain.led, chain.base, chain.held)

    def human_model(self) -> HumanModel:
        """Builds the person."""
        offsets = {
            name: offset for name, offset in zip(self.joint_names, self.offsets, strict=True)
        }
        return scale_model(self.subject, offsets)

    @property
    def hand(self) -> Hand:
        """The led hand: ``right``, ``left`` or ``both``."""
        return hand_of(self.led)

    @property
    def fixed(self) -> Base:
        """What stays where it is: ``pelvis`` or ``feet``."""
        return base_of(self.base)


@dataclass(frozen=True, slots=True)
class FittedMethod:
    """One method for one task, with the band measured for it.

    Attributes:
        predictor: On the learned joints.
        band: Coherent deviation.
        metrics: Figures of its calibration.
        memory: What a measured step before tells of the next; None if nothing.
    """

    predictor: Predictor
    band: PostureBand
    metrics: Mapping[str, float | None]
    memory: NullSpaceMemory | None = None


@dataclass(frozen=True)
class OperatorModel:
    """A trained model of one operator; what a model file holds.

    Attributes:
        methods: Fitted methods by name and task.
        method: Name of the method to use unless another is asked for.
        reduction: Learned joints and those that follow them.
        familiarity: Cover of postures, on learned joints.
        demonstrated: Lowest and highest angle demonstrated, ``(2, n)`` rad.
        skeleton: The person; None for a chain that is nobody's (a toy).
        linear_rows: Linear rows of the task.
        seed: Seed of the training.
        data_digest: SHA-256 of the training samples.
        metrics: Held-out comparison of the methods, JSON values.
        training: Options, sample counts and versions, JSON values.
        samples: The motion it was trained on, so that more can be added; None if it was not kept.
        sigma_x: Scatter of the hand velocity about the commanded one, ``(m, m)``, linear rows
            first: learned or given; None if nothing was said of it.
    """

    methods: Mapping[tuple[str, Task], FittedMethod]
    method: str
    reduction: JointReduction
    familiarity: Familiarity
    demonstrated: Array
    skeleton: Skeleton | None
    linear_rows: int
    seed: int
    data_digest: str
    metrics: Mapping[str, Any] = field(default_factory=dict)
    training: Mapping[str, Any] = field(default_factory=dict)
    samples: KeptSamples | None = None
    sigma_x: Array | None = None

    @property
    def joint_names(self) -> tuple[str, ...]:
        """All joints of the chain, base to tip."""
        return self.reduction.names

    @property
    def is_generic(self) -> bool:
        """Whether nothing was seen of this person: see `prediction.generic_operator`."""
        return len(self.familiarity.centres) == 0

    @property
    def method_names(self) -> tuple[str, ...]:
        """Methods held, the chosen one first."""
        names = dict.fromkeys(name for name, _ in self.methods)
        return tuple(sorted(names, key=lambda name: name != self.method))

    @property
    def tasks(self) -> tuple[Task, ...]:
        """Tasks the model was trained for."""
        return tuple(dict.fromkeys(task for _, task in self.methods))

    @cached_property
    def human_model(self) -> HumanModel:
        """The person, scaled as in training.

        Raises:
            PredictionError: The model is of a toy chain.
        """
        if self.skeleton is None:
            raise PredictionError("this operator model holds no skeleton: pass the chain yourself")
        return self.skeleton.human_model()

    @cached_property
    def chain(self) -> Chain:
        """The chain from what stays where it is to the led hand, or both."""
        model = self.human_model
        assert self.skeleton is not None
        return Chain(model, self.skeleton.led, self.skeleton.base, self.skeleton.held)

    def fitted(self, method: str | None = None, task: Task = "pose") -> FittedMethod:
        """Returns a fitted method.

        Raises:
            UnsupportedMethodError: It was not trained.
        """
        name = self.method if method is None else method
        if (name, task) not in self.methods:
            known = [f"{held} ({held_task})" for held, held_task in self.methods]
            raise UnsupportedMethodError("method", f"{name} ({task})", known)
        return self.methods[name, task]

    def follower(
        self, method: str | None = None, task: Task = "pose", chain: TaskChain | None = None
    ) -> Follower:
        """Returns what rolls out with a method.

        Joint limits are those of the chain, widened to the postures that were demonstrated.

        Raises:
            UnsupportedMethodError: The method was not trained.
        """
        fitted = self.fitted(method, task)
        whole: TaskChain = self.chain if chain is None else chain
        limits = JointLimits(self.reduction.expansion, whole.lower, whole.upper)
        return Follower(
            predictor=fitted.predictor,
            chain=whole,
            reduction=self.reduction,
            limits=limits.widened_to(self.demonstrated),
            band=fitted.band,
            familiarity=self.familiarity,
            task=task,
            demonstrated=None if self.samples is None else _few(self.samples.q),
        )

    def rollout(
        self,
        target_position: Array,
        target_rotation: Array | None,
        time_s: Array,
        q0: Array | None,
        samples: int,
        rng: np.random.Generator,
        *,
        sigma_x: HandNoise | float = 0.0,
        method: str | None = None,
        noise: Noise = "coherent",
        chain: TaskChain | None = None,
    ) -> Rollout:
        """Predicts the postures along a hand path.

        Args:
            target_position: ``(T, 3)`` m, axes of the chain's base (the pelvis, or the foot that
                `led_chain` says); ``(T, 2, 3)``, right hand first, if both are led.
            target_rotation: ``(T, 3, 3)`` or ``(T, 2, 3, 3)``, base axes, or None: the task is then
                the position alone.
            time_s: ``(T,)`` s.
            q0: Start posture, ``(n,)`` rad, joints as in `joint_names`; None if it is not known,
                see `Follower.rollout`.
            samples: Sampled paths S.
            rng: Randomness; pass equal generators for candidates to be compared.
            sigma_x: Repeatability of the robot; a number is its position deviation, m.
            method: A trained method; the chosen one if not given.
            noise: ``coherent``, ``white`` (as in the paper) or ``none``.
            chain: The chain, for toys; the operator's if not given.

        Returns:
            The roll-out, all joints.

        Raises:
            TrajectoryError: The path or start posture is malformed, and its subclasses for a jump,
                a start that does not meet the path, and a path out of reach.
            UnsupportedMethodError: The method or task was not trained.
        """
        path = HandPath.checked(time_s, target_position, target_rotation)
        task: Task = "position" if target_rotation is None else "pose"
        hand = sigma_x if isinstance(sigma_x, HandNoise) else HandNoise(float(sigma_x))
        follower = self.follower(method, task, chain)
        return follower.rollout(path, q0, samples, rng, hand_noise=hand, noise=noise)


def _few(q: Array) -> Array:
    """Returns postures evenly through the demonstrations, enough to guess a start from."""
    return q[:: -(-len(q) // _STARTS)] if len(q) else q
