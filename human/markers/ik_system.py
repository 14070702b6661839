"""Where a posture puts the markers, and the normal equations of moving it towards them.

The Jacobian is never formed. In world axes about the pelvis's origin every marker's velocity is
``[1, -[d]x]`` times the twist of its segment, so that the markers of a segment add up to one 6 x 6
information matrix and one force, both simply summed from the tips to the root; the columns of the
joints then make the normal matrix of all degrees of freedom with two small products.

Derived here, in the manner of the composite-rigid-body method: Featherstone, *Rigid Body Dynamics
Algorithms* (2008), section 6.2, with information in place of inertia.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from human.columns import cosine_sine, shift_along, turn
from human.model import BASE_NQ, BASE_NV, Array, HumanModel, IntArray
from human.rotations import (
    quaternion_multiply,
    quaternion_normalized,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)

#: Components of a cross product: each from the two that follow it.
_CYCLES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """Segments and markers of some postures, world axes; ``B`` postures.

    Attributes:
        origin: ``(segments, 3, B)`` m.
        axes: ``(n_dof, 3, B)`` unit vectors that the degrees of freedom turn about.
        marker: ``(B, markers, 3)`` m.
    """

    origin: Array
    axes: Array
    marker: Array

    def of(self, postures: IntArray) -> "Placed":
        """Returns some of the postures."""
        return Placed(self.origin[..., postures], self.axes[..., postures], self.marker[postures])

    def where(self, chosen: NDArray[np.bool_], other: "Placed") -> "Placed":
        """Returns these postures where chosen ``(B,)``, and others elsewhere."""
        return Placed(
            np.where(chosen, self.origin, other.origin),
            np.where(chosen, self.axes, other.axes),
            np.where(chosen[:, None, None], self.marker, other.marker),
        )


class MarkerSystem:
    """A model with markers on, and the degrees of freedom that are free to move.

    Attributes:
        model: the person.
        segment: ``(markers,)`` index of each marker's segment.
        offset: ``(markers, 3)`` m, in segment axes.
        free: ``(k,)`` degrees of freedom that move; a step has ``6 + k`` entries: translation of
            the pelvis (m) and its rotation vector (rad), both in world axes, then the angles.
    """

    def __init__(self, model: HumanModel, segment: IntArray, offset: Array, free: IntArray) -> None:
        """Prepares the sums.

        Args:
            model: the person.
            segment: ``(markers,)`` index of each marker's segment.
            offset: ``(markers, 3)`` m, in segment axes.
            free: ``(k,)`` degrees of freedom, ascending.
        """
        self.model, self.free = model, free
        self.offset = offset
        self.segment = segment
        self._markers_of = [
            (index, np.flatnonzero(segment == index)) for index in np.unique(segment).tolist()
        ]
        self._turns = [
            [(int(dof), int(model.dof_axes[dof])) for dof in model.joint_dofs(index - 1)]
            for index in range(len(model.segment_names))
        ]
        carrier = model.dof_joints[free] + 1
        self._joints = [
            (index, BASE_NV + np.flatnonzero(carrier == index))
            for index in np.unique(carrier).tolist()
        ]
        self._carrier = carrier
        below = _subtrees(model)
        carries = np.ones((BASE_NV + len(free), BASE_NV + len(free)))
        carries[BASE_NV:, :BASE_NV] = 0.0
        carries[BASE_NV:, BASE_NV:] = below[np.ix_(carrier, carrier)]
        same = np.zeros_like(carries)
        same[:BASE_NV, :BASE_NV] = 1.0
        same[BASE_NV:, BASE_NV:] = carrier[:, None] == carrier[None, :]
        self._carries, self._strictly = carries, carries * (1.0 - same)

    @property
    def joint_places(self) -> list[IntArray]:
        """For each joint that moves, the places of its degrees of freedom among the unknowns."""
        return [dofs for _, dofs in self._joints]

    @property
    def size(self) -> int:
        """Number of unknowns, ``6 + k``."""
        return BASE_NV + len(self.free)

    def place(self, q: Array) -> Placed:
        """Returns where configurations ``(B, nq)`` put segments, joint axes and markers."""
        model, count = self.model, len(q)
        cosine, sine = cosine_sine(q[:, BASE_NQ:].T)
        columns = np.empty((len(model.segment_names), 3, 3, count))
        origin = np.empty((len(model.segment_names), 3, count))
        axes = np.empty((model.n_dof, 3, count))
        columns[0], origin[0] = quaternion_to_matrix(q[:, 3:7]).T, q[:, :3].T
        scratch = np.empty((3, 3, count))
        for index in range(1, len(model.segment_names)):
            parent = model.parents[index]
            columns[index] = columns[parent]
            shift_along(
                columns[parent], origin[parent], model.offsets[index - 1], origin[index], scratch[0]
            )
            for dof, axis in self._turns[index]:
                axes[dof] = columns[index, axis]  # a turn leaves its own axis where it is
                turn(columns[index], axis, cosine[dof], sine[dof], scratch)
        marker = np.empty((len(self.segment), 3, count))
        for index, mine in self._markers_of:
            marker[mine] = origin[index] + np.einsum(
                "mc,crb->mrb", self.offset[mine], columns[index]
            )
        return Placed(origin, axes, np.ascontiguousarray(marker.transpose(2, 0, 1)))

    def normal(self, placed: Placed, error: Array, weight: Array) -> tuple[Array, Array]:
        """Returns the normal matrix ``(B, n, n)`` and right-hand side ``(B, n)`` of a step.

        Args:
            placed: from `place`.
            error: ``(B, markers, 3)`` m, from the model's marker to the measured one.
            weight: ``(B, markers)`` 1/m^2, zero where a marker is unseen.
        """
        count = len(error)
        information = np.zeros((len(self.model.segment_names), count, 6, 6))
        force = np.zeros((len(self.model.segment_names), count, 6))
        root = placed.origin[0].T
        arm = placed.marker - root[:, None]
        heavy = weight[..., None] * error
        for index, mine in self._markers_of:
            d, w, e = arm[:, mine], weight[:, mine], heavy[:, mine]
            information[index] = _information(d, w)
            force[index, :, :3] = e.sum(axis=1)
            for i, j, k in _CYCLES:
                turning = d[..., j] * e[..., k] - d[..., k] * e[..., j]
                force[index, :, 3 + i] = turning.sum(axis=1)
        for index in range(len(self.model.segment_names) - 1, 0, -1):
            information[self.model.parents[index]] += information[index]
            force[self.model.parents[index]] += force[index]
        column = self._columns(placed)
        carried, rhs = np.empty_like(column), np.empty((count, self.size))
        carried[:, :, :BASE_NV] = information[0]
        rhs[:, :BASE_NV] = force[0]
        for index, dofs in self._joints:
            block = column[:, :, dofs[0] : dofs[-1] + 1]
            carried[:, :, dofs[0] : dofs[-1] + 1] = information[index] @ block
            rhs[:, dofs] = (force[index][:, None] @ block)[:, 0]
        product = column.swapaxes(1, 2) @ carried
        matrix = product * self._carries
        product *= self._strictly
        matrix += product.swapaxes(1, 2)
        return matrix, rhs

    def moved(self, q: Array, step: Array) -> Array:
        """Returns configurations ``(B, nq)`` moved by steps ``(B, n)``."""
        out = q.copy()
        out[:, :3] += step[:, :3]
        turned = quaternion_multiply(rotation_vector_to_quaternion(step[:, 3:6]), q[:, 3:7])
        out[:, 3:7] = quaternion_normalized(turned)
        out[:, BASE_NQ + self.free] += step[:, BASE_NV:]
        return out

    def _columns(self, placed: Placed) -> Array:
        """Twists ``(B, 6, n)`` about the pelvis's origin of a unit of each unknown."""
        count = placed.origin.shape[-1]
        out = np.zeros((count, 6, self.size))
        out[:, np.arange(6), np.arange(6)] = 1.0
        axis = placed.axes[self.free]
        arm = placed.origin[self._carrier] - placed.origin[0]
        out[:, 3:, BASE_NV:] = axis.transpose(2, 1, 0)
        for i, j, k in _CYCLES:
            out[:, i, BASE_NV:] = (arm[:, j] * axis[:, k] - arm[:, k] * axis[:, j]).T
        return out


def _information(arm: Array, weight: Array) -> Array:
    """Sums ``A^T w A`` with ``A = [1, -[d]x]`` over markers: ``(B, 6, 6)``."""
    count, markers = weight.shape
    rows = np.zeros((count, markers, 3, 6))
    root = np.sqrt(weight)
    rows[:, :, 0, 0] = rows[:, :, 1, 1] = rows[:, :, 2, 2] = root
    x, y, z = (root * arm[..., k] for k in range(3))
    rows[:, :, 0, 4], rows[:, :, 0, 5] = z, -y
    rows[:, :, 1, 3], rows[:, :, 1, 5] = -z, x
    rows[:, :, 2, 3], rows[:, :, 2, 4] = y, -x
    flat = rows.reshape(count, 3 * markers, 6)
    return np.asarray(flat.swapaxes(1, 2) @ flat)


def _subtrees(model: HumanModel) -> Array:
    """Returns ``(segments, segments)`` ones where the first carries the second, itself included."""
    count = len(model.segment_names)
    out = np.zeros((count, count))
    for index in range(count):
        above = index
        while above >= 0:
            out[above, index] = 1.0
            above = model.parents[above]
    return out
