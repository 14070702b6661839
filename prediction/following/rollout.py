"""Monte-Carlo roll-outs: how the body may move while the hand is led along a path.

Each step follows the predictor's mean, adds a deviation that is coherent along the way, and
corrects the hand once at the new posture (Vianello et al. 2021, Fig. 3, with the loop closed).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from prediction.chain import JointReduction, Task, TaskChain, held_tips
from prediction.errors import (
    StartMismatchError,
    TrajectoryError,
    UnreachableTrajectoryError,
    UnsupportedMethodError,
)
from prediction.following.familiarity import Familiarity
from prediction.following.hand_noise import HandNoise
from prediction.following.hand_path import HandPath, orientation_error
from prediction.following.joint_limits import JointLimits
from prediction.following.posture_band import PostureBand
from prediction.following.precision import PRECISIONS, Precision, in_single_precision
from prediction.following.propagation import NOISES, Noise, Propagation, propagate
from prediction.following.request_check import check_request, check_samples
from prediction.following.start_posture import LikelyStart
from prediction.laws.predictor import Predictor

Array = NDArray[np.float64]

#: Accepted distance between the start posture's hand and the first point.
START_M = 0.02
START_DEG = 10.0
#: Rows (samples of paths) integrated side by side; more would leave the cache.
SIDE_BY_SIDE = 1024


@dataclass(frozen=True, slots=True)
class Rollout:
    """Postures along one hand path.

    Attributes:
        joint_names: ``n`` names.
        time_s: ``(T,)`` s.
        q: Samples, ``(S, T, n)`` rad.
        central: The path without deviation, ``(T, n)`` rad.
        hand_error_m: Distance of each sample's hand from where it was led (robot error included in
            the target), ``(S, T)`` m; of several tips, led or held, that of the furthest.
        hand_error_rad: The same for orientation, ``(S, T)``; zero if no tip's is the task.
        familiarity: How well the demonstrations cover the central posture, ``(T,)`` in [0, 1].
        followed: Samples whose hand stayed on the path within limits, ``(S, T)``; False marks
            postures that should not be scored.
    """

    joint_names: tuple[str, ...]
    time_s: Array
    q: Array
    central: Array
    hand_error_m: Array
    hand_error_rad: Array
    familiarity: Array
    followed: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Follower:
    """Everything a roll-out needs besides the path: who follows, with which law and how loosely.

    Attributes:
        predictor: The method, on learned joints.
        chain: The whole chain.
        reduction: Learned joints.
        limits: Bounds on all joints, as rows on the learned ones.
        band: Coherent deviation.
        familiarity: Cover of postures.
        task: Pose or position.
        demonstrated: Demonstrated postures of all joints, ``(N, n)`` rad, for starts that are not
            measured; None if they are not known.
    """

    predictor: Predictor
    chain: TaskChain
    reduction: JointReduction
    limits: JointLimits
    band: PostureBand | None
    familiarity: Familiarity
    task: Task = "pose"
    demonstrated: Array | None = None

    def rollout(
        self,
        path: HandPath,
        q0: Array | None,
        samples: int,
        rng: np.random.Generator,
        *,
        hand_noise: HandNoise | None = None,
        noise: Noise = "coherent",
        precision: Precision = "double",
    ) -> Rollout:
        """Rolls out one path.

        Args:
            path: Checked path; its rotation is used if the task is the pose.
            q0: Start posture, all joints ``(n,)`` rad. A hand within `START_M` and `START_DEG` of
                the first point is brought onto it. None if it is not known: what was demonstrated
                with the hand nearby then stands for it, and bands are wider; see `LikelyStart`.
            samples: Sampled postures S; 0 gives the central path alone.
            rng: Randomness; what is drawn depends on S and the joints alone, so the same seed gives
                every candidate the same person, at whatever rate it is sampled.
            hand_noise: The robot's repeatability; none if not given.
            noise: ``coherent``; ``white`` samples every step on its own, as the paper does, for
                reproduction; ``none``.
            precision: ``single`` works with numbers of half the size: faster, hands still led to a
                few thousandths of a millimetre.

        Returns:
            The roll-out.

        Raises:
            TrajectoryError: The start posture or path is malformed.
            StartMismatchError: The start posture does not meet the path.
            UnreachableTrajectoryError: The hand cannot follow.
        """
        outcome = self.rollouts(
            [path], q0, samples, rng, hand_noise=hand_noise, noise=noise, precision=precision
        )[0]
        if isinstance(outcome, TrajectoryError):
            raise outcome
        return outcome

    def rollouts(
        self,
        paths: Sequence[HandPath],
        q0: Array | None,
        samples: int,
        rng: np.random.Generator,
        *,
        hand_noise: HandNoise | None = None,
        noise: Noise = "coherent",
        precision: Precision = "double",
    ) -> list[Rollout | TrajectoryError]:
        """Rolls out many paths from one start, side by side: much faster than one by one.

        All paths share the same random functions of travelled distance and of time, so sample s is
        the same person on the same day on each, however each path is sampled. What a path gets does
        not depend on which others stand beside it, beyond rounding.

        Args:
            paths: Checked paths, of any lengths.
            q0: As in `rollout`; so are the others.
            samples: Sampled postures S.
            rng: Randomness.
            hand_noise: The robot's repeatability.
            noise: See `rollout`.
            precision: See `rollout`.

        Returns:
            In the order of the paths, the roll-out or the error that `rollout` would raise.

        Raises:
            TrajectoryError: The start posture is malformed.
        """
        if noise not in NOISES:
            raise UnsupportedMethodError("noise", str(noise), NOISES)
        if precision not in PRECISIONS:
            raise UnsupportedMethodError("precision", str(precision), PRECISIONS)
        out: list[Rollout | TrajectoryError | None] = [None] * len(paths)
        if q0 is None:
            check_samples(samples)
            out = [self._path_fault(path) for path in paths]
        else:
            q0 = self._checked_start(q0, samples)
            out = [self._start_fault(path, q0) for path in paths]
        person = int(rng.integers(2**63))
        law = self if precision == "double" else in_single_precision(self)
        usable = [i for i, fault in enumerate(out) if fault is None]
        start = LikelyStart.of(self) if q0 is None else q0
        for group in self._groups(paths, usable, samples):
            points = max(len(paths[i].time_s) for i in group)
            padded = [paths[i].held(points) for i in group]
            same = np.random.default_rng(person)
            starts, strayed = _starts(padded, start, samples, person)
            run = propagate(
                law, padded, starts, samples, same, hand=hand_noise, noise=noise, deviation=strayed
            )
            for row, index in enumerate(group):
                out[index] = self._outcome(run, row, paths[index], run.q[row, 0, 0])
        return [outcome for outcome in out if outcome is not None]

    def _groups(
        self, paths: Sequence[HandPath], usable: list[int], samples: int
    ) -> list[list[int]]:
        """Returns indices that can be integrated side by side: equal substeps, similar lengths."""
        size = max(1, SIDE_BY_SIDE // (samples + 1))
        by_cut: dict[int, list[int]] = {}
        for index in usable:
            by_cut.setdefault(paths[index].substeps(), []).append(index)
        groups = []
        for indices in by_cut.values():
            indices.sort(key=lambda i: len(paths[i].time_s))
            groups += [indices[k : k + size] for k in range(0, len(indices), size)]
        return groups

    def _outcome(
        self, run: Propagation, row: int, path: HandPath, q0: Array
    ) -> Rollout | TrajectoryError:
        points = len(path.time_s)
        reached = run.followed[row, 0, :points]
        if not reached.all():
            index = int(np.argmin(reached))
            tip, distance, angle = self._worst_tip(path, index, run.q[row, 0, index], q0)
            return UnreachableTrajectoryError(index, distance, np.degrees(angle), tip)
        return Rollout(
            joint_names=self.reduction.names,
            time_s=path.time_s,
            q=run.q[row, 1:, :points],
            central=run.q[row, 0, :points],
            hand_error_m=run.hand_error_m[row, 1:, :points],
            hand_error_rad=run.hand_error_rad[row, 1:, :points],
            familiarity=run.familiarity[row, :points],
            followed=run.followed[row, 1:, :points],
        )

    def _checked_start(self, q0: Array, samples: int) -> Array:
        q0 = np.asarray(q0, dtype=np.float64)
        size = len(self.reduction.names)
        if q0.shape != (size,) or not np.isfinite(q0).all():
            raise TrajectoryError(
                f"the start posture has shape {q0.shape}, expected ({size},) finite angles"
            )
        check_request(self.reduction.names, self.limits, q0, samples)
        return q0

    def _path_fault(self, path: HandPath) -> TrajectoryError | None:
        if self.task == "pose" and path.rotation is None:
            return TrajectoryError(
                "the task is the pose of the hand but the path has no orientation"
            )
        return None

    def _start_fault(self, path: HandPath, q0: Array) -> TrajectoryError | None:
        fault = self._path_fault(path)
        if fault is not None:
            return fault
        start = HandPath.recorded(self.chain, q0[None], path.time_s[:1], self.task)
        if path.position.shape[1:] != start.position.shape[1:]:
            return TrajectoryError(
                f"the chain leads {start.hands} of the hands and the path has positions of shape "
                f"{path.position.shape}: expected {(len(path.time_s), *start.position.shape[1:])}"
            )
        tip, distance, angle = self._worst_tip(path, 0, q0, q0)
        if distance > START_M or np.degrees(angle) > START_DEG:
            return StartMismatchError(distance, float(np.degrees(angle)), START_M, START_DEG, tip)
        return None

    def _worst_tip(
        self, path: HandPath, index: int, q: Array, q0: Array
    ) -> tuple[str | None, float, float]:
        """Returns which tip is furthest off at a point of a path, and by how much, m and rad.

        The name is None where there is one tip only.
        """
        position, rotation, _ = self.chain.forward_and_jacobian(np.stack([q, q0]))
        size, held = min(3, position.shape[1]), held_tips(self.chain)
        position = position.reshape(2, -1, size)
        target = np.concatenate([position[1, :held], path.position[index].reshape(-1, size)])
        distance = np.linalg.norm(target - position[0], axis=1)
        angle = np.zeros(len(distance))
        if self.task == "pose" and path.rotation is not None:
            turned = rotation.reshape(2, -1, 3, 3)
            wanted = np.concatenate([turned[1, :held], path.rotation[index].reshape(-1, 3, 3)])
            angle = np.linalg.norm(orientation_error(wanted, turned[0]), axis=1)
        # A turn of START_DEG counts as much as a distance of START_M.
        worst = int(np.argmax(distance / START_M + np.degrees(angle) / START_DEG))
        names: Sequence[str] = getattr(self.chain, "tips", ())
        name = names[worst] if len(names) > 1 else None
        return name, float(distance[worst]), float(angle[worst])


def _starts(
    paths: list[HandPath], start: Array | LikelyStart, samples: int, person: int
) -> tuple[Array, Array | None]:
    """Returns where each roll-out starts, and how far it strays there."""
    if not isinstance(start, LikelyStart):
        return np.broadcast_to(start, (len(paths), len(start))), None
    # Numbers of their own: how many a start takes must not move those of the way.
    drawn = [start.draw(p, samples, np.random.default_rng([person, 1])) for p in paths]
    return np.stack([q for q, _ in drawn]), np.stack([stray for _, stray in drawn])
