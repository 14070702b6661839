"""What is assumed of a person nobody has seen move: measured once over a few people, rounded."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from prediction.chain import Task
from prediction.errors import UnsupportedMethodError

Array = NDArray[np.float64]

#: Groups of joints in the table; both sides, and all levels of the spine, are one.
GROUPS = ("Spine", "C7Shoulder", "Shoulder", "Elbow", "Wrist")
_SPINE = ("L5S1", "L4L3", "L1T12", "T9T8")


@dataclass(frozen=True, slots=True)
class GenericPrior:
    """How fast people's joints move, and how far postures are from a method's roll-out.

    Attributes:
        rate: Root mean square joint velocity, ``(n,)`` rad/s.
        deviation: Stationary standard deviation of each joint, ``(n,)`` rad.
        length: Correlation length of the deviation, s at that velocity.
    """

    rate: Array
    deviation: Array
    length: float


def joint_group(name: str) -> tuple[str, int]:
    """Returns the group of a degree of freedom and its axis.

    Args:
        name: As ``jRightShoulder_rotx`` or ``jL4L3_roty``.

    Raises:
        UnsupportedMethodError: The table does not tell of it.
    """
    joint, _, axis = name.removeprefix("j").rpartition("_rot")
    joint = joint.removeprefix("Right").removeprefix("Left")
    group = "Spine" if joint in _SPINE else joint
    if group not in GROUPS or axis not in ("x", "y", "z"):
        raise UnsupportedMethodError("joint of the generic prior", name, GROUPS)
    return group, "xyz".index(axis)


@cache
def prior_table() -> Mapping[str, Any]:
    """Returns the data file as read; do not change it."""
    table: dict[str, Any] = json.loads(
        files("prediction").joinpath("data/generic_prior.json").read_text("utf-8")
    )
    return table


def generic_prior(
    names: Sequence[str], method: str, task: Task, table: Mapping[str, Any] | None = None
) -> GenericPrior:
    """Returns the prior of some joints.

    Args:
        names: Joint names, as in `human.DOF_NAMES`.
        method: ``w-ik`` or ``minimum-norm``.
        task: Pose or position.
        table: The numbers; those of the package if not given.

    Raises:
        UnsupportedMethodError: The table does not tell of a joint.

    Source: ``prediction/data/generic_prior.json``, measured by
    ``python -m benchmarks.prediction.generic_prior RECORDINGS``.
    """
    table = prior_table() if table is None else table
    part = table[method][task]
    places = [joint_group(name) for name in names]
    return GenericPrior(
        np.deg2rad([table["rate_deg_s"][group][axis] for group, axis in places]),
        np.deg2rad([part["deviation_deg"][group][axis] for group, axis in places]),
        float(part["length_s"]),
    )
