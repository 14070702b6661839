"""Whether the hands bear something, over time: with hysteresis, from the payload's distribution."""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from estimation.run.run_records import HandState
from estimation.spatial import Array, BoolArray, IntArray

#: How far the mass is above the limit, in its standard deviations, is averaged over about so long
#: before it is judged, s; more than so many count no more.
MEMORY_S, MOST_SDS = 0.1, 3.0
#: A free hand is loaded once this is the probability that it bears more than the limit; a loaded
#: one is free once it is no more likely than not.
LOADS_AT, FREES_AT = 0.95, 0.5


@dataclass(slots=True)
class HandTracker:
    """Follows the payload of the free hands together; frames come in order, in any portions.

    Attributes:
        limit_kg: who bears more is loaded.
        state: what holds now.
        above: how far the mass is above the limit, in standard deviations, averaged; None while
            nothing is known.
        time_s: of the last frame.
    """

    limit_kg: float
    state: HandState = HandState.UNKNOWN
    above: float | None = None
    time_s: float = -np.inf

    def take(
        self, time_s: Array, mass_kg: Array, sd_kg: Array, known: BoolArray
    ) -> tuple[IntArray, Array]:
        """Returns states ``(n,)`` and probabilities ``(n,)`` of a load of the next frames.

        Args:
            time_s: ``(n,)`` s.
            mass_kg: ``(n,)`` kg, of all free hands together.
            sd_kg: ``(n,)`` kg, errors of the model included if any are stated.
            known: ``(n,)`` whether the mass can be told at all.

        Derived here: two thresholds on the probability instead of on the mass, so that a payload
        which is known badly takes longer to be believed.
        """
        states = np.empty(len(time_s), dtype=np.intp)
        probability = np.empty(len(time_s))
        rows = zip(time_s.tolist(), mass_kg.tolist(), sd_kg.tolist(), known.tolist(), strict=True)
        for row, (now, mass, sd, told) in enumerate(rows):
            if not told:
                self.state, self.above = HandState.UNKNOWN, None
                states[row], probability[row] = self.state, FREES_AT
                continue
            seen = (mass - self.limit_kg) / max(sd, 1e-9)
            seen = min(max(seen, -MOST_SDS), MOST_SDS)
            if self.above is None:
                self.above = seen
            else:
                share = 1.0 - np.exp(-(now - self.time_s) / MEMORY_S)
                self.above += share * (seen - self.above)
            self.time_s = now
            chance = float(ndtr(self.above))
            if chance >= LOADS_AT:
                self.state = HandState.LOADED
            elif chance <= FREES_AT or self.state == HandState.UNKNOWN:
                self.state = HandState.FREE
            states[row], probability[row] = self.state, chance
        return states, probability


def states_by_hand(
    together: IntArray, free: tuple[bool, bool], hand_kg: Array, told: BoolArray, limit_kg: float
) -> IntArray:
    """Returns ``(n, 2)`` states of the right and the left hand from that of both together.

    One free hand bears all there is. Of two, unless their parts can be told, a load shows only in
    the sum: then neither's state is known.

    Args:
        together: ``(n,)`` from `HandTracker`.
        free: whether the right and the left hand may bear something.
        hand_kg: ``(n, 2)`` kg, their parts.
        told: ``(n, 2)`` whether the parts can be told.
        limit_kg: who bears more is loaded.
    """
    out = np.zeros((len(together), 2), dtype=np.intp)
    for hand in range(2):
        if not free[hand]:
            continue
        out[:, hand] = together
        if all(free):
            part = np.where(hand_kg[:, hand] > limit_kg, HandState.LOADED, HandState.FREE)
            part = np.where(told[:, hand], part, HandState.UNKNOWN)
            out[:, hand] = np.where(together == HandState.LOADED, part, together)
    return out
