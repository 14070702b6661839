"""The path a robot leads the hand along: checked once, cut into steps that can be integrated."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from human.rotations import matrix_to_rotation_vector, rotation_vector_to_matrix
from prediction.chain import Task, TaskChain, held_tips
from prediction.errors import DiscontinuousTrajectoryError, TrajectoryError

Array = NDArray[np.float64]

#: Fastest a hand is led at, m/s and rad/s; beyond, the trajectory is taken to be broken.
SPEED_LIMIT_M_S = 5.0
SPEED_LIMIT_RAD_S = 20.0
#: Longest step integrated in one go: above, the step is cut.
STEP_S = 0.05
STEP_M = 0.04
STEP_RAD = 0.2
#: Steps a path may be cut into.
MAX_STEPS = 20_000
_ORTHONORMAL_TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class HandPath:
    """Target poses of the hand, or of both, in the chain's base axes.

    Attributes:
        time_s: ``(T,)`` s, increasing.
        position: ``(T, p)`` m; ``(T, hands, 3)`` if the chain leads several.
        rotation: ``(T, 3, 3)`` or ``(T, hands, 3, 3)``; None if the task is the position alone.
    """

    time_s: Array
    position: Array
    rotation: Array | None

    @classmethod
    def checked(cls, time_s: Array, position: Array, rotation: Array | None) -> "HandPath":
        """Checks a path.

        Raises:
            TrajectoryError: Shapes, times, values or rotations are wrong.
            DiscontinuousTrajectoryError: Two points are too far apart for the time between them.
        """
        time_s = np.asarray(time_s, dtype=np.float64)
        position = np.asarray(position, dtype=np.float64)
        if time_s.ndim != 1 or len(time_s) < 2:
            raise TrajectoryError(
                f"time_s has shape {time_s.shape}: a trajectory is at least two points"
            )
        if position.ndim not in (2, 3) or len(position) != len(time_s):
            raise TrajectoryError(
                f"positions have shape {position.shape}, expected ({len(time_s)}, 3), or "
                f"({len(time_s)}, hands, 3)"
            )
        named = [("time_s", time_s), ("position", position)]
        if rotation is not None:
            rotation = np.asarray(rotation, dtype=np.float64)
            expected = (*position.shape[:-1], 3, 3)
            if rotation.shape != expected:
                raise TrajectoryError(f"rotations have shape {rotation.shape}, expected {expected}")
            named.append(("rotation", rotation))
        for name, value in named:
            bad = ~np.isfinite(value).reshape(len(time_s), -1).all(axis=1)
            if bad.any():
                raise TrajectoryError(f"{name} is not finite at point {int(np.argmax(bad))}")
        steps = np.diff(time_s)
        if (steps <= 0).any():
            index = int(np.argmax(steps <= 0)) + 1
            raise TrajectoryError(
                f"time_s does not increase at point {index} ({time_s[index - 1]:.6f} then "
                f"{time_s[index]:.6f} s)"
            )
        if rotation is not None:
            stacked = rotation.reshape(len(time_s), -1, 3, 3)
            off = np.abs(np.swapaxes(stacked, 2, 3) @ stacked - np.eye(3)).max(axis=(1, 2, 3))
            mirrored = (np.linalg.det(stacked) < 0).any(axis=1)
            wrong = (off > _ORTHONORMAL_TOLERANCE) | mirrored
            if wrong.any():
                index = int(np.argmax(wrong))
                raise TrajectoryError(
                    f"the matrix of point {index} is not a rotation (off by {off[index]:.3g})"
                )
        path = cls(time_s, position, rotation)
        path._check_continuous()
        path._check_size()
        return path

    @classmethod
    def recorded(cls, chain: TaskChain, q: Array, time_s: Array, task: Task) -> "HandPath":
        """Returns the path on which recorded postures took the led tips of a chain.

        Args:
            chain: The chain.
            q: ``(T, n)`` rad.
            time_s: ``(T,)`` s.
            task: Whether the orientation belongs to the path.
        """
        position, rotation, _ = chain.forward_and_jacobian(q)
        if rotation.ndim == 4:
            held = held_tips(chain)
            position, rotation = position.reshape(len(q), -1, 3)[:, held:], rotation[:, held:]
            if position.shape[1] == 1:
                position, rotation = position[:, 0], rotation[:, 0]
        return cls(time_s, position, rotation if task == "pose" else None)

    @property
    def hands(self) -> int:
        """How many hands are led."""
        return 1 if self.position.ndim == 2 else self.position.shape[1]

    def _lengths(self) -> tuple[Array, Array]:
        """Returns how far the hand that goes furthest moves and turns, ``(T - 1,)`` each."""
        moved = np.linalg.norm(np.diff(self.position, axis=0), axis=-1)
        turned = np.zeros_like(moved)
        if self.rotation is not None:
            turned = np.linalg.norm(self._turns(), axis=-1)
        steps = len(moved)
        return moved.reshape(steps, -1).max(axis=1), turned.reshape(steps, -1).max(axis=1)

    def _turns(self) -> Array:
        assert self.rotation is not None
        relative = self.rotation[1:] @ np.swapaxes(self.rotation[:-1], -1, -2)
        return matrix_to_rotation_vector(relative)

    def _check_continuous(self) -> None:
        steps = np.diff(self.time_s)
        lengths = self._lengths()
        for length, limit, angular in (
            (lengths[0], SPEED_LIMIT_M_S, False),
            (lengths[1], SPEED_LIMIT_RAD_S, True),
        ):
            speed = length / steps
            if (speed > limit).any():
                index = int(np.argmax(speed > limit))
                raise DiscontinuousTrajectoryError(
                    index + 1, float(length[index]), float(speed[index]), limit, angular
                )

    def _check_size(self) -> None:
        steps = self.substeps() * (len(self.time_s) - 1)
        if steps > MAX_STEPS:
            longest = int(np.argmax(np.diff(self.time_s)))
            raise TrajectoryError(
                f"the trajectory takes {steps} steps of {STEP_S} s or less, and {MAX_STEPS} is the "
                f"most: its longest interval, before point {longest + 1}, lasts "
                f"{self.time_s[longest + 1] - self.time_s[longest]:.4g} s; check that times are in "
                "seconds, or cut pauses out"
            )

    def substeps(self) -> int:
        """Returns into how many steps each interval is cut so that it can be integrated."""
        moved, turned = self._lengths()
        cuts = (
            np.diff(self.time_s).max() / STEP_S,
            moved.max() / STEP_M,
            turned.max() / STEP_RAD,
        )
        return max(1, int(np.ceil(max(cuts) - 1e-9)))

    def held(self, points: int) -> "HandPath":
        """Returns the path with its last point held until it has ``points`` of them."""
        missing = points - len(self.time_s)
        if missing <= 0:
            return self
        step = self.time_s[-1] - self.time_s[-2]
        time_s = np.concatenate([self.time_s, self.time_s[-1] + step * np.arange(1, missing + 1)])

        def hold(values: Array) -> Array:
            return np.concatenate([values, np.repeat(values[-1:], missing, axis=0)])

        rotation = None if self.rotation is None else hold(self.rotation)
        return HandPath(time_s, hold(self.position), rotation)

    def refined(self, substeps: int) -> "HandPath":
        """Returns the path with each interval cut evenly: straight lines, constant turning rate."""
        if substeps == 1:
            return self
        share = np.arange(1, substeps + 1) / substeps

        def between(values: Array) -> Array:
            delta = np.diff(values, axis=0)
            inner = values[:-1, None] + share.reshape(-1, *[1] * (values.ndim - 1)) * delta[:, None]
            return np.concatenate([values[:1], inner.reshape(-1, *values.shape[1:])])

        rotation = None
        if self.rotation is not None:
            vectors = self._turns()[:, None] * share.reshape(-1, *[1] * (self.rotation.ndim - 2))
            inner = rotation_vector_to_matrix(vectors) @ self.rotation[:-1, None]
            shape = self.rotation.shape[1:]
            rotation = np.concatenate([self.rotation[:1], inner.reshape(-1, *shape)])
        return HandPath(between(self.time_s), between(self.position), rotation)


def orientation_error(target: Array, actual: Array) -> Array:
    """Returns the rotation vector ``(..., 3)`` rad from ``actual`` to ``target``, base axes.

    Args:
        target: ``(..., 3, 3)``.
        actual: ``(..., 3, 3)``.
    """
    # Of target actual': half the antisymmetric part, and the trace, without the other products.
    t, a = np.moveaxis(target, (-2, -1), (0, 1)), np.moveaxis(actual, (-2, -1), (0, 1))
    axis = np.empty((*t.shape[2:], 3), dtype=t.dtype)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        axis[..., i] = 0.5 * (t[k] * a[j] - t[j] * a[k]).sum(axis=0)
    sine = np.linalg.norm(axis, axis=-1)
    cosine = 0.5 * ((t * a).sum(axis=(0, 1)) - 1.0)
    angle = np.arctan2(sine, cosine)
    if (angle > 3.0).any():  # the sine loses the axis near half a turn
        return matrix_to_rotation_vector(target @ np.swapaxes(actual, -1, -2))
    # angle / sin(angle), by its series where both vanish
    safe = np.where(sine < 1e-6, 1.0, sine)
    ratio = np.where(sine < 1e-6, 1.0 + sine**2 / 6.0, angle / safe)
    return np.asarray(axis * ratio[..., None])
