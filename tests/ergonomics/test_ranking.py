import json

import numpy as np
import pytest

from ergonomics import CostError, rank_candidates


def _by_id(ranked):
    return {candidate.id: candidate for candidate in ranked}


def test_common_noise_drops_out_of_the_differences():
    rng = np.random.default_rng(0)
    day = rng.normal(0.0, 1.0, 200)
    costs = np.stack([day + 0.3, day, day + 0.3 + 0.01 * rng.normal(size=200)])
    ranked = _by_id(rank_candidates(["a", "b", "c"], costs))
    assert ranked["b"].rank == 1
    assert ranked["b"].p_best == 1.0
    assert ranked["b"].tied_with == ()
    assert ranked["a"].tied_with == ("c",)
    assert ranked["c"].tied_with == ("a",)
    # With noise of their own the same candidates cannot be told apart on a given day.
    alone = np.stack([rng.normal(m, 1.0, 200) for m in (0.3, 0.0, 0.3)])
    assert set(_by_id(rank_candidates(["a", "b", "c"], alone))["b"].tied_with) == {"a", "c"}


def test_probability_of_being_best_matches_the_normal_model():
    rng = np.random.default_rng(1)
    costs = np.stack([rng.normal(0.0, 1.0, 40_000), rng.normal(0.5, 1.0, 40_000)])
    ranked = rank_candidates(["a", "b"], costs)
    assert ranked[0].p_best == pytest.approx(0.6382, abs=0.01)
    assert sum(c.p_best for c in ranked) == pytest.approx(1.0)
    by_mean = rank_candidates(["a", "b"], costs, tie_basis="mean")
    assert ranked[0].tied_with == ("b",)
    assert by_mean[0].tied_with == ()


def test_equal_candidates_share_rank_and_probability():
    costs = np.tile(np.linspace(0, 1, 10), (3, 1))
    costs[2] += 1.0
    ranked = rank_candidates(["a", "b", "c"], costs)
    assert [c.rank for c in ranked] == [1, 1, 3]
    assert [c.p_best for c in ranked] == [0.5, 0.5, 0.0]
    assert ranked[0].tied_with == ("b",)
    assert ranked[2].tied_with == ()


def test_regret_and_the_worst_tenth():
    costs = np.array([[1.0] * 9 + [5.0], [2.0] * 10])
    first, second = rank_candidates(["a", "b"], costs)
    assert first.mean == pytest.approx(1.4)
    assert first.expected_regret == pytest.approx(0.3)
    assert second.expected_regret == pytest.approx(0.9)
    assert (first.cvar90, second.cvar90) == (5.0, 2.0)
    assert json.loads(json.dumps(first.to_dict()))["tied_with"] == ["b"]


def test_order_of_the_candidates_changes_nothing():
    rng = np.random.default_rng(2)
    costs = rng.normal(size=(4, 30))
    forward = _by_id(rank_candidates(list("abcd"), costs))
    backward = _by_id(rank_candidates(list("dcba"), costs[::-1]))
    for name, candidate in forward.items():
        other = backward[name]
        assert (candidate.rank, candidate.p_best) == (other.rank, other.p_best)
        assert set(candidate.tied_with) == set(other.tied_with)


def test_one_sample_ranks_without_ties():
    ranked = rank_candidates(["a", "b"], [[2.0], [1.0]])
    assert [c.rank for c in ranked] == [2, 1]
    assert [c.tied_with for c in ranked] == [(), ()]


@pytest.mark.parametrize(
    ("ids", "costs", "message"),
    [
        (["a", "a"], [[1.0], [2.0]], "must differ"),
        (["a"], [[1.0], [2.0]], "expected costs"),
        (["a"], np.empty((1, 0)), "expected costs"),
        (["a", "b"], [[1.0], [np.nan]], "'b'.*not finite"),
    ],
)
def test_what_cannot_be_ranked_is_refused(ids, costs, message):
    with pytest.raises(CostError, match=message):
        rank_candidates(ids, costs)
