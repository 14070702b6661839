"""What was seen of a person: postures, joint velocities, and how they move the hand."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from prediction.chain import JointReduction, Task, TaskChain, held_tips
from prediction.errors import DemonstrationError

Array = NDArray[np.float64]

#: Fewest samples a predictor is fitted on, per learned joint.
SAMPLES_PER_JOINT = 4
#: Pivoted-QR ratio below which a joint counts as locked or dependent.
DEPENDENCE_RATIO = 0.02
#: Joint-velocity deviation below which a joint counts as locked, rad/s.
LOCKED_RATE = 1e-4
#: Steps in time of at least this many usual ones are holes.
HOLE = 4.0
#: Share of the largest singular value below which a Jacobian counts as of less than full rank.
_SINGULAR = 1e-5
#: Most samples whose Jacobians are decomposed.
_LOOKED_AT = 200


@dataclass(frozen=True, slots=True)
class Demonstrations:
    """Demonstrated motion of one chain.

    The hand velocity is not stored: it is ``J dq`` by definition, because finite differences of the
    hand position disagree with it by several cm/s at 30 Hz and would put the density off.

    Attributes:
        joint_names: ``n`` names.
        q: Postures, ``(N, n)`` rad.
        qdot: Joint velocities, ``(N, n)`` rad/s.
        jacobian: ``(N, m, n)``, linear rows first, base axes.
        trajectory_id: Number of the take each sample belongs to, ``(N,)``, each take in one piece.
        time_s: ``(N,)``, increasing within a take.
        linear_rows: How many rows of the Jacobian are linear, 3 a tip (2 for a planar arm).
        held_tips: How many tips are held, see `TaskChain`.
    """

    joint_names: tuple[str, ...]
    q: Array
    qdot: Array
    jacobian: Array
    trajectory_id: NDArray[np.int64]
    time_s: Array
    linear_rows: int = 3
    held_tips: int = 0

    def __post_init__(self) -> None:
        """Checks shapes, finiteness and times."""
        n, count = len(self.joint_names), len(self.q)
        task_dim = self.jacobian.shape[1] if self.jacobian.ndim == 3 else 0
        expected: dict[str, tuple[int, ...]] = {
            "q": (count, n),
            "qdot": (count, n),
            "jacobian": (count, task_dim, n),
            "trajectory_id": (count,),
            "time_s": (count,),
        }
        for name, shape in expected.items():
            value = getattr(self, name)
            if value.shape != shape:
                raise DemonstrationError(
                    f"{name} has shape {value.shape}, expected {shape}: one row per sample, "
                    f"{n} joints"
                )
            if not np.isfinite(value).all():
                row = int(np.argwhere(~np.isfinite(value))[0, 0])
                raise DemonstrationError(
                    f"{name} is not finite at sample {row}: cut the gap out of the demonstration"
                )
        if not 0 < task_dim < n:
            raise DemonstrationError(
                f"the task has {task_dim} rows and the chain {n} joints: there is nothing to learn "
                "without redundancy (0 < m < n)"
            )
        if not 0 < self.linear_rows <= task_dim:
            raise DemonstrationError(f"linear_rows is {self.linear_rows}, expected 1 to {task_dim}")
        changes = np.flatnonzero(np.diff(self.trajectory_id)) + 1
        if len(set(self.trajectory_id.tolist())) != len(changes) + 1:
            raise DemonstrationError("samples of one trajectory_id must stand together")
        for piece in np.split(np.arange(count), changes):
            if (np.diff(self.time_s[piece]) <= 0).any():
                bad = int(piece[1:][np.diff(self.time_s[piece]) <= 0][0])
                raise DemonstrationError(
                    f"time_s does not increase at sample {bad} "
                    f"({self.time_s[bad - 1]:.6f} then {self.time_s[bad]:.6f} s): "
                    "remove repeated or unsorted frames"
                )

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.q)

    @property
    def xdot(self) -> Array:
        """Hand velocity ``J dq``, ``(N, m)``."""
        return np.asarray(np.einsum("tmn,tn->tm", self.jacobian, self.qdot))

    def take(self, index: NDArray[np.int64] | NDArray[np.bool_] | slice) -> "Demonstrations":
        """Returns some of the samples."""
        return replace(
            self,
            q=self.q[index],
            qdot=self.qdot[index],
            jacobian=self.jacobian[index],
            trajectory_id=self.trajectory_id[index],
            time_s=self.time_s[index],
        )

    def for_task(self, task: Task) -> "Demonstrations":
        """Returns the same motion with the rows of a task.

        All of them, or for ``position`` the linear ones and the angular ones of held tips.
        """
        rows = self.jacobian.shape[1]
        if task == "position":
            rows = self.linear_rows + 3 * self.held_tips
        return replace(self, jacobian=self.jacobian[:, :rows])

    def reduced(self, reduction: JointReduction) -> "Demonstrations":
        """Returns the same motion in the learned joints, the others following them.

        The hand velocity becomes that of the followed motion, so ``xdot = J dq`` still holds
        exactly.
        """
        return replace(
            self,
            joint_names=reduction.kept_names,
            q=self.q[:, reduction.kept],
            qdot=self.qdot[:, reduction.kept],
            jacobian=self.jacobian @ reduction.expansion,
        )

    def thinned(self, at_most: int) -> "Demonstrations":
        """Returns every s-th sample of each take, s such that at most ``at_most`` remain.

        Neighbouring samples of human motion repeat each other; a stride keeps the spread and lowers
        the cost of everything that is cubic in the number of samples.
        """
        stride = -(-len(self) // at_most)
        if stride <= 1:
            return self
        starts = np.concatenate([[0], np.flatnonzero(np.diff(self.trajectory_id)) + 1])
        within = np.arange(len(self)) - np.repeat(starts, np.diff([*starts, len(self)]))
        return self.take(within % stride == 0)

    def runs(self) -> list[NDArray[np.int64]]:
        """Returns the samples of each stretch without a break.

        A take ends one, and so does a hole in a take: a step in time above four times the usual
        one, where frames were missing or a part was left out.
        """
        if len(self) == 0:
            return []
        step, same = np.diff(self.time_s), np.diff(self.trajectory_id) == 0
        usual = float(np.median(step[same])) if same.any() else np.inf
        breaks = np.flatnonzero(~same | (step > HOLE * usual)) + 1
        return [piece.astype(np.int64) for piece in np.split(np.arange(len(self)), breaks)]

    def blocks(self, count: int) -> list[NDArray[np.bool_]]:
        """Splits the samples into contiguous parts: whole takes if there are enough of them.

        Args:
            count: Number of parts.

        Returns:
            One mask ``(N,)`` per part; neighbours in time stay together, so a part left out tests
            the model on motion it has not almost seen.
        """
        takes, sizes = np.unique(self.trajectory_id, return_counts=True)
        middle = np.arange(len(self)) + 0.5
        if len(takes) >= count:
            order = {int(t): i for i, t in enumerate(dict.fromkeys(self.trajectory_id.tolist()))}
            counts = np.array([sizes[takes == t][0] for t in order])
            centre = np.cumsum(counts) - counts / 2
            part_of_take = np.minimum((centre * count / len(self)).astype(int), count - 1)
            part = part_of_take[[order[int(t)] for t in self.trajectory_id]]
        else:
            part = np.minimum((middle * count / len(self)).astype(int), count - 1)
        return [part == i for i in range(count) if (part == i).any()]

    def check_enough(self) -> None:
        """Raises unless there are enough samples for the joints.

        Raises:
            DemonstrationError: Too few samples.
        """
        needed = SAMPLES_PER_JOINT * len(self.joint_names)
        if len(self) < needed:
            raise DemonstrationError(
                f"{len(self)} samples for {len(self.joint_names)} joints: at least {needed} are "
                "needed; give a longer or a second demonstration"
            )


def demonstrations_from_samples(
    chain: TaskChain,
    q: Array,
    qdot: Array,
    time_s: Array,
    trajectory_id: Sequence[int] | NDArray[np.int64] | None = None,
) -> Demonstrations:
    """Makes demonstrations from joint samples of a chain.

    Args:
        chain: The chain; its Jacobians are evaluated at ``q``.
        q: ``(N, n)`` rad, continuous within a take.
        qdot: ``(N, n)`` rad/s.
        time_s: ``(N,)`` s.
        trajectory_id: ``(N,)``; one take when not given.

    Returns:
        The demonstrations.

    Raises:
        DemonstrationError: Shapes, times or values are wrong.
    """
    q, qdot, time_s = (np.asarray(a, dtype=np.float64) for a in (q, qdot, time_s))
    names = tuple(chain.dof_names)
    if q.ndim != 2 or q.shape[1] != len(names):
        raise DemonstrationError(f"q has shape {q.shape}, expected (samples, {len(names)})")
    if not np.isfinite(q).all():
        row = int(np.argwhere(~np.isfinite(q))[0, 0])
        raise DemonstrationError(f"q is not finite at sample {row}: cut the gap out")
    position, _, jacobian = chain.forward_and_jacobian(q)
    ids = np.zeros(len(q), dtype=np.int64) if trajectory_id is None else trajectory_id
    return Demonstrations(
        names,
        q,
        qdot,
        jacobian,
        np.asarray(ids, dtype=np.int64),
        time_s,
        position.shape[-1],
        held_tips(chain),
    )


def join(parts: Sequence[Demonstrations]) -> Demonstrations:
    """Puts demonstrations of one chain after one another, as separate takes.

    Raises:
        DemonstrationError: There are none, or their joints differ.
    """
    if not parts:
        raise DemonstrationError("no demonstrations: give at least one")
    if len({part.joint_names for part in parts}) > 1:
        raise DemonstrationError("demonstrations of different chains cannot be joined")
    offset, ids = 0, []
    for part in parts:
        _, local = np.unique(part.trajectory_id, return_inverse=True)
        ids.append(local + offset)
        offset += int(local.max()) + 1
    return replace(
        parts[0],
        q=np.concatenate([p.q for p in parts]),
        qdot=np.concatenate([p.qdot for p in parts]),
        jacobian=np.concatenate([p.jacobian for p in parts]),
        trajectory_id=np.concatenate(ids).astype(np.int64),
        time_s=np.concatenate([p.time_s for p in parts]),
    )


def find_reduction(demonstrations: Demonstrations, task_dim: int | None = None) -> JointReduction:
    """Finds the joints that are locked, or exactly follow others, in the demonstrations.

    Column-pivoted QR of the joint velocities, each divided by its deviation, orders the joints by
    what each adds to those before it; a joint that adds less than 2 % of the largest has no motion
    of its own. It then follows the kept ones by least squares.

    Several tips that are held, or hold one object, tie the joints between them to each other in
    every demonstration. What would move such tips against each other was never shown and is needed
    all the same, to correct them; so the joint velocities that move each tip are counted as if half
    of the demonstrations were made of them.

    Args:
        demonstrations: All joints.
        task_dim: Rows of the task, to make sure redundancy remains; those of the Jacobian if not
            given.

    Returns:
        The learned joints, in chain order, and the expansion to all.

    Raises:
        DemonstrationError: Nothing moves, too few joints move on their own, or those that move
            cannot bring every tip where it is led.

    Source: ratio and standardisation as measured to work on human recordings; the pivoted QR
    criterion is Golub and Van Loan, Matrix Computations, section 5.4.2.
    """
    qdot = demonstrations.qdot
    rate = np.sqrt((qdot**2).mean(axis=0))
    moving = np.flatnonzero(rate > LOCKED_RATE)
    task_dim = demonstrations.jacobian.shape[1] if task_dim is None else task_dim
    if len(moving) == 0:
        raise DemonstrationError("no joint moves in the demonstrations: there is nothing to learn")
    if demonstrations.linear_rows > 3:
        scaled = demonstrations.jacobian[:, :, moving] * rate[moving]
        wanted = _corrections(scaled) * rate[moving]
        corrections = np.zeros((len(wanted), len(rate)))
        corrections[:, moving] = wanted
        qdot = np.concatenate([qdot, corrections])
    triangle, order = scipy.linalg.qr(
        qdot[:, moving] / rate[moving], mode="r", pivoting=True, check_finite=False
    )
    size = np.abs(np.diagonal(triangle))
    kept = np.sort(moving[order[: len(size)][size > DEPENDENCE_RATIO * size[0]]])
    if len(kept) <= task_dim:
        raise DemonstrationError(
            f"only {len(kept)} joints move on their own and the hand task takes {task_dim}: "
            "the demonstrations show no choice of posture; record more varied motion"
        )
    expansion = np.zeros((len(rate), len(kept)))
    expansion[kept, np.arange(len(kept))] = 1.0
    follows = np.setdiff1d(moving, kept)
    if len(follows):
        solution, *_ = np.linalg.lstsq(qdot[:, kept], qdot[:, follows], rcond=1e-10)
        expansion[follows] = solution.T
    _check_rank(demonstrations, expansion, rate[kept])
    return JointReduction(demonstrations.joint_names, kept.astype(np.int64), expansion)


def _some(jacobian: Array) -> Array:
    """Returns the Jacobians of at most `_LOOKED_AT` samples, spread evenly."""
    return jacobian[:: -(-len(jacobian) // _LOOKED_AT)]


def _corrections(scaled: Array) -> Array:
    """Returns joint velocities that move tips, in deviations, as strong as ``N`` demonstrations.

    Args:
        scaled: Jacobians for joint velocities in deviations, ``(N, m, n)``.

    Returns:
        ``(S, n)``; orthonormal bases of row spaces, scaled to a mean square of ``N`` a column.
    """
    _, size, rows = np.linalg.svd(_some(scaled), full_matrices=False)
    rows = rows[size > _SINGULAR * size[:, :1]]
    return np.asarray(rows * np.sqrt(len(scaled) * rows.shape[1] / (rows**2).sum()))


def _check_rank(demonstrations: Demonstrations, expansion: Array, rate: Array) -> None:
    jacobian = _some(demonstrations.jacobian @ expansion) * rate
    size = np.linalg.svd(jacobian, compute_uv=False)
    ratio = float(np.median(size[:, -1] / size[:, 0]))
    if ratio < _SINGULAR:
        raise DemonstrationError(
            f"the {len(rate)} joints that move in the demonstrations cannot move the hand (or "
            f"hands and feet) in all {jacobian.shape[1]} directions of the task (least to largest "
            f"singular value {ratio:.1g}): record motion in which arms, trunk and, with the feet "
            "fixed, both legs take part"
        )
