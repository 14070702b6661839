"""Joints from one segment to one or more points: reach and Jacobian, for thousands at once."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from human.columns import cosine_sine, shift_along, turn
from human.errors import ConfigurationError
from human.model import Array, HumanModel

#: Postures worked on at once: the chain's arrays then stay in the processor's cache.
_CHUNK = 1024


@dataclass(frozen=True, slots=True)
class _Step:
    """The way through one joint, from one segment to the next.

    Attributes:
        start: segment the step begins at.
        end: segment it ends at.
        offset: from one segment's origin to the next's, m: in the axes of ``start``, or of ``end``
            where the joint is passed backwards.
        turns: ``(place in the chain, axis)`` of each degree of freedom, in the order passed.
        backwards: whether the step goes from the segment a joint moves to the one it hangs from.
    """

    start: int
    end: int
    offset: Array
    turns: tuple[tuple[int, int], ...]
    backwards: bool


class Chain:
    """The joints between a base segment and one or more tip points, seen from the base.

    Use it for reaching and for the Jacobian; `human.kinematics.forward_kinematics` for whole
    bodies. From ``Pelvis`` to ``RightHandCOM`` it has 24 degrees of freedom. The base may be any
    segment: from a foot, the leg's joints are passed backwards and the pelvis is carried along.

    Of several tips, ``held`` ones come first in every stack. Held or led makes no difference here:
    a held tip is one that its user keeps where it is, such as the other foot on the floor.

    Attributes:
        model: the person.
        base: segment whose axes and origin everything is expressed in.
        held: frames or segments that are kept in place.
        led: frames or segments whose points are moved.
        dof_names: ``n`` names, each joint where it is first met on the way to the tips in turn.
        dof_indices: ``(n,)`` places in the model's joint angles (add 7 for a configuration, 6 for a
            velocity).
        lower: ``(n,)`` rad.
        upper: ``(n,)`` rad.
    """

    def __init__(
        self,
        model: HumanModel,
        tip: str | Sequence[str] = "RightHandCOM",
        base: str = "Pelvis",
        held: Sequence[str] = (),
    ) -> None:
        """Collects the joints on the way.

        Args:
            model: the person.
            tip: the frame or segment that is led, or several.
            base: a segment.
            held: further frames or segments, kept in place.

        Raises:
            UnknownNameError: no such frame or segment.
            ConfigurationError: no tip, or two on the same segment.
        """
        self.model, self.base, self.held = model, base, tuple(held)
        self.led = (tip,) if isinstance(tip, str) else tuple(tip)
        points = [model.point(name) for name in self.tips]
        if not self.led or len({segment for segment, _ in points}) < len(points):
            raise ConfigurationError(
                f"tips of a chain: expected at least one that is led and each on a segment of its "
                f"own, got {', '.join(self.tips) or 'none'}"
            )
        self._tip_segments = [segment for segment, _ in points]
        self._tip_offsets = [offset for _, offset in points]
        self._root = model.segment_index(base)
        self._steps: list[_Step] = []
        self._ways: list[list[int]] = []  # places in the steps, tip by tip
        indices: list[int] = []
        known: dict[int, int] = {}
        for segment in self._tip_segments:
            way = []
            for start, end in _way(model, self._root, segment):
                if end not in known:
                    known[end] = len(self._steps)
                    self._steps.append(_step(model, start, end, indices))
                way.append(known[end])
            self._ways.append(way)
        # Segments that something is still attached to once the sweep has gone on elsewhere.
        self._branches = {
            step.start for before, step in pairwise(self._steps) if step.start != before.end
        }
        self.dof_indices = np.array(indices, dtype=np.intp)
        self.dof_names = tuple(model.dof_names[k] for k in indices)
        self.lower, self.upper = model.lower[self.dof_indices], model.upper[self.dof_indices]

    @property
    def n(self) -> int:
        """Number of degrees of freedom on the way."""
        return len(self.dof_names)

    @property
    def tip(self) -> str:
        """The led tip, or the first of several."""
        return self.led[0]

    @property
    def tips(self) -> tuple[str, ...]:
        """All tips, in the order of every stack: held ones, then led ones."""
        return (*self.held, *self.led)

    @property
    def held_tips(self) -> int:
        """How many tips are held."""
        return len(self.held)

    def forward(self, q_chain: ArrayLike) -> tuple[Array, Array]:
        """Returns the tip's position ``(..., 3)`` m and rotation ``(..., 3, 3)`` in base axes.

        With ``t > 1`` tips, position ``(..., 3 t)`` tip by tip and rotation ``(..., t, 3, 3)``.

        Args:
            q_chain: ``(..., n)`` rad.

        Raises:
            ConfigurationError: another length, or not finite.
        """
        batch, flat = self._flat(q_chain)
        tips = len(self.tips)
        position = np.empty((len(flat), 3 * tips), dtype=flat.dtype)
        rotation = np.empty((len(flat), tips, 3, 3), dtype=flat.dtype)
        for start in range(0, len(flat), _CHUNK):
            part = slice(start, start + _CHUNK)
            tip, columns, _ = self._sweep(flat[part].T, jacobian=False)
            position[part], rotation[part] = tip.T, columns.transpose(3, 0, 2, 1)
        return position.reshape(*batch, 3 * tips), self._rotation(rotation, batch)

    def jacobian(self, q_chain: ArrayLike) -> Array:
        """Returns the Jacobian ``(..., 6, n)`` of `forward_and_jacobian`."""
        return self.forward_and_jacobian(q_chain)[2]

    def forward_and_jacobian(self, q_chain: ArrayLike) -> tuple[Array, Array, Array]:
        """Returns position ``(..., 3)``, rotation ``(..., 3, 3)``, Jacobian ``(..., 6, n)``.

        ``J @ rates`` is the velocity of the tip point (m/s) and the angular velocity of the tip's
        segment (rad/s), both in base axes and relative to the base. With ``t > 1`` tips, position
        and rotation are as in `forward` and the Jacobian is ``(..., 6 t, n)``: first the linear
        rows, tip by tip, then the angular ones.

        Args:
            q_chain: ``(..., n)`` rad.

        Raises:
            ConfigurationError: another length, or not finite.
        """
        batch, flat = self._flat(q_chain)
        tips = len(self.tips)
        position = np.empty((len(flat), 3 * tips), dtype=flat.dtype)
        rotation = np.empty((len(flat), tips, 3, 3), dtype=flat.dtype)
        # The batch comes first in memory: what follows is small matrix products, one per row.
        jacobian = np.empty((len(flat), 6 * tips, self.n), dtype=flat.dtype)
        for start in range(0, len(flat), _CHUNK):
            part = slice(start, start + _CHUNK)
            tip, columns, rows = self._sweep(flat[part].T, jacobian=True)
            position[part], rotation[part] = tip.T, columns.transpose(3, 0, 2, 1)
            jacobian[part] = rows.transpose(2, 0, 1)
        return (
            position.reshape(*batch, 3 * tips),
            self._rotation(rotation, batch),
            jacobian.reshape(*batch, 6 * tips, self.n),
        )

    def sweep(self, q_columns: Array) -> tuple[Array, Array, Array]:
        """Does the same with the batch last, without copies or checks: for inner loops.

        Args:
            q_columns: ``(n, batch)`` rad.

        Returns:
            Position ``(3 t, batch)``, rotation ``(3, 3, batch)`` [row, column], ``(t, 3, 3,
            batch)`` of several tips, Jacobian ``(6 t, n, batch)``.
        """
        position, columns, jacobian = self._sweep(q_columns, jacobian=True)
        rotation = columns.swapaxes(1, 2)
        return position, rotation[0] if len(rotation) == 1 else rotation, jacobian

    def _rotation(self, rotation: Array, batch: tuple[int, ...]) -> Array:
        tips = len(self.tips)
        return rotation.reshape(*batch, 3, 3) if tips == 1 else rotation.reshape(*batch, tips, 3, 3)

    def _flat(self, q_chain: ArrayLike) -> tuple[tuple[int, ...], Array]:
        array = np.asarray(q_chain)
        if array.dtype != np.float32:
            array = np.asarray(array, dtype=np.float64)
        if array.ndim == 0 or array.shape[-1] != self.n:
            raise ConfigurationError(
                f"joint angles of the chain {self.base} to {', '.join(self.tips)}: expected shape "
                f"(..., {self.n}), got {array.shape}"
            )
        flat = array.reshape(-1, self.n)
        if not np.all(np.isfinite(flat)):
            raise ConfigurationError(
                "joint angles of the chain: expected finite numbers, got NaN or infinity"
            )
        return array.shape[:-1], flat

    def _sweep(self, q: Array, *, jacobian: bool) -> tuple[Array, Array, Array]:
        """Returns positions ``(3 t, batch)``, ``(t, column, row, batch)`` and the Jacobian."""
        count, tips, kind = q.shape[1], len(self.tips), q.dtype
        cosine, sine = cosine_sine(q)
        columns = np.zeros((3, 3, count), dtype=kind)
        for axis in range(3):
            columns[axis, axis] = 1.0
        position, before = np.zeros((3, count), dtype=kind), np.empty((3, count), dtype=kind)
        scratch = np.empty((3, 3, count), dtype=kind)
        shape = (6 * tips, self.n, count) if jacobian else (6 * tips, 0, 0)
        out = np.zeros(shape, dtype=kind)
        # Of one tip all joints are on the way: the axes are its angular rows.
        axes = out[3:] if tips == 1 or not jacobian else np.empty((3, self.n, count), dtype=kind)
        centers: list[Array] = []
        reached = np.empty((3 * tips, count), dtype=kind)
        turned = np.empty((tips, 3, 3, count), dtype=kind)
        kept: dict[int, tuple[Array, Array]] = {}
        here = self._root

        def arrive() -> None:
            if here in self._branches:
                kept[here] = columns.copy(), position.copy()
            for tip, segment in enumerate(self._tip_segments):
                if segment == here:
                    there = reached[3 * tip : 3 * tip + 3]
                    shift_along(columns, position, self._tip_offsets[tip], there, scratch[0])
                    turned[tip] = columns

        arrive()
        for step in self._steps:
            if step.start != here:
                columns[...], position[...] = kept[step.start]
            if not step.backwards:
                before[...] = position
                shift_along(columns, before, step.offset, position, scratch[0])
            if jacobian:
                centers.append(position.copy())
            for place, axis in step.turns:
                if jacobian:
                    # A rotation leaves its own axis where it is.
                    np.multiply(columns[axis], -1.0 if step.backwards else 1.0, out=axes[:, place])
                angle = -sine[place] if step.backwards else sine[place]
                turn(columns, axis, cosine[place], angle, scratch)
            if step.backwards:
                before[...] = position
                shift_along(columns, before, step.offset, position, scratch[0])
            here = step.end
            arrive()
        if jacobian:
            for tip, way in enumerate(self._ways):
                rows = slice(3 * tip, 3 * tip + 3)
                self._fill(
                    axes, centers, way, reached[rows], out[rows], out[3 * tips :][rows], scratch[0]
                )
        return reached, turned, out

    def _fill(
        self,
        axes: Array,
        centers: list[Array],
        way: list[int],
        tip: Array,
        linear: Array,
        angular: Array,
        scratch: Array,
    ) -> None:
        """Writes one tip's rows: ``axis x (tip - joint centre)`` and the axis, on its way."""
        for place in way:
            turns = self._steps[place].turns
            if not turns:
                continue
            dofs = slice(turns[0][0], turns[-1][0] + 1)
            arm = np.subtract(tip, centers[place], out=scratch)
            axis, row = axes[:, dofs], linear[:, dofs]
            for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
                np.multiply(axis[j], arm[k], out=row[i])
                row[i] -= axis[k] * arm[j]
            if len(self.tips) > 1:
                angular[:, dofs] = axis


def _way(model: HumanModel, start: int, end: int) -> list[tuple[int, int]]:
    """Returns the pairs of neighbouring segments from one segment to another."""

    def to_root(segment: int) -> list[int]:
        line = [segment]
        while model.parents[line[-1]] >= 0:
            line.append(model.parents[line[-1]])
        return line

    up, down = to_root(start), to_root(end)
    shared = next(segment for segment in up if segment in down)
    passed = up[: up.index(shared) + 1] + down[: down.index(shared)][::-1]
    return list(pairwise(passed))


def _step(model: HumanModel, start: int, end: int, indices: list[int]) -> _Step:
    """Makes the step between neighbours and adds its degrees of freedom to ``indices``."""
    backwards = model.parents[start] == end
    joint = (start if backwards else end) - 1
    dofs = [int(dof) for dof in model.joint_dofs(joint)]
    if backwards:
        dofs.reverse()
    turns = tuple((len(indices) + k, int(model.dof_axes[dof])) for k, dof in enumerate(dofs))
    indices.extend(dofs)
    offset = -model.offsets[joint] if backwards else model.offsets[joint]
    return _Step(start, end, offset, turns, backwards)
