"""What is wrong with demonstrations before anything is learned from them."""

import numpy as np
from numpy.typing import NDArray

from prediction.chain import TaskChain, held_tips
from prediction.demonstrations import Demonstrations
from prediction.errors import DemonstrationError
from prediction.training.held_out import Stretches

Array = NDArray[np.float64]

#: Coarsest sampling that still shows a movement, s.
COARSEST_S = 0.2
#: A hand that moves and turns less than this shows nothing, m and rad.
LEAST_TRAVEL_M = 0.05
LEAST_TURN_RAD = 0.35
#: Further beyond its range no joint stands for half a recording, rad.
BEYOND_LIMIT_RAD = 1.0
#: Faster than this, over more than so much, an angle has jumped, rad/s and rad.
JUMP_RAD_S, JUMP_RAD = 40.0, 0.7
#: Ratio of velocities to differences of angles, and their correlation, that are no rounding.
RATE_RATIO, RATE_CORRELATION = 1.6, 0.5
#: Share of the strongest direction's speed below which a direction was not shown.
DIRECTION_SHARE = 0.1
#: A hand slower than this rests, m/s; resting longer than this share is worth a word.
RESTING_M_S, RESTING_SHARE = 0.02, 0.5
_HOLE = 4.0


def check_demonstrations(chain: TaskChain, demonstrations: Demonstrations) -> tuple[str, ...]:
    """Refuses demonstrations that would teach something false, and says what they do not show.

    Args:
        chain: The chain they are of.
        demonstrations: All its joints.

    Returns:
        What is worth a word, each a sentence; empty if nothing is.

    Raises:
        DemonstrationError: Angles are not in rad, jump, or do not go with the velocities; samples
            are too far apart; the hand hardly moves.
    """
    if len(demonstrations) < 2:
        raise DemonstrationError("one sample is no demonstration: give a recorded motion")
    steps = _Steps.of(demonstrations)
    _check_steps(demonstrations, steps)
    _check_angles(chain, demonstrations)
    position, rotation, _ = chain.forward_and_jacobian(demonstrations.q)
    if rotation.ndim == 3:
        position, rotation = position[:, None], rotation[:, None]
    led = slice(held_tips(chain), None)
    position = position.reshape(*rotation.shape[:2], -1)[:, led]
    _check_travel(demonstrations, position, rotation[:, led])
    _check_rates(demonstrations, steps)
    linear = demonstrations.xdot[:, : demonstrations.linear_rows]
    velocity = linear.reshape(*rotation.shape[:2], -1)[:, led]
    return (
        *_short(demonstrations),
        *_holes(demonstrations, steps),
        *_repeats(demonstrations, steps),
        *_directions(velocity),
        *_rest(velocity),
    )


class _Steps:
    """From each sample to the next of the same take."""

    def __init__(self, index: NDArray[np.int64], seconds: Array, typical: float) -> None:
        self.index, self.seconds, self.typical = index, seconds, typical

    @classmethod
    def of(cls, demonstrations: Demonstrations) -> "_Steps":
        same = np.flatnonzero(np.diff(demonstrations.trajectory_id) == 0)
        if len(same) == 0:
            raise DemonstrationError(
                "every take has one sample: a demonstration is a motion, sampled often"
            )
        seconds = np.diff(demonstrations.time_s)[same]
        return cls(same, seconds, float(np.median(seconds)))

    @property
    def whole(self) -> NDArray[np.bool_]:
        """Steps that are no hole."""
        return np.asarray(self.seconds <= _HOLE * self.typical)


def _check_angles(chain: TaskChain, demonstrations: Demonstrations) -> None:
    middle = np.median(demonstrations.q, axis=0)
    beyond = np.abs(middle - np.clip(middle, chain.lower, chain.upper))
    beyond = np.maximum(beyond, np.abs(demonstrations.q).max(axis=0) - 2.0 * np.pi)
    worst = int(np.argmax(beyond))
    if beyond[worst] > BEYOND_LIMIT_RAD:
        raise DemonstrationError(
            f"{demonstrations.joint_names[worst]} stands at {middle[worst]:.3g} rad, expected "
            f"{chain.lower[worst]:.2f} to {chain.upper[worst]:.2f}: angles are in rad, from the "
            "T-pose"
        )


def _check_steps(demonstrations: Demonstrations, steps: _Steps) -> None:
    if steps.typical > COARSEST_S:
        raise DemonstrationError(
            f"samples are {steps.typical:.3g} s apart, expected at most {COARSEST_S:g} s: what "
            "happens between them is not shown; record at 10 Hz or more"
        )
    change = np.diff(demonstrations.q, axis=0)[steps.index]
    jump = (np.abs(change) > JUMP_RAD) & (np.abs(change) > JUMP_RAD_S * steps.seconds[:, None])
    if jump.any():
        row, joint = np.argwhere(jump)[0]
        raise DemonstrationError(
            f"{demonstrations.joint_names[joint]} jumps by {change[row, joint]:.2f} rad in "
            f"{steps.seconds[row]:.3f} s before sample {steps.index[row] + 1}: angles are in rad; "
            "unwrap them, or cut the take there"
        )


def _check_travel(demonstrations: Demonstrations, position: Array, rotation: Array) -> None:
    """Looks at led hands: positions ``(N, tips, p)`` and rotations ``(N, tips, 3, 3)``."""
    travel = turn = 0.0
    for take in np.unique(demonstrations.trajectory_id):
        rows = demonstrations.trajectory_id == take
        travel = max(travel, float(np.linalg.norm(np.ptp(position[rows], axis=0), axis=-1).max()))
        cosine = np.einsum("thij,hij->th", rotation[rows], rotation[rows][0]) - 1.0
        turn = max(turn, float(np.arccos(np.clip(0.5 * cosine, -1.0, 1.0)).max()))
    if travel < LEAST_TRAVEL_M and turn < LEAST_TURN_RAD:
        raise DemonstrationError(
            f"the hand stays within {100 * travel:.1f} cm and {np.degrees(turn):.0f} deg: nothing "
            f"is shown of how the body follows it (at least {100 * LEAST_TRAVEL_M:.0f} cm in a "
            "take); is it the other hand that moves, or the rest before the recording?"
        )


def _check_rates(demonstrations: Demonstrations, steps: _Steps) -> None:
    """Compares differences of angles with the mean of the velocities at both ends."""
    index = steps.index[steps.whole]
    change = (demonstrations.q[index + 1] - demonstrations.q[index]).ravel()
    rate = 0.5 * (demonstrations.qdot[index + 1] + demonstrations.qdot[index])
    told = (rate * steps.seconds[steps.whole][:, None]).ravel()
    moved, said = float(np.linalg.norm(change)), float(np.linalg.norm(told))
    if moved == 0.0 or said == 0.0:
        raise DemonstrationError(
            f"angles change by {moved:.3g} rad in all and velocities by {said:.3g}: one of them is "
            "missing"
        )
    correlation = float(change @ told) / (moved * said)
    ratio = said / moved
    if correlation < RATE_CORRELATION or not 1.0 / RATE_RATIO < ratio < RATE_RATIO:
        raise DemonstrationError(
            f"velocities are x{ratio:.3g} of what the angles change by (correlation "
            f"{correlation:.2f}): expected rad/s and rad, times in s, samples in the order of time"
        )


def _short(demonstrations: Demonstrations) -> list[str]:
    if len(Stretches.of(demonstrations).index):
        return []
    return [
        "every take is too short for a roll-out: bands are a guess, and the choice of method rests "
        "on single steps"
    ]


def _holes(demonstrations: Demonstrations, steps: _Steps) -> list[str]:
    holes = np.flatnonzero(~steps.whole)
    if len(holes) == 0:
        return []
    longest = holes[np.argmax(steps.seconds[holes])]
    return [
        f"{len(holes)} hole(s) in the demonstrations, the longest {steps.seconds[longest]:.2f} s "
        f"after sample {steps.index[longest]}: nothing is learned across them"
    ]


def _repeats(demonstrations: Demonstrations, steps: _Steps) -> list[str]:
    still = (np.diff(demonstrations.q, axis=0)[steps.index] == 0.0).all(axis=1)
    moving = np.abs(demonstrations.qdot[steps.index]).max(axis=1) > 0.05
    share = float((still & moving).mean())
    if share < 0.01:
        return []
    return [
        f"{share:.0%} of the samples repeat the posture before them while the body moves: frames "
        "were duplicated, and velocities are uncertain there"
    ]


def _directions(velocity: Array) -> list[str]:
    """Looks at the velocities of led hands, ``(N, tips, p)``."""
    linear = velocity.shape[-1]
    shown = linear
    for hand in np.moveaxis(velocity, 1, 0):
        values = np.linalg.svd(hand, compute_uv=False)
        shown = min(shown, int((values > DIRECTION_SHARE * values[0]).sum()))
    if shown == linear:
        return []
    where = "along one line" if shown <= 1 else "in one plane"
    return [
        f"the hand moved {where} only: how the body follows it elsewhere was not shown, and is "
        "taken from there"
    ]


def _rest(velocity: Array) -> list[str]:
    speed = np.linalg.norm(velocity, axis=-1).max(axis=1)
    share = float((speed < RESTING_M_S).mean())
    if share < RESTING_SHARE:
        return []
    return [f"the hand rests in {share:.0%} of the samples: cut the pauses out"]
