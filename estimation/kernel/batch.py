"""Runs the compiled kernel over the frames of a run."""

from collections.abc import Sequence
from typing import Self

import numpy as np

from estimation.covariances import ModelCovariances
from estimation.kernel.layout import LANES, TABLES, columns
from estimation.kernel.machine_code import Solve
from estimation.kernel.sensor_tables import Tables, tables
from estimation.sensors import Measurement
from estimation.spatial import Array, IntArray
from estimation.tree import BASE_NQ, BASE_NV, EstimationTree
from estimation.tree_kinematics import rows

#: Frames whose inputs are gathered at once: few enough to stay near the processor.
CHUNK = 1024
#: Beside its trace, the least pivot of the base's information below which numpy decides.
_DOUBTFUL = 1e-13
Results = dict[str, Array]


def supports(covariances: ModelCovariances) -> bool:
    """Says whether the kernel solves this model: any but one carried over from hinges."""
    return not covariances.carried_from_hinges


class Call:
    """One set of tables and working memory; used by one thread at a time."""

    def __init__(
        self,
        solve: Solve,
        tree: EstimationTree,
        inputs: Tables,
        frames: int,
        before: Self | None = None,
    ) -> None:
        """Allocates room for the inputs of ``frames`` frames.

        Args:
            solve: the compiled kernel.
            tree: the links.
            inputs: its tables.
            frames: how many it takes at once.
            before: a call that is over, whose working memory may be used again.
        """
        size = LANES * inputs.slots
        self._work: Array = before._work if before and len(before._work) >= size else aligned(size)
        self._solve = solve
        self._n_dof = tree.n_dof
        self._starts, _ = columns(tree.n_dof)
        self.row = np.zeros((frames, inputs.width))
        self._own = {
            "work": self._work,
            "rows": np.zeros(LANES, dtype=np.int64),
            "frames": self.row,
            "constants": inputs.constants,
            "links": inputs.links,
            "plates": inputs.plates,
            "motion_sensors": inputs.motion_sensors,
            "sites": inputs.pairs,
            "paths": inputs.paths,
            "settings": inputs.settings,
        }
        self._addresses = np.zeros(len(TABLES), dtype=np.int64)
        self._table = self._addresses.ctypes.data
        for place, name in enumerate(TABLES):
            if name in self._own:
                self._addresses[place] = self._own[name].ctypes.data

    def state(self, q: Array, v: Array) -> None:
        """Takes the states of up to as many frames as there is room for."""
        row, n, start = self.row[: len(q)], self._n_dof, self._starts
        angles = q[:, BASE_NQ:]
        np.sin(angles, out=row[:, :n])
        np.cos(angles, out=row[:, n : 2 * n])
        row[:, 2 * n : 3 * n] = v[:, BASE_NV:]
        row[:, start["quaternion"] : start["quaternion"] + 4] = q[:, 3:BASE_NQ]
        row[:, start["position"] : start["position"] + 3] = q[:, :3]
        row[:, start["omega"] : start["omega"] + 3] = v[:, 3:BASE_NV]

    def run(self, out: Results, first: int, count: int) -> None:
        """Solves the first ``count`` frames taken; results go to ``out`` from row ``first`` on."""
        for place, name in enumerate(TABLES):
            if name in out:
                array = out[name]
                start = array.__array_interface__["data"][0]
                self._addresses[place] = start + first * array.strides[0]
        self._solve(self._table, count)


def aligned(size: int) -> Array:
    """Returns zeros that start where whole vectors do."""
    room = np.zeros(size + LANES)
    skip = -room.ctypes.data // 8 % LANES
    return room[skip : skip + size]


def results(tree: EstimationTree, frames: int, n_sites: int, spreads: bool) -> Results:
    """Makes room for what the kernel puts out, under the names of `Estimate`."""
    links, joints = (frames, tree.n_links, 6), (frames, tree.n_links - 1, 6)
    shapes: dict[str, tuple[int, ...]] = {
        "link_acceleration": links,
        "external_wrench": links,
        "joint_wrench": joints,
        "joint_acceleration": (frames, tree.n_dof),
        "torque": (frames, tree.n_dof),
        "link_rotation": (frames, tree.n_links, 3, 3),
        "residual": (frames, 6),
        "residual_chi2": (frames,),
        "status": (frames, 3),
    }
    if spreads:
        shapes |= {
            "link_acceleration_sd": links,
            "external_wrench_sd": links,
            "joint_wrench_sd": joints,
            "joint_acceleration_sd": (frames, tree.n_dof),
            "torque_sd": (frames, tree.n_dof),
            "joint_moment_covariance": (frames, tree.n_links - 1, 3, 3),
            "site_covariance": (frames, 6 * n_sites, 6 * n_sites),
            "site_prior": (frames, 6 * n_sites, 6 * n_sites),
        }
    return {name: np.empty(shape) for name, shape in shapes.items()}


def solve_frames(
    solve: Solve,
    tree: EstimationTree,
    q: Array,
    v: Array,
    measurements: Sequence[Measurement],
    covariances: ModelCovariances,
    sites: Sequence[str],
    *,
    spreads: bool,
) -> tuple[Results, IntArray]:
    """Solves checked frames.

    Args:
        solve: the compiled kernel.
        tree: the links.
        q: ``(frames, 7 + n_dof)``.
        v: ``(frames, 6 + n_dof)``.
        measurements: all finite, on links of the tree.
        covariances: of a model that the kernel `supports`.
        sites: the links that something unmeasured may push on.
        spreads: whether to compute standard deviations.

    Returns:
        Results under the names of `Estimate`, and the frames that numpy should look at again,
        because digits may have been lost there.

    Raises:
        MeasurementError: a value or covariance has the wrong shape.
        CovarianceError: a covariance is not one.
        MissingMeasurementError: nobody knows the joint accelerations.
    """
    frames = len(q)
    inputs = tables(tree, measurements, covariances, frames, sites, spreads)
    out = results(tree, frames, len(sites), spreads)
    call = Call(solve, tree, inputs, min(frames, CHUNK))
    for part in rows(frames, CHUNK):
        call.state(q[part], v[part])
        for start, array in zip(inputs.starts, inputs.by_frame, strict=True):
            here = array[part]
            call.row[: len(here), start : start + here.shape[1]] = here
        call.run(out, part.start, part.stop - part.start)
    return out, doubtful(out.pop("status"))


def doubtful(status: Array) -> IntArray:
    """Returns the frames whose base is hardly held, or that digits were lost on.

    Args:
        status: ``(frames, 3)`` least pivot and trace of the base's information; the least of what
            must be positive, not a number where a result is none.
    """
    held = status[:, 0] > _DOUBTFUL * np.maximum(1.0, status[:, 1])
    return np.flatnonzero(~(held & (status[:, 2] >= 0.0)))
