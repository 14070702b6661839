"""Forward kinematics of whole batches of configurations at once.

Arrays are computed with the batch as the fastest axis, one segment after another, so that every
numpy call works on the whole batch; the results are views with the batch first. Every joint turns
about a segment axis and every joint offset is a pure translation, so a revolute costs two column
updates and no matrix product.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from human.chain import Chain
from human.columns import cosine_sine, shift_along, turn
from human.errors import ConfigurationError
from human.model import BASE_NQ, Array, HumanModel
from human.rotations import quaternion_to_matrix

__all__ = ["Chain", "SegmentPoses", "forward_kinematics", "frame_poses"]

#: Configurations worked on at once: a segment's matrices then stay in the processor's cache.
CHUNK = 2048
#: Largest departure of the base quaternion's norm from one that is put down to rounding.
_NORM_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class SegmentPoses:
    """Where the segments are, in world axes.

    Attributes:
        segment_names: ``n_segments`` names, the order of the arrays.
        rotation: ``(..., n_segments, 3, 3)``; column ``k`` is the segment's axis ``k``.
        position: ``(..., n_segments, 3)`` m, the segment's origin: its proximal joint centre.
    """

    segment_names: tuple[str, ...]
    rotation: Array
    position: Array

    def of(self, segment: str) -> tuple[Array, Array]:
        """Returns the rotation ``(..., 3, 3)`` and position ``(..., 3)`` of one segment."""
        index = self.segment_names.index(segment)
        return self.rotation[..., index, :, :], self.position[..., index, :]


def forward_kinematics(model: HumanModel, q: ArrayLike) -> SegmentPoses:
    """Computes the pose of every segment.

    Args:
        model: the person.
        q: ``(..., nq)`` configurations: base position (m), base quaternion xyzw, joint angles
            (rad).

    Returns:
        Poses in world axes with the same leading dimensions; equal to Pinocchio's to rounding.

    Raises:
        ConfigurationError: ``q`` has another length, is not finite, or a base quaternion is not
            unit.
    """
    batch, flat = flat_configurations(model, q)
    count = flat.shape[0]
    columns = np.empty((len(model.segment_names), 3, 3, count))
    position = np.empty((len(model.segment_names), 3, count))
    for start in range(0, count, CHUNK):
        part = slice(start, start + CHUNK)
        world_columns(model, flat[part], columns[..., part], position[..., part])
    # Stored (segment, column, row, batch); handed out (batch, segment, row, column).
    rotation = columns.reshape(len(model.segment_names), 3, 3, *batch).swapaxes(1, 2)
    return SegmentPoses(
        model.segment_names,
        np.moveaxis(rotation, (0, 1, 2), (-3, -2, -1)),
        np.moveaxis(position.reshape(len(model.segment_names), 3, *batch), (0, 1), (-2, -1)),
    )


def frame_poses(model: HumanModel, poses: SegmentPoses, name: str) -> tuple[Array, Array]:
    """Returns rotation ``(..., 3, 3)`` and position ``(..., 3)`` in world of a frame or segment.

    Raises:
        UnknownNameError: the model has no such frame or segment.
    """
    index, local = model.point(name)
    rotation = poses.rotation[..., index, :, :]
    return rotation, poses.position[..., index, :] + rotation @ local


def flat_configurations(model: HumanModel, q: ArrayLike) -> tuple[tuple[int, ...], Array]:
    """Checks configurations and returns their leading shape and themselves as ``(batch, nq)``.

    Raises:
        ConfigurationError: wrong length, not finite, or a base quaternion that is not unit.
    """
    array = np.asarray(q, dtype=np.float64)
    if array.ndim == 0 or array.shape[-1] != model.nq:
        raise ConfigurationError(
            f"q: expected shape (..., {model.nq}) (base 3 + 4, {model.n_dof} joints), "
            f"got {array.shape}"
        )
    flat = array.reshape(-1, model.nq)
    if not np.all(np.isfinite(flat)):
        raise ConfigurationError("q: expected finite numbers, got NaN or infinity")
    norm = np.linalg.norm(flat[:, 3:7], axis=1)
    if np.any(np.abs(norm - 1.0) > _NORM_TOLERANCE):
        worst = float(norm[np.argmax(np.abs(norm - 1.0))])
        raise ConfigurationError(
            f"q: expected unit base quaternions xyzw, got one of norm {worst:.6g}"
        )
    return array.shape[:-1], flat


def world_columns(model: HumanModel, q: Array, columns: Array, position: Array) -> None:
    """Fills segment rotations and positions, batch last.

    Args:
        model: the person.
        q: ``(batch, nq)``, checked.
        columns: ``(n_segments, 3, 3, batch)`` out: [segment, column, row].
        position: ``(n_segments, 3, batch)`` out, m.
    """
    cosine, sine = cosine_sine(q[:, BASE_NQ:].T)
    columns[0] = quaternion_to_matrix(q[:, 3:7]).T
    position[0] = q[:, :3].T
    scratch = np.empty((3, *columns.shape[2:]))
    for index in range(1, len(model.segment_names)):
        parent, joint = model.parents[index], index - 1
        here = columns[index]
        here[...] = columns[parent]
        shift_along(
            columns[parent], position[parent], model.offsets[joint], position[index], scratch[0]
        )
        for dof in model.joint_dofs(joint):
            turn(here, int(model.dof_axes[dof]), cosine[dof], sine[dof], scratch)
