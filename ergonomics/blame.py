"""How much of a score each part of the body is to blame for.

Taking one part at a time to its best is not enough: in a deep stoop trunk and neck each reach the
last column of the table, so that mending either alone changes nothing and both would look
innocent. The Shapley value averages what a part adds over every order in which the parts could go
from their best to what they are. The shares are never negative, since no table falls along an
axis, and they add up to the score's excess over its least.

Source: Shapley 1953, A value for n-person games (Contributions to the Theory of Games II).
"""

from collections.abc import Callable, Mapping
from functools import cache
from math import factorial
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .columns import chunks
from .reba_arrays import (
    REBA_ADDED,
    REBA_PARTS,
    RebaInputs,
    combine_reba,
    reba_parts,
    reba_ranges,
)
from .rula_arrays import (
    RULA_ADDED,
    RULA_PARTS,
    RulaInputs,
    combine_rula,
    rula_parts,
    rula_ranges,
)
from .rules import DEFAULT_RULES, ScoringRules

Floats = NDArray[np.float64]

#: RULA's load and muscle use each enter twice, for the arm and for the body: one part each.
RULA_GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        **{part: (part,) for part in RULA_PARTS},
        "load": ("force_a", "force_b"),
        "muscle_use": ("muscle_a", "muscle_b"),
    }
)
REBA_GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {part: (part,) for part in (*REBA_PARTS, *REBA_ADDED)}
)
#: Postures at a time; each is scored under all 512 choices of parts.
_CHUNK = 64


def rula_blame(inputs: RulaInputs, rules: ScoringRules = DEFAULT_RULES) -> dict[str, Floats]:
    """Returns how many points of RULA each part is to blame for, ``(...)`` by part.

    Args:
        inputs: The batch. Unmeasured parts stay at their greatest and take no blame.
        rules: The conventions to apply.

    Returns:
        Shares by part of ``RULA_GROUPS``, adding up to the final score less its least.
    """
    parts = (*RULA_PARTS, *RULA_ADDED)
    return _shares(
        inputs,
        RULA_GROUPS,
        rula_ranges(frozenset(parts)),
        lambda columns: rula_parts(columns, rules),
        combine_rula,
    )


def reba_blame(inputs: RebaInputs, rules: ScoringRules = DEFAULT_RULES) -> dict[str, Floats]:
    """Returns how many points of REBA each part is to blame for, ``(...)`` by part.

    Args:
        inputs: The batch. Unmeasured parts stay at their greatest and take no blame.
        rules: The conventions to apply.

    Returns:
        Shares by part of ``REBA_GROUPS``, adding up to the final score less its least.
    """
    parts = (*REBA_PARTS, *REBA_ADDED)
    return _shares(
        inputs,
        REBA_GROUPS,
        reba_ranges(frozenset(parts)),
        lambda columns: reba_parts(columns, rules),
        combine_reba,
    )


def _shares(
    inputs: RulaInputs | RebaInputs,
    groups: Mapping[str, tuple[str, ...]],
    ranges: tuple[Mapping[str, int], Mapping[str, int]],
    score_parts: Callable[[Mapping[str, NDArray[Any]]], Mapping[str, NDArray[np.int8]]],
    combine: Callable[[Mapping[str, NDArray[Any]]], Mapping[str, NDArray[Any]]],
) -> dict[str, Floats]:
    least, greatest = ranges
    names = [name for name, parts in groups.items() if inputs.unmeasured.isdisjoint(parts)]
    present, weight = _orders(len(names))
    shape = inputs.shape
    out = {name: np.empty(shape) for name in names}
    flat = {name: array.reshape(-1) for name, array in out.items()}
    for run, columns in chunks(inputs.arrays(), shape, _CHUNK):
        n = run.stop - run.start
        scored = score_parts(columns)
        mixed: dict[str, NDArray[Any]] = {
            part: np.array([greatest[part]])
            for parts in groups.values()
            for part in parts
            if part in inputs.unmeasured
        }
        for name, parts in groups.items():
            for part in parts:
                if part in mixed:
                    continue
                own = np.broadcast_to(scored[part], (n,))
                if name not in names:
                    mixed[part] = np.tile(own, len(present))
                    continue
                here = present[:, names.index(name), None]
                mixed[part] = np.where(here, own, np.int8(least[part])).reshape(-1)
        final = np.broadcast_to(combine(mixed)["final"], (len(present) * n,))
        shares = weight @ final.reshape(len(present), n).astype(np.float64)
        for name, share in zip(names, shares / factorial(len(names)), strict=True):
            flat[name][run] = share
    return out


@cache
def _orders(players: int) -> tuple[NDArray[np.bool_], Floats]:
    """Returns all subsets of the parts, and the weights that turn their scores into shares.

    Args:
        players: How many parts there are.

    Returns:
        ``(2**players, players)`` membership, and ``(players, 2**players)`` weights times
        ``players!``: whole numbers, so that sums of scores stay exact and a part that changes
        nothing gets zero and not a rounding.
    """
    present = (np.arange(2**players)[:, None] >> np.arange(players)) & 1 == 1
    size = present.sum(axis=1)
    orders = [factorial(s) * factorial(players - s - 1) for s in range(players)]
    chance = np.array([*orders, 0], dtype=np.float64)
    weight = np.where(present, chance[size - 1][:, None], -chance[size][:, None]).T
    return present, weight
