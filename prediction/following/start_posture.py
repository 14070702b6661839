"""The posture a person is likely to begin in, where nobody has measured it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from prediction.chain import ReducedChain, held_tips
from prediction.errors import TrajectoryError
from prediction.following.familiarity import widening
from prediction.following.hand_path import HandPath
from prediction.following.tip_targets import with_turn
from prediction.laws.null_space import weighted_pseudo_inverse
from prediction.laws.student_t import NINETY

if TYPE_CHECKING:
    from prediction.following.rollout import Follower

Array = NDArray[np.float64]

#: Distance of the hand at which a demonstrated posture weighs e^-1/2 as much, m and rad.
NEAR_M = 0.08
NEAR_RAD = 0.4
#: Contiguous parts of the demonstrations that are guessed from the others, and guesses a part.
_PARTS, _GUESSES = 4, 10
#: A weighted spread of few postures is divided by at least this.
_LEAST_FREEDOM = 0.1


@dataclass(frozen=True, slots=True)
class LikelyStart:
    """Start postures drawn from what was demonstrated with the hand nearby.

    Each demonstrated posture is carried to the hand's place by the law's W. Their mean, nearest
    hands counting most, is the central start. Samples spread as those postures do, and by what the
    deviation of the band amounts to in the long run: whoever has not been measured is as far off
    as somebody who was, long ago. That part returns along the way as any deviation does. One
    factor on both makes 90 % bands hold 90 % of parts of the demonstrations guessed from the rest.

    Attributes:
        follower: The law.
        shown: Demonstrated postures, all joints, ``(N, n)`` rad.
        position: Where the tips were, ``(N, p)`` m.
        rotation: Of the tips whose orientation is the task's, ``(N, t, 3, 3)``.
        gain: ``J_W^+`` there, ``(N, r, m)``.
        factor: Calibration of the spread.
    """

    follower: "Follower"
    shown: Array
    position: Array
    rotation: Array
    gain: Array
    factor: float

    @classmethod
    def of(cls, follower: "Follower") -> "LikelyStart":
        """Learns from what the follower knows was demonstrated.

        Raises:
            TrajectoryError: Nothing was, or the chain holds tips in place, whose place is then not
                known either.
        """
        shown = follower.demonstrated
        if shown is None or len(shown) == 0 or held_tips(follower.chain):
            what = "holds feet in place" if held_tips(follower.chain) else "has no demonstrations"
            raise TrajectoryError(
                f"the start posture is not given and cannot be guessed: this model {what}; give q0"
            )
        learned = shown[:, follower.reduction.kept]
        chain = ReducedChain(follower.chain, follower.reduction, shown, follower.task)
        position, rotation, jacobian = chain.forward_and_jacobian(learned)
        weights = follower.predictor.weights_at(learned)
        gain = weighted_pseudo_inverse(weights, jacobian)
        ratios = []
        for part in np.array_split(np.arange(len(shown)), _PARTS):
            rest = np.setdiff1d(np.arange(len(shown)), part)
            if len(rest) == 0:
                continue
            others = cls(follower, shown[rest], position[rest], rotation[rest], gain[rest], 1.0)
            for one in part[:: -(-len(part) // _GUESSES)]:
                _, central, root, wander = others._law(position[one], rotation[one])
                # What is sampled is brought onto the hand's place: only what leaves it counts.
                free = np.eye(len(central)) - gain[one] @ jacobian[one]
                spread = np.concatenate([free @ root, free @ wander], axis=1)
                deviation = np.sqrt((spread**2).sum(axis=1))
                ratios.append(np.abs(learned[one] - central) / np.maximum(deviation, 1e-9))
        factor = float(np.quantile(np.concatenate(ratios), 0.9)) / NINETY if ratios else 1.0
        return cls(follower, shown, position, rotation, gain, float(np.clip(factor, 0.2, 3.0)))

    def draw(self, path: HandPath, samples: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Draws starts for a path.

        Args:
            path: Checked path.
            samples: Sampled starts S.
            rng: Randomness, the same for every path.

        Returns:
            All joints ``(1 + S, n)`` rad, the central start first, hands near the first point and
            not yet on it; and the deviation in them, ``(1 + S, r)`` rad.
        """
        rotation = self.rotation[0]
        if self.follower.task == "pose" and path.rotation is not None:
            rotation = path.rotation[0].reshape(-1, 3, 3)
        middle, central, root, wander = self._law(path.position[0].reshape(-1), rotation)
        normal = self.factor * rng.standard_normal((2, samples, len(central)))
        deviation = np.zeros((samples + 1, len(central)))
        deviation[1:] = normal[1] @ wander.T
        starts = central + deviation
        starts[1:] += normal[0] @ root.T
        limits = self.follower.limits
        whole = self.follower.reduction.expand(starts, middle)
        return np.clip(whole, limits.lower, limits.upper), deviation

    def _law(self, position: Array, rotation: Array) -> tuple[Array, Array, Array, Array]:
        """Returns the nearby posture, the central start and two roots of its covariance."""
        follower = self.follower
        target = np.broadcast_to(rotation, self.rotation.shape)
        lack = with_turn(position - self.position, target, self.rotation)
        linear = self.position.shape[1]
        squared = (lack[:, :linear] ** 2).sum(axis=1) / NEAR_M**2
        squared += (lack[:, linear:] ** 2).sum(axis=1) / NEAR_RAD**2
        weight = np.exp(-0.5 * (squared - squared.min()))
        weight /= weight.sum()
        learned = self.shown[:, follower.reduction.kept]
        carried = learned + np.einsum("bnm,bm->bn", self.gain, lack)
        central = weight @ carried
        apart = carried - central
        freedom = max(1.0 - float((weight**2).sum()), _LEAST_FREEDOM)
        values, vectors = np.linalg.eigh((weight[:, None] * apart).T @ apart / freedom)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        wander = np.zeros_like(root)
        if follower.band is not None:
            wander = widening(follower.familiarity.relative(central)) * follower.band.factor
        return weight @ self.shown, central, root, wander
