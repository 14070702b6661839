"""A motion: configurations over time with their derivatives, and where they came from."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from human.errors import MotionError
from human.model import BASE_NQ, BASE_NV, Array

#: Frames by mask, by index or by slice.
FrameIndex = NDArray[np.bool_] | NDArray[np.intp] | slice

#: Largest departure of a base quaternion's norm from one that is put down to rounding.
_NORM_TOLERANCE = 1e-6
#: Flags of frames on which a segment's posture was not measured are this and its name.
UNSEEN = "unseen "


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a motion came from and what was done to it.

    Attributes:
        source: the recording or simulator, in words.
        sha256: digest of the source file, empty if there is none.
        steps: what was done, in order, one sentence each.
        assumed: what was assumed rather than measured: name -> why.
    """

    source: str
    sha256: str = ""
    steps: tuple[str, ...] = ()
    assumed: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Makes the mapping read-only."""
        object.__setattr__(self, "assumed", MappingProxyType(dict(self.assumed)))

    def __reduce__(self) -> tuple[type["Provenance"], tuple[object, ...]]:
        """Lets a provenance be sent to another process."""
        return type(self), (self.source, self.sha256, self.steps, dict(self.assumed))

    def then(self, step: str) -> "Provenance":
        """Returns the same provenance with one more step."""
        return replace(self, steps=(*self.steps, step))


@dataclass(frozen=True, eq=False)
class Motion:
    """Configurations of one person over time, SI units; frozen, its arrays read-only.

    `human.differentiate.motion_from_configurations` makes one from configurations alone.

    Attributes:
        model_dof_names: ``n_dof`` names of the joint angles, as in the model.
        time_s: ``(time,)`` s, strictly increasing.
        q: ``(time, 7 + n_dof)``: base position (m, world), base quaternion xyzw, joint angles
            (rad).
        v: ``(time, 6 + n_dof)``: base twist in body axes, linear (m/s) first, then joint rates
            (rad/s).
        a: ``(time, 6 + n_dof)``: derivative of ``v`` in Pinocchio's sense.
        base: what the base is relative to: ``measured`` in the world, or ``fixed`` where it was
            assumed.
        flags: name -> ``(time,)`` booleans, frames that something is wrong with or special about.
        provenance: where it came from.

    Raises:
        MotionError: shapes do not fit, a number is not finite, times do not increase, or a
            quaternion is not unit; ``index`` is the first such frame.
    """

    model_dof_names: tuple[str, ...]
    time_s: Array
    q: Array
    v: Array
    a: Array
    base: str = "measured"
    flags: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    provenance: Provenance = field(default_factory=lambda: Provenance("unknown"))

    def __post_init__(self) -> None:
        """Checks everything and makes arrays read-only."""
        n_dof = len(self.model_dof_names)
        for name in ("time_s", "q", "v", "a"):
            array = np.array(getattr(self, name), dtype=np.float64)
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        check_times(self.time_s)
        frames = len(self.time_s)
        for name, width in (("q", BASE_NQ + n_dof), ("v", BASE_NV + n_dof), ("a", BASE_NV + n_dof)):
            array = getattr(self, name)
            if array.shape != (frames, width):
                raise MotionError(f"{name}: expected shape ({frames}, {width}), got {array.shape}")
            _refuse(
                ~np.all(np.isfinite(array), axis=1),
                f"{name}: expected finite numbers, got NaN or infinity",
            )
        check_quaternions(self.q[:, 3:7])
        flags = {}
        for name, flag in self.flags.items():
            values = np.array(flag, dtype=np.bool_)
            if values.shape != (frames,):
                raise MotionError(f"flag {name!r}: expected shape ({frames},), got {values.shape}")
            values.flags.writeable = False
            flags[name] = values
        object.__setattr__(self, "flags", MappingProxyType(flags))

    def __getstate__(self) -> dict[str, object]:
        """Lets a motion be sent to another process."""
        return self.__dict__ | {"flags": dict(self.flags)}

    def __setstate__(self, state: dict[str, object]) -> None:
        """Takes the fields back and makes them read-only again."""
        self.__dict__.update(state)
        self.__post_init__()

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.time_s)

    @property
    def duration_s(self) -> float:
        """Time from the first frame to the last, s."""
        return float(self.time_s[-1] - self.time_s[0])

    @property
    def joint_angles(self) -> Array:
        """Joint angles ``(time, n_dof)``, rad."""
        return self.q[:, BASE_NQ:]

    @property
    def joint_rates(self) -> Array:
        """Joint rates ``(time, n_dof)``, rad/s."""
        return self.v[:, BASE_NV:]

    @property
    def unseen_segments(self) -> dict[str, NDArray[np.bool_]]:
        """Segments to the frames ``(time,)`` on which nothing measured their posture."""
        return {
            name.removeprefix(UNSEEN): flag
            for name, flag in self.flags.items()
            if name.startswith(UNSEEN) and np.any(flag)
        }

    def slice(self, start_s: float | None = None, end_s: float | None = None) -> Self:
        """Returns the frames with ``start_s <= time < end_s``; times keep their origin.

        Raises:
            MotionError: no frame is left.
        """
        low = -np.inf if start_s is None else start_s
        high = np.inf if end_s is None else end_s
        return self.select((self.time_s >= low) & (self.time_s < high))

    def select(self, frames: FrameIndex) -> Self:
        """Returns some of the frames, by mask, index or slice, in order.

        Raises:
            MotionError: no frame is left, or the order is not that of time.
        """
        if not len(self.time_s[frames]):
            raise MotionError(
                "no frame left: the motion runs from "
                f"{self.time_s[0]:.3f} to {self.time_s[-1]:.3f} s"
            )
        return replace(
            self,
            time_s=self.time_s[frames],
            q=self.q[frames],
            v=self.v[frames],
            a=self.a[frames],
            flags={name: flag[frames] for name, flag in self.flags.items()},
        )


def check_times(time_s: Array) -> None:
    """Checks a time vector.

    Raises:
        MotionError: empty, not one-dimensional, not finite, or not strictly increasing.
    """
    if time_s.ndim != 1 or not len(time_s):
        raise MotionError(
            f"time_s: expected shape (time,) with at least one frame, got {time_s.shape}"
        )
    _refuse(~np.isfinite(time_s), "time_s: expected finite seconds, got NaN or infinity")
    stuck = np.diff(time_s) <= 0.0
    if np.any(stuck):
        index = int(np.argmax(stuck)) + 1
        raise MotionError(
            f"time_s: expected strictly increasing seconds, got {time_s[index]:g} after "
            f"{time_s[index - 1]:g} at frame {index}; sort the frames and drop repeated ones",
            index,
        )


def check_quaternions(quat_xyzw: Array) -> None:
    """Checks that base quaternions ``(time, 4)`` are unit.

    Raises:
        MotionError: one is not.
    """
    norm = np.linalg.norm(quat_xyzw, axis=-1)
    bad = ~(np.abs(norm - 1.0) <= _NORM_TOLERANCE)
    if np.any(bad):
        index = int(np.argmax(bad))
        raise MotionError(
            f"base quaternion: expected norm 1, got {norm[index]:.6g} at frame {index}; "
            "normalize it where it is read",
            index,
        )


def _refuse(bad: NDArray[np.bool_], message: str) -> None:
    if np.any(bad):
        index = int(np.argmax(bad))
        raise MotionError(f"{message} at frame {index}", index)
