"""The likeliest sequence of states, where changing state costs something."""

import numpy as np
from numpy.typing import NDArray

from estimation.spatial import Array


def likeliest_path(cost: Array, switch: Array) -> NDArray[np.intp]:
    """Returns the states with the least sum of costs.

    Args:
        cost: ``(time, states)`` negative log likelihood of what was seen at each instant.
        switch: ``(states, states)`` cost of going from the first state to the second.

    Source: Viterbi 1967, the dynamic programme that carries his name.
    """
    best, back = cost[0], np.zeros(cost.shape, dtype=np.intp)
    states = np.arange(cost.shape[1])
    for t in range(1, len(cost)):
        ways = best[:, None] + switch
        back[t] = np.argmin(ways, axis=0)
        best = ways[back[t], states] + cost[t]
    path = np.empty(len(cost), dtype=np.intp)
    path[-1] = np.argmin(best)
    for t in range(len(cost) - 1, 0, -1):
        path[t - 1] = back[t, path[t]]
    return path
