"""Squared-exponential kernels over posture and hand velocity."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
KernelKind = Literal["separate", "paper"]
KERNELS: tuple[KernelKind, ...] = ("separate", "paper")


@dataclass(frozen=True, slots=True)
class InputScaling:
    """Brings posture and hand velocity to comparable numbers before any length-scale acts.

    ``paper``: every input by its own deviation, one length-scale. ``separate``: all joints by one
    common deviation, since angles are already in one unit and dividing each by its own would let
    the joints that stand still dominate the distance; linear and angular hand velocity by one each;
    and a length-scale of their own for the velocities, because a preference of posture depends on
    the posture more smoothly than, and often not at all on, the velocity.

    Attributes:
        kind: Which of the two.
        divisor: ``(n + m,)``.
        joints: n.
    """

    kind: KernelKind
    divisor: Array
    joints: int

    @classmethod
    def of(cls, kind: KernelKind, q: Array, xdot: Array, linear_rows: int) -> "InputScaling":
        """Measures the divisors on training inputs ``(N, n)`` and ``(N, m)``."""
        joints = q.shape[1]
        spread = np.concatenate([q.std(axis=0), np.sqrt((xdot**2).mean(axis=0))])
        groups = [slice(0, joints)]
        groups += [slice(joints, joints + linear_rows), slice(joints + linear_rows, None)]
        divisor = spread.copy()
        for group in groups:
            if divisor[group].size == 0:
                continue
            common = float(np.sqrt((spread[group] ** 2).mean()))
            # A group that never varies carries no distance, whatever it is divided by.
            common = common if common > 0 else 1.0
            floor = 1e-3 * common
            divisor[group] = common if kind == "separate" else np.maximum(spread[group], floor)
        return cls(kind, divisor, joints)

    @property
    def scales(self) -> int:
        """Number of length-scales."""
        return 2 if self.kind == "separate" else 1

    @property
    def groups(self) -> list[slice]:
        """The inputs that share a length-scale, one entry per length-scale."""
        split = [slice(0, self.joints), slice(self.joints, None)]
        return split if self.kind == "separate" else [slice(None)]

    @property
    def constant_mean(self) -> bool:
        """Whether a process of these inputs has a constant mean, as the paper's has."""
        return self.kind == "paper"

    def inputs(self, q: Array, xdot: Array, log_scale: Array) -> Array:
        """Returns inputs ``(..., n + m)`` whose squared distance is the kernel's exponent.

        Args:
            q: ``(..., n)``.
            xdot: ``(..., m)``.
            log_scale: ``(scales,)`` logs of the length-scales, in deviations.
        """
        per_input = np.full(self.divisor.shape, log_scale[0])
        if self.kind == "separate":
            per_input[self.joints :] = log_scale[1]
        factor = 1.0 / (self.divisor * np.exp(per_input))
        return np.asarray(np.concatenate([q, xdot], axis=-1) * factor)


def squared_exponential(left: Array, right: Array) -> Array:
    """Returns ``exp(-|a - b|^2 / 2)`` for ``(N, d)`` and ``(M, d)``, as ``(N, M)``.

    Source: Vianello et al. 2021, section IV-B, the deviation and length-scale being outside.
    """
    # The squares ride along in the product: the large array is then touched twice, not five times.
    # About the middle of one side, where little is lost when they cancel.
    middle = right.mean(axis=0)
    left, right = left - middle, right - middle
    one = np.ones((1, 1), dtype=left.dtype)
    squares = [-0.5 * (side**2).sum(-1, keepdims=True) for side in (left, right)]
    ones = [np.broadcast_to(one, (len(side), 1)) for side in (left, right)]
    exponent = np.concatenate([left, squares[0], ones[0]], axis=1) @ (
        np.concatenate([right, ones[1], squares[1]], axis=1).T
    )
    np.minimum(exponent, 0.0, out=exponent)
    return np.asarray(np.exp(exponent, out=exponent))
