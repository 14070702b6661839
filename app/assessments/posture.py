"""The predicted body along one candidate: kept as arrays, played back as JSON."""

from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from app.plain import rounded

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PostureRecord:
    """One candidate's predicted postures.

    Attributes:
        time_s: ``(T,)`` s.
        joint_names: ``(n,)`` text.
        joint_position: ``(T, n)`` rad: the sample nearest to all others.
        samples: ``(K, T, n)`` rad: a few further ones, to show the spread.
        base_position: ``(T, 3)`` m, pelvis in the world.
        base_orientation_xyzw: ``(T, 4)``.
        samples_base_position: ``(K, T, 3)`` m: over standing feet, each sample's pelvis moves.
        samples_base_orientation_xyzw: ``(K, T, 4)``.
        effort_joint_names: ``(m,)`` text.
        effort_p50_nm: ``(T, m)`` N·m.
        effort_scale_nm: ``(m,)`` N·m: the largest over all candidates, so that colours compare.
        target_position: ``(T, 3)`` m, where the hand is led, or the middle of both, world.
    """

    time_s: Array
    joint_names: NDArray[np.str_]
    joint_position: Array
    samples: Array
    base_position: Array
    base_orientation_xyzw: Array
    samples_base_position: Array
    samples_base_orientation_xyzw: Array
    effort_joint_names: NDArray[np.str_]
    effort_p50_nm: Array
    effort_scale_nm: Array
    target_position: Array

    def to_arrays(self) -> dict[str, NDArray[Any]]:
        """Returns the arrays to store; single precision is a thousand times finer than needed."""
        out = {}
        for field in fields(self):
            array = getattr(self, field.name)
            out[field.name] = array.astype(np.float32) if array.dtype.kind == "f" else array
        return out

    @classmethod
    def from_arrays(cls, arrays: dict[str, NDArray[Any]]) -> Self:
        """Returns the record of stored arrays."""
        arrays = dict(arrays)
        for name in ("base_position", "base_orientation_xyzw"):
            # Records stored before pelves moved: it stands still in all samples.
            count = len(arrays["samples"])
            arrays.setdefault(f"samples_{name}", np.repeat(arrays[name][None], count, axis=0))
        return cls(**arrays)

    def to_dict(self) -> dict[str, Any]:
        """Returns the record as the client gets it."""
        efforts = self.effort_joint_names.tolist()
        return {
            "time_s": rounded(self.time_s),
            "joint_names": self.joint_names.tolist(),
            "joint_position": rounded(self.joint_position, 5),
            "samples": rounded(self.samples, 5),
            "base": _pose(self.base_position, self.base_orientation_xyzw),
            "samples_base": [
                _pose(position, orientation)
                for position, orientation in zip(
                    self.samples_base_position, self.samples_base_orientation_xyzw, strict=True
                )
            ],
            "effort_p50_nm": {
                name: rounded(self.effort_p50_nm[:, k], 3) for k, name in enumerate(efforts)
            },
            "effort_scale_nm": {
                name: rounded(self.effort_scale_nm[k], 3) for k, name in enumerate(efforts)
            },
            "target": {"position_m": rounded(self.target_position, 5)},
        }


def _pose(position: Array, orientation_xyzw: Array) -> dict[str, Any]:
    return {
        "position_m": rounded(position, 5),
        "orientation_xyzw": rounded(orientation_xyzw),
    }
