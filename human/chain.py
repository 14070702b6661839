"""A path of joints from one segment to a point: reach and Jacobian, for thousands at once."""

import numpy as np
from numpy.typing import ArrayLike

from human.columns import cosine_sine, shift_along, turn
from human.errors import ConfigurationError, UnknownNameError
from human.model import Array, HumanModel

#: Postures worked on at once: the chain's arrays then stay in the processor's cache.
_CHUNK = 1024


class Chain:
    """The joints between a base segment and a tip point, seen from the base.

    Use it for reaching and for the Jacobian; `human.kinematics.forward_kinematics` for whole
    bodies. From ``Pelvis`` to ``RightHandCOM`` it has 24 degrees of freedom.

    Attributes:
        model: the person.
        base: segment whose axes and origin everything is expressed in.
        tip: frame or segment whose point moves.
        dof_names: ``n`` names, base to tip.
        dof_indices: ``(n,)`` places in the model's joint angles (add 7 for a configuration, 6 for a
            velocity).
        lower: ``(n,)`` rad.
        upper: ``(n,)`` rad.
    """

    def __init__(self, model: HumanModel, tip: str = "RightHandCOM", base: str = "Pelvis") -> None:
        """Collects the joints on the way.

        Args:
            model: the person.
            tip: a frame or segment name.
            base: a segment between the tip and the root.

        Raises:
            UnknownNameError: no such frame or segment, or the base does not carry the tip.
        """
        root = model.segment_index(base)
        segment, self._tip_offset = model.point(tip)
        joints: list[int] = []
        while segment != root:
            if segment == 0:
                raise UnknownNameError(
                    "base segment carrying the tip", base, (model.segment_names[0],)
                )
            joints.append(segment - 1)
            segment = model.parents[segment]
        joints.reverse()
        self.model, self.base, self.tip = model, base, tip
        # (offset, (place in the chain, axis) of each degree of freedom) joint by joint.
        self._joints: list[tuple[Array, list[tuple[int, int]]]] = []
        indices: list[int] = []
        for joint in joints:
            dofs = model.joint_dofs(joint)
            turns = [(len(indices) + k, int(model.dof_axes[dof])) for k, dof in enumerate(dofs)]
            indices.extend(int(dof) for dof in dofs)
            self._joints.append((model.offsets[joint], turns))
        self.dof_indices = np.array(indices, dtype=np.intp)
        self.dof_names = tuple(model.dof_names[k] for k in indices)
        self.lower, self.upper = model.lower[self.dof_indices], model.upper[self.dof_indices]

    @property
    def n(self) -> int:
        """Number of degrees of freedom on the way."""
        return len(self.dof_names)

    def forward(self, q_chain: ArrayLike) -> tuple[Array, Array]:
        """Returns the tip's position ``(..., 3)`` m and rotation ``(..., 3, 3)`` in base axes.

        Args:
            q_chain: ``(..., n)`` rad.

        Raises:
            ConfigurationError: another length, or not finite.
        """
        batch, flat = self._flat(q_chain)
        position, rotation = np.empty((len(flat), 3)), np.empty((len(flat), 3, 3))
        for start in range(0, len(flat), _CHUNK):
            part = slice(start, start + _CHUNK)
            tip, columns, _ = self._sweep(flat[part].T, jacobian=False)
            position[part], rotation[part] = tip.T, columns.transpose(2, 1, 0)
        return position.reshape(*batch, 3), rotation.reshape(*batch, 3, 3)

    def jacobian(self, q_chain: ArrayLike) -> Array:
        """Returns the tip's Jacobian ``(..., 6, n)``: rows linear (m) then angular, base axes."""
        return self.forward_and_jacobian(q_chain)[2]

    def forward_and_jacobian(self, q_chain: ArrayLike) -> tuple[Array, Array, Array]:
        """Returns position ``(..., 3)``, rotation ``(..., 3, 3)``, Jacobian ``(..., 6, n)``.

        ``J @ rates`` is the velocity of the tip point (m/s) and the angular velocity of the tip's
        segment (rad/s), both in base axes and relative to the base.

        Args:
            q_chain: ``(..., n)`` rad.

        Raises:
            ConfigurationError: another length, or not finite.
        """
        batch, flat = self._flat(q_chain)
        position, rotation = np.empty((len(flat), 3)), np.empty((len(flat), 3, 3))
        # The batch comes first in memory: what follows is small matrix products, one per row.
        jacobian = np.empty((len(flat), 6, self.n))
        for start in range(0, len(flat), _CHUNK):
            part = slice(start, start + _CHUNK)
            tip, columns, rows = self._sweep(flat[part].T, jacobian=True)
            position[part], rotation[part] = tip.T, columns.transpose(2, 1, 0)
            jacobian[part] = rows.transpose(2, 0, 1)
        return (
            position.reshape(*batch, 3),
            rotation.reshape(*batch, 3, 3),
            jacobian.reshape(*batch, 6, self.n),
        )

    def sweep(self, q_columns: Array) -> tuple[Array, Array, Array]:
        """Does the same with the batch last, without copies or checks: for inner loops.

        Args:
            q_columns: ``(n, batch)`` rad.

        Returns:
            Position ``(3, batch)``, rotation ``(3, 3, batch)`` [row, column], Jacobian ``(6, n,
            batch)``.
        """
        position, columns, jacobian = self._sweep(q_columns, jacobian=True)
        return position, columns.swapaxes(0, 1), jacobian

    def _flat(self, q_chain: ArrayLike) -> tuple[tuple[int, ...], Array]:
        array = np.asarray(q_chain, dtype=np.float64)
        if array.ndim == 0 or array.shape[-1] != self.n:
            raise ConfigurationError(
                f"joint angles of the chain {self.base} to {self.tip}: expected shape "
                f"(..., {self.n}), got {array.shape}"
            )
        flat = array.reshape(-1, self.n)
        if not np.all(np.isfinite(flat)):
            raise ConfigurationError(
                "joint angles of the chain: expected finite numbers, got NaN or infinity"
            )
        return array.shape[:-1], flat

    def _sweep(self, q: Array, *, jacobian: bool) -> tuple[Array, Array, Array]:
        count = q.shape[1]
        cosine, sine = cosine_sine(q)
        columns = np.zeros((3, 3, count))
        for axis in range(3):
            columns[axis, axis] = 1.0
        position, before = np.zeros((3, count)), np.empty((3, count))
        scratch = np.empty((3, 3, count))
        out = np.empty((6, self.n, count)) if jacobian else np.empty((6, 0, 0))
        centers: list[Array] = []
        for offset, turns in self._joints:
            before[...] = position
            shift_along(columns, before, offset, position, scratch[0])
            if jacobian:
                centers.append(position.copy())
            for place, axis in turns:
                if jacobian:
                    # A rotation leaves its own axis where it is.
                    out[3:, place] = columns[axis]
                turn(columns, axis, cosine[place], sine[place], scratch)
        before[...] = position
        shift_along(columns, before, self._tip_offset, position, scratch[0])
        if jacobian:
            self._fill_linear(out, position, centers, scratch[0])
        return position, columns, out

    def _fill_linear(self, out: Array, tip: Array, centers: list[Array], scratch: Array) -> None:
        """Writes ``axis x (tip - joint centre)`` to the linear rows; the angular ones hold axes."""
        for center, (_, turns) in zip(centers, self._joints, strict=True):
            if not turns:
                continue
            dofs = slice(turns[0][0], turns[-1][0] + 1)
            arm = np.subtract(tip, center, out=scratch)
            axes, linear = out[3:, dofs], out[:3, dofs]
            for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
                np.multiply(axes[j], arm[k], out=linear[i])
                linear[i] -= axes[k] * arm[j]
