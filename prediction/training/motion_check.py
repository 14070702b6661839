"""Whether a recorded motion is the one that was meant: this hand, and reaching."""

import numpy as np

from human import Chain, Motion, UnknownNameError
from prediction.chain import TaskChain
from prediction.training.standing import STILL_M_S, STILL_RAD_S, standing_frames

#: A pelvis that goes faster than this walks, m/s; walking longer than this share is worth a word.
WALKING_M_S, WALKING_SHARE = 0.4, 0.3
#: Feet that a chain holds in place and that stand for less than this share are worth a word.
STANDING_SHARE = 0.98
#: How much further the other hand must have gone to be the one that was led.
OTHER_HAND = 2.0


def motion_findings(chain: TaskChain, motion: Motion) -> tuple[str, ...]:
    """Says what makes a motion a doubtful demonstration for a chain.

    Args:
        chain: To the hand that will be led; of a chain to both, hands are not compared.
        motion: A motion of the same model.

    Returns:
        What is worth a word, each a sentence; empty if nothing is.
    """
    found = []
    steps = np.linalg.norm(np.diff(motion.q[:, :2], axis=0), axis=1)  # over the ground, not down
    share = float((steps > WALKING_M_S * np.diff(motion.time_s)).mean())
    if share > WALKING_SHARE:
        found.append(
            f"the person walks in {share:.0%} of it: arms that swing are no hand that is led; cut "
            "the walking out"
        )
    if not isinstance(chain, Chain):
        return tuple(found)
    still = float(standing_frames(chain, motion).mean())
    if still < STANDING_SHARE:
        found.append(
            f"both feet stand in {still:.0%} of it (slower than {STILL_M_S:g} m/s and "
            f"{STILL_RAD_S:g} rad/s); the rest is left out"
        )
    side = chain.tip.removesuffix("HandCOM")
    if len(chain.led) == 1 and side in ("Right", "Left"):
        other = "Left" if side == "Right" else "Right"
        went, beside = _travelled(chain, motion), 0.0
        try:
            beside = _travelled(Chain(chain.model, f"{other}HandCOM", chain.base), motion)
        except UnknownNameError:  # a model of one arm
            return tuple(found)
        if beside > OTHER_HAND * went:
            found.append(
                f"the {other.lower()} hand goes {beside:.1f} m and the {side.lower()} one, which "
                f"is trained, {went:.1f} m: is {side.lower()} the hand that was led?"
            )
    return tuple(found)


def _travelled(chain: Chain, motion: Motion) -> float:
    """Returns the length of a hand's way as seen from the base, m."""
    known = {name: index for index, name in enumerate(motion.model_dof_names)}
    if any(name not in known for name in chain.dof_names):
        return 0.0
    q = motion.joint_angles[:, [known[name] for name in chain.dof_names]]
    position, _ = chain.forward(q)
    return float(np.linalg.norm(np.diff(position, axis=0), axis=1).sum())
