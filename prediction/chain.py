"""The arm a predictor works on: what it needs of a kinematic chain, and chains with fewer joints.

`human.Chain` fits the protocol; so does any toy arm with the same four members. A chain may have
several tips, such as both hands, or a hand and the other foot. Rows of a task are then those of its
Jacobian: first the linear ones, tip by tip, then the angular ones; held tips before led ones. So
the task of leading positions alone, in which held tips keep their orientation too, is the first
rows of the task of leading poses.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Task = Literal["pose", "position"]
TASKS: tuple[Task, ...] = ("pose", "position")


class TaskChain(Protocol):
    """A chain from a fixed base to a hand.

    A chain with more tips than one says how many of them are held by an attribute ``held_tips``;
    see `held_tips`.
    """

    @property
    def dof_names(self) -> Sequence[str]:
        """Joint names, ``n`` of them."""

    @property
    def lower(self) -> Array:
        """Lower joint limits, ``(n,)`` rad."""

    @property
    def upper(self) -> Array:
        """Upper joint limits, ``(n,)`` rad."""

    def forward_and_jacobian(self, q: Array) -> tuple[Array, Array, Array]:
        """Returns hand position, rotation and Jacobian.

        Args:
            q: ``(..., n)`` rad.

        Returns:
            Position ``(..., p)`` m and rotation ``(..., 3, 3)`` in base axes, and the Jacobian
            ``(..., p + r, n)``, linear rows first. ``p`` is 3 (2 for a planar arm) and ``r`` is 3
            (0 for an arm whose orientation is no task). With ``t`` tips, ``p`` and ``r`` are ``3
            t`` and the rotation is ``(..., t, 3, 3)``.
        """


def held_tips(chain: TaskChain) -> int:
    """Returns how many tips, the first ones, stay where they are at the start: a foot, say."""
    return int(getattr(chain, "held_tips", 0))


@dataclass(frozen=True, slots=True)
class JointReduction:
    """Which joints are learned, and how the others follow them.

    A joint that never moves, or that moves as a fixed combination of others (a motion-capture suit
    that spreads one measured spine angle over four joints), has no law of its own to learn and
    makes densities meaningless. Such a joint is dropped from the learned set and follows it:
    ``dq_all = expansion @ dq_kept``. Its rows are the least-squares coupling seen in the
    demonstrations, so a locked joint stays where it starts and a dependent one keeps its share.

    Attributes:
        names: All joint names, ``n``.
        kept: Indices of the learned joints, ``(r,)``.
        expansion: ``(n, r)``.
    """

    names: tuple[str, ...]
    kept: NDArray[np.int64]
    expansion: Array

    @classmethod
    def identity(cls, names: Sequence[str]) -> "JointReduction":
        """Keeps every joint."""
        size = len(names)
        return cls(tuple(names), np.arange(size), np.eye(size))

    @property
    def kept_names(self) -> tuple[str, ...]:
        """Names of the learned joints."""
        return tuple(self.names[i] for i in self.kept)

    @property
    def dropped_names(self) -> tuple[str, ...]:
        """Names of the joints that follow."""
        kept = set(self.kept.tolist())
        return tuple(name for i, name in enumerate(self.names) if i not in kept)

    def coupling(self, name: str) -> dict[str, float]:
        """Returns what a dropped joint follows: share by learned joint, empty if it is locked."""
        row = self.expansion[self.names.index(name)]
        return {self.names[i]: float(c) for i, c in zip(self.kept, row, strict=True) if c != 0.0}

    @property
    def whole(self) -> bool:
        """Whether every joint is learned."""
        return len(self.kept) == len(self.names)

    def expand(self, q_kept: Array, anchor: Array) -> Array:
        """Returns all joints ``(..., n)`` of learned ones ``(..., r)``, from an anchor posture."""
        if self.whole:
            return q_kept
        return anchor + (q_kept - anchor[..., self.kept]) @ self.expansion.T


@dataclass(frozen=True, slots=True)
class ReducedChain:
    """A chain seen through its learned joints, the others following from an anchor posture.

    Attributes:
        chain: The whole chain.
        reduction: Learned joints.
        anchor: Posture all joints start from, ``(n,)``, or ``(..., n)`` for one per leading row.
        task: ``pose`` keeps all rows of the Jacobian, ``position`` the linear ones.
    """

    chain: TaskChain
    reduction: JointReduction
    anchor: Array
    task: Task = "pose"

    def expand(self, q: Array) -> Array:
        """Returns all joints, ``(..., n)``."""
        return self.reduction.expand(q, self.anchor)

    def forward_and_jacobian(self, q: Array) -> tuple[Array, Array, Array]:
        """Returns what the task is about, on the learned joints.

        Args:
            q: Learned joints, ``(..., r)`` rad.

        Returns:
            Position of all tips ``(..., p)``, rotation ``(..., t, 3, 3)`` of the ``t`` tips whose
            orientation is kept or led, and the Jacobian ``(..., p + 3 t, r)``.
        """
        position, rotation, jacobian = self.chain.forward_and_jacobian(self.expand(q))
        linear, rows = position.shape[-1], jacobian.shape[-2]
        if self.task == "position":
            rows = linear + 3 * held_tips(self.chain)
        if rotation.ndim == position.ndim + 1:
            rotation = rotation[..., None, :, :]
        rotation = rotation[..., : (rows - linear) // 3, :, :]
        jacobian = jacobian[..., :rows, :]
        if not self.reduction.whole:
            expansion = self.reduction.expansion
            flat = jacobian.reshape(-1, jacobian.shape[-1]) @ expansion
            jacobian = flat.reshape(*jacobian.shape[:-1], expansion.shape[1])
        return position, rotation, jacobian
