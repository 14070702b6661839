"""Velocities and accelerations of recorded motion, by local cubics in windows of time.

A Savitzky-Golay filter in its general form: around each frame a cubic is fitted to the samples
within a window of seconds, whatever their spacing, and its derivatives at the frame are the answer.
Nothing is fitted across a gap. Evenly sampled, inside a run, it is the classical filter.

Source: Savitzky and Golay 1964 (the filter); Gorry 1990 (windows at the ends); Latella et al. 2019,
section 3.2 (third order, for joint velocities and accelerations). Uneven spacing, gaps and
rotations derived here.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from human.errors import MotionError
from human.model import BASE_NQ, Array, IntArray
from human.motion import Motion, Provenance, check_quaternions, check_times
from human.rotations import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    quaternion_to_rotation_vector,
)
from human.spherical_rates import spherical_rates

#: Default window, s: passes motions of up to about 8 Hz at 60 frames per second.
WINDOW_S = 0.2
#: A step longer than this many median steps is a gap: nothing is fitted across it.
GAP_FACTOR = 3.5
#: Polynomial order, and the fewest samples it is fitted to where the run has them.
_ORDER = 3
_FEWEST = 5
#: Frames whose windows are gathered at once, to bound memory.
_CHUNK = 4096


@dataclass(frozen=True, slots=True)
class Derivatives:
    """A signal's local cubic at each frame.

    Attributes:
        value: ``(time, k)`` smoothed signal.
        first: ``(time, k)`` per second.
        second: ``(time, k)`` per second squared.
        weak: ``(time,)`` frames in runs too short for a cubic: order lowered, a lone frame gets
            zeros.
    """

    value: Array
    first: Array
    second: Array
    weak: NDArray[np.bool_]


class LocalCubic:
    """Weights of the local cubic at every frame of one time vector, reusable for many signals."""

    def __init__(
        self, time_s: ArrayLike, *, window_s: float = WINDOW_S, gap_factor: float = GAP_FACTOR
    ) -> None:
        """Fits the windows.

        Args:
            time_s: ``(time,)`` s, strictly increasing.
            window_s: full width of the window, s; at the ends of a run it is shifted inside, not
                cut.
            gap_factor: steps longer than this many median steps are gaps.

        Raises:
            MotionError: malformed times, or a window or factor that is not positive.
        """
        time = np.asarray(time_s, dtype=np.float64)
        check_times(time)
        if not (np.isfinite(window_s) and window_s > 0.0):
            raise MotionError(f"window_s: expected a positive number of seconds, got {window_s!r}")
        if not gap_factor > 1.0:
            raise MotionError(f"gap_factor: expected more than 1, got {gap_factor!r}")
        starts = run_starts(time, gap_factor)
        self.run_starts = starts
        low, high = _windows(time, starts, window_s)
        count = high - low
        self.weak: NDArray[np.bool_] = count <= _ORDER
        width = int(count.max())
        index = low[:, None] + np.arange(width)
        self._inside = index < high[:, None]
        self._index = np.minimum(index, len(time) - 1)
        self._weights = np.empty((3, len(time), width))
        for start in range(0, len(time), _CHUNK):
            part = slice(start, start + _CHUNK)
            self._weights[:, part] = _weights(time, self._index[part], self._inside[part], part)

    def derivatives(self, values: ArrayLike) -> Derivatives:
        """Differentiates signals ``(time, k)`` or ``(time,)``, finite.

        Raises:
            MotionError: another number of frames, or not finite.
        """
        signal = np.asarray(values, dtype=np.float64)
        if signal.ndim not in (1, 2) or len(signal) != len(self._index):
            raise MotionError(
                f"signal: expected shape ({len(self._index)},) or ({len(self._index)}, k), "
                f"got {signal.shape}"
            )
        if not np.all(np.isfinite(signal)):
            raise MotionError("signal: expected finite numbers, got NaN or infinity")
        flat = signal.reshape(len(signal), -1)
        out = np.empty((3, *flat.shape))
        for start in range(0, len(flat), _CHUNK):
            part = slice(start, start + _CHUNK)
            # One column of windows after another: the gathered block stays small.
            block = np.zeros((3, *flat[part].shape))
            for column in range(self._index.shape[1]):
                block += self._weights[:, part, column, None] * flat[self._index[part, column]]
            out[:, part] = block
        value, first, second = out.reshape(3, *signal.shape)
        return Derivatives(value, first, second, self.weak)

    def frames_near(self, marked: NDArray[np.bool_]) -> IntArray:
        """Returns the frames whose windows hold one of the marked frames ``(time,)``."""
        return np.flatnonzero(np.any(marked[self._index] & self._inside, axis=1))

    def body_rates(
        self, quat_xyzw: ArrayLike, frames: IntArray | None = None
    ) -> tuple[Array, Array]:
        """Differentiates orientations.

        Derived here: with ``phi_j = log(q_i^-1 q_j)`` the body's angular velocity and acceleration
        at frame ``i`` are the first and second derivative of ``phi`` there, because the right
        Jacobian of the logarithm and its rate act as identity and as zero on them at ``phi = 0``.

        Args:
            quat_xyzw: ``(time, 4)`` unit quaternions, body axes in world; signs do not matter.
            frames: ``(n,)`` where they are wanted; everywhere if not given.

        Returns:
            Angular velocity (rad/s) and acceleration (rad/s^2), ``(n, 3)``, in body axes.

        Raises:
            MotionError: not unit, or another number of frames.
        """
        quat = np.asarray(quat_xyzw, dtype=np.float64)
        if quat.shape != (len(self._index), 4):
            raise MotionError(f"quaternions: expected ({len(self._index)}, 4), got {quat.shape}")
        check_quaternions(quat)
        at = np.arange(len(quat)) if frames is None else frames
        velocity, acceleration = np.zeros((len(at), 3)), np.zeros((len(at), 3))
        inverse = quaternion_conjugate(quat[at])
        for column in range(self._index.shape[1]):
            there = quat[self._index[at, column]]
            turned = quaternion_to_rotation_vector(quaternion_multiply(inverse, there))
            velocity += self._weights[1, at, column, None] * turned
            acceleration += self._weights[2, at, column, None] * turned
        return velocity, acceleration


def run_starts(time_s: Array, gap_factor: float = GAP_FACTOR) -> NDArray[np.intp]:
    """Returns the first frame of each run of frames that no gap interrupts."""
    if len(time_s) < 2:
        return np.zeros(1, dtype=np.intp)
    step = np.diff(time_s)
    return np.concatenate([[0], np.flatnonzero(step > gap_factor * np.median(step)) + 1]).astype(
        np.intp
    )


def motion_from_configurations(
    model_dof_names: tuple[str, ...],
    time_s: ArrayLike,
    q: ArrayLike,
    *,
    window_s: float = WINDOW_S,
    gap_factor: float = GAP_FACTOR,
    base: str = "measured",
    flags: Mapping[str, NDArray[np.bool_]] | None = None,
    provenance: Provenance | None = None,
    spherical: Collection[IntArray] = (),
) -> Motion:
    """Makes a motion of configurations alone: ``q`` is kept, ``v`` and ``a`` are local cubics'.

    Joint angles that jump by whole turns are followed, not differentiated. Frames beside a gap are
    flagged ``gap``, frames in runs too short for a cubic ``weak_derivative``.

    Args:
        model_dof_names: ``n_dof`` names.
        time_s: ``(time,)`` s.
        q: ``(time, 7 + n_dof)`` configurations.
        window_s: full width of the window, s.
        gap_factor: steps longer than this many median steps are gaps.
        base: see `Motion`.
        flags: more flags to carry.
        provenance: where ``q`` came from; a step that names the filter is added.
        spherical: triples of joint angles ``(3,)``, x, y, z of one joint each, to differentiate
            through their rotation where the middle one nears 90 degrees.

    Returns:
        The motion, its base twist and acceleration in body axes as Pinocchio has them.

    Raises:
        MotionError: anything in time or configurations is malformed.
    """
    time = np.asarray(time_s, dtype=np.float64)
    cubic = LocalCubic(time, window_s=window_s, gap_factor=gap_factor)
    configuration = np.asarray(q, dtype=np.float64)
    if configuration.shape != (len(time), BASE_NQ + len(model_dof_names)):
        raise MotionError(
            f"q: expected shape ({len(time)}, {BASE_NQ + len(model_dof_names)}), "
            f"got {configuration.shape}"
        )
    joints = np.unwrap(configuration[:, BASE_NQ:], axis=0)
    along = cubic.derivatives(np.concatenate([configuration[:, :3], joints], axis=1))
    for dofs in spherical:
        own = along.first[:, 3 + dofs], along.second[:, 3 + dofs]
        near, rate, acceleration = spherical_rates(cubic, joints[:, dofs], *own)
        along.first[np.ix_(near, 3 + dofs)] = rate
        along.second[np.ix_(near, 3 + dofs)] = acceleration
    omega, alpha = cubic.body_rates(configuration[:, 3:7])
    to_body = np.swapaxes(quaternion_to_matrix(configuration[:, 3:7]), -1, -2)
    linear = (to_body @ along.first[:, :3, None])[..., 0]
    # Pinocchio's base acceleration is the rate of change of the body components of the twist.
    linear_rate = (to_body @ along.second[:, :3, None])[..., 0] - np.cross(omega, linear)
    beside = np.zeros(len(time), dtype=np.bool_)
    beside[cubic.run_starts[1:]] = True
    beside[cubic.run_starts[1:] - 1] = True
    origin = provenance or Provenance("configurations")
    return Motion(
        model_dof_names=tuple(model_dof_names),
        time_s=time,
        q=configuration,
        v=np.concatenate([linear, omega, along.first[:, 3:]], axis=1),
        a=np.concatenate([linear_rate, alpha, along.second[:, 3:]], axis=1),
        base=base,
        flags={**(flags or {}), "gap": beside, "weak_derivative": cubic.weak},
        provenance=origin.then(
            f"velocity and acceleration from local cubics, window {window_s:g} s, "
            f"gaps beyond {gap_factor:g} median steps"
        ),
    )


def _windows(
    time: Array, starts: NDArray[np.intp], window_s: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Returns first and past-the-last sample of each frame's window, inside the frame's run."""
    ends = np.append(starts[1:], len(time))
    run = np.searchsorted(starts, np.arange(len(time)), side="right") - 1
    first, last = starts[run], ends[run] - 1
    # A hair's breadth more than the window: a sample on its edge belongs to it on both sides.
    slack = 1e-6 * window_s
    begin = np.minimum(time - 0.5 * window_s, time[last] - window_s)
    begin = np.maximum(begin, time[first])
    low = np.maximum(np.searchsorted(time, begin - slack), first)
    high = np.minimum(np.searchsorted(time, begin + window_s + slack, side="right"), last + 1)
    # Sparse sampling: the nearest few instead, as far as the run has them.
    frame = np.arange(len(time))
    wanted = np.minimum(_FEWEST, last + 1 - first)
    few = high - low < wanted
    centred = np.clip(frame - wanted // 2, first, last + 1 - wanted)
    return np.where(few, centred, low), np.where(few, centred + wanted, high)


def _weights(
    time: Array, index: NDArray[np.intp], inside: NDArray[np.bool_], frames: slice
) -> Array:
    """Returns ``(3, frames, width)``: what a sample adds to value, first, second derivative."""
    away = np.where(inside, time[index] - time[frames, None], 0.0)
    reach = np.max(np.abs(away), axis=1)
    reach[reach == 0.0] = 1.0
    basis = (away / reach[:, None])[..., None] ** np.arange(_ORDER + 1)
    # A run of n samples carries a polynomial of order n - 1 at most.
    order = np.minimum(_ORDER, np.sum(inside, axis=1) - 1)
    fits = np.arange(_ORDER + 1) <= order[:, None]
    basis *= inside[..., None] & fits[:, None, :]
    weights = np.linalg.pinv(basis)
    scale = np.stack([np.ones_like(reach), 1.0 / reach, 2.0 / reach**2])
    return np.asarray(np.moveaxis(weights[:, :3], 1, 0) * scale[..., None])
