import json

import numpy as np
import pytest

from ergonomics import (
    DEFAULT_COST,
    CostDefinition,
    CostError,
    CostPart,
    PostureError,
    cost_samples,
)

_TIME = np.array([0.0, 0.1, 0.5, 2.0])


def _quantities(samples=6, seed=0):
    rng = np.random.default_rng(seed)
    return {
        "rula": rng.integers(1, 8, (samples, 4)),
        "back_angle_deg": rng.uniform(0, 60, (samples, 4)),
        "effort_share": rng.uniform(0, 1, (samples, 4)),
    }


def _one(aggregation, zero=0.0, full=1.0, weight=1.0):
    return CostDefinition("c", (CostPart("p", "x", "u", aggregation, zero, full, weight),))


@pytest.mark.parametrize(
    ("aggregation", "value"), [("mean", 1.0), ("max", 2.0), ("dose", 2.0), ("p90", 2.0)]
)
def test_aggregations_of_a_ramp(aggregation, value):
    cost = cost_samples({"x": _TIME}, _TIME, _one(aggregation))
    np.testing.assert_allclose(cost.total, [value])


def test_total_is_the_weighed_sum_of_scaled_parts():
    cost = cost_samples(_quantities(), _TIME)
    by_hand = sum(
        p.weight * (cost.values[p.name] - p.zero) / (p.full - p.zero) for p in DEFAULT_COST.parts
    )
    np.testing.assert_allclose(cost.total, by_hand)
    told = cost.to_dict()
    assert told["total"] == pytest.approx(sum(p["contribution"] for p in told["parts"]))
    assert json.loads(json.dumps(told)) == told
    assert DEFAULT_COST.to_dict()["direction"] == "lower is better"
    assert sum(p.weight for p in DEFAULT_COST.parts) == pytest.approx(1.0)


@pytest.mark.parametrize("name", ["rula", "back_angle_deg", "effort_share"])
def test_worse_quantity_never_costs_less(name):
    better, worse = _quantities(), _quantities()
    worse[name] = worse[name] * 1.3
    assert (cost_samples(worse, _TIME).total > cost_samples(better, _TIME).total).all()


def test_best_and_worst_ends_of_the_scale():
    ends = [
        {
            "rula": np.full((2, 4), r),
            "back_angle_deg": np.full((2, 4), b),
            "effort_share": np.full(4, e),
        }
        for r, b, e in ((1, 0.0, 0.0), (7, 60.0, 1.0))
    ]
    np.testing.assert_allclose(
        [cost_samples(q, _TIME).total for q in ends], [[0, 0], [1, 1]], atol=1e-12
    )


def test_what_does_not_fit_is_refused():
    with pytest.raises(CostError, match="needs effort_share"):
        cost_samples({"rula": np.ones((2, 4)), "back_angle_deg": np.ones((2, 4))}, _TIME)
    uneven = _quantities() | {"rula": np.ones((5, 4))}
    with pytest.raises(CostError, match="same samples"):
        cost_samples(uneven, _TIME)
    with pytest.raises(PostureError, match="finite"):
        cost_samples({"x": [0.0, np.nan, 1.0, 1.0]}, _TIME, _one("max"))
    with pytest.raises(CostError, match="aggregation"):
        _one("mode")
    for changes in ({"weight": -1.0}, {"full": 0.0}, {"weight": np.nan}):
        with pytest.raises(CostError, match="expected weight"):
            _one("mean", **changes)
