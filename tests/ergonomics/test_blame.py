from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from ergonomics import (
    RulaInputs,
    reba_blame,
    rula_blame,
    score_reba,
    score_reba_with,
    score_rula,
    score_rula_interval,
    score_rula_with,
)
from ergonomics.blame import REBA_GROUPS, RULA_GROUPS
from ergonomics.reba_arrays import reba_ranges
from ergonomics.rula_arrays import rula_ranges

from .random_postures import random_reba, random_rula

_METHODS = {
    "rula": (random_rula, rula_blame, score_rula, score_rula_with, rula_ranges, RULA_GROUPS),
    "reba": (random_reba, reba_blame, score_reba, score_reba_with, reba_ranges, REBA_GROUPS),
}
_BOTH = pytest.mark.parametrize("method", list(_METHODS))


@_BOTH
def test_shares_add_up_to_the_excess_over_the_least(method):
    make, blame, score, score_with, ranges, groups = _METHODS[method]
    inputs = make(np.random.default_rng(0), 500)
    least, _ = ranges(frozenset(p for parts in groups.values() for p in parts))
    shares = blame(inputs)
    excess = score(inputs).final.astype(float) - score_with(inputs, least).final
    np.testing.assert_allclose(sum(shares.values()), excess, atol=1e-9)
    assert all((share >= 0.0).all() for share in shares.values())


@_BOTH
def test_part_at_its_least_takes_no_blame(method):
    make, blame, score, _, ranges, groups = _METHODS[method]
    inputs = make(np.random.default_rng(1), 300)
    shares = blame(inputs)
    for name, parts in groups.items():
        own = np.stack([getattr(score(inputs), part) for part in parts])
        least, _ = ranges(frozenset(parts))
        at_least = (own == np.array([least[p] for p in parts])[:, None]).all(axis=0)
        assert (shares[name][at_least] == 0.0).all(), name


def test_shares_average_over_every_order_of_the_parts():
    # Three parts only, every order by hand.
    inputs = RulaInputs(95.0, 80.0, 0.0, 25.0, 70.0)
    least, _ = rula_ranges(frozenset({"upper_arm", "neck", "trunk"}))
    share = dict.fromkeys(least, 0.0)
    for order in permutations(least):
        mended = dict(least)
        for part in order:
            before = int(score_rula_with(inputs, mended).final)
            del mended[part]
            share[part] += (int(score_rula_with(inputs, mended).final) - before) / 6
    got = rula_blame(inputs)
    for part, expected in share.items():
        assert float(got[part]) == pytest.approx(expected)


def test_unmeasured_parts_stay_at_their_greatest_and_take_no_blame():
    inputs = replace(
        random_rula(np.random.default_rng(2), 200), unmeasured=frozenset({"wrist", "force_a"})
    )
    shares = rula_blame(inputs)
    assert "wrist" not in shares and "load" not in shares
    assert (sum(shares.values()) <= score_rula_interval(inputs).high.final - 1 + 1e-9).all()


def test_batches_keep_their_shape():
    inputs = random_rula(np.random.default_rng(3), 200)
    folded = replace(inputs, **{k: a.reshape(4, 50) for k, a in inputs.arrays().items()})
    flat, shares = rula_blame(inputs), rula_blame(folded)
    for name, share in shares.items():
        np.testing.assert_array_equal(share.reshape(-1), flat[name])
