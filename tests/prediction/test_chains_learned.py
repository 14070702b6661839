"""Whole bodies and both hands, from demonstrations to roll-outs on motion that was not shown."""

import numpy as np
import pytest
from whole_body import led, motion_of, object_way

from human import Subject, generate_model
from prediction import (
    TrainingOptions,
    UnsupportedMethodError,
    demonstrations_from_motion,
    led_chain,
    model_bytes,
    model_from_bytes,
    score_method,
    train_operator,
)

SIZES = {
    ("right", "pelvis"): (24, 6),
    ("left", "pelvis"): (24, 6),
    ("both", "pelvis"): (36, 12),
    ("right", "feet"): (42, 12),
    ("left", "feet"): (42, 12),
    ("both", "feet"): (54, 18),
}


@pytest.fixture(scope="module")
def model():
    return generate_model(Subject(1.75, 72.0))


@pytest.mark.parametrize("names", SIZES, ids=" ".join)
def test_chains_by_name(model, names):
    chain = led_chain(model, *names)
    assert chain.jacobian(np.zeros(chain.n)).shape == SIZES[names][::-1]
    with pytest.raises(UnsupportedMethodError, match="third"):
        led_chain(model, "third", names[1])
    with pytest.raises(UnsupportedMethodError, match="knees"):
        led_chain(model, names[0], "knees")


@pytest.mark.parametrize("names", [("both", "pelvis"), ("both", "feet")])
def test_what_was_learned_serves_on_motion_not_shown(model, names):
    chain, rng = led_chain(model, *names), np.random.default_rng(4)
    shown, fresh = (
        demonstrations_from_motion(chain, motion_of(chain, led(chain, *object_way(rng, n), rng)))
        for n in (8, 3)
    )
    options = TrainingOptions(method="cov-ik", tasks=("pose",), blocks=2)
    operator = train_operator(chain, shown, seed=1, options=options)
    assert (operator.skeleton.hand, operator.skeleton.fixed) == names
    again = model_from_bytes(model_bytes(operator))
    assert again.chain.tips == chain.tips and again.chain.dof_names == chain.dof_names
    learned, nothing = (
        score_method(again, method, fresh, np.random.default_rng(0), samples=8)
        for method in ("cov-ik", "minimum-norm")
    )
    assert learned.rollout_rmse_deg < 0.85 * nothing.rollout_rmse_deg
    assert learned.null_log_likelihood > nothing.null_log_likelihood + 5.0
    assert learned.rollout_hand_mean_m < 2e-4
