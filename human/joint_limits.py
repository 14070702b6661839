"""Joint limits from published ranges of motion.

The table, with the source of each line, is ``human/data/joint_limits.json``.
"""

import json
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from human.model import Array
from human.names import AXES, mirrored


@cache
def joint_limits_table() -> dict[str, Any]:
    """Returns the published ranges as read from the data file; do not change it."""
    table: dict[str, Any] = json.loads(
        files("human").joinpath("data/joint_limits.json").read_text()
    )
    return table


def joint_limits(dof_names: tuple[str, ...]) -> tuple[Array, Array]:
    """Returns the lower and upper limits ``(n_dof,)`` in rad of named degrees of freedom.

    The left side is the right side mirrored: turning about x and z changes sign, about y does not.

    Source: Boone and Azen 1979, AAOS 1965, White and Panjabi 1990, Inman et al. 1944; line by line
    in the data file.
    """
    joints = joint_limits_table()["joints"]
    ranges = np.empty((len(dof_names), 2))
    for row, name in enumerate(dof_names):
        joint, rotation = name.rsplit("_", 1)
        axis = "xyz"[AXES.index(rotation)]
        low, high = joints[joint if joint in joints else mirrored(joint)][axis]["range"]
        flip = joint not in joints and axis != "y"
        ranges[row] = (-high, -low) if flip else (low, high)
    lower, upper = np.deg2rad(ranges).T
    return lower, upper
