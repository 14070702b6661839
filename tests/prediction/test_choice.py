"""Which method is taken, and whether the reason given is the reason."""

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from prediction import TrainingOptions, train_operator
from prediction.training.choice import AS_GOOD, choose_method


def figures(error, density):
    return {"rollout_rmse_deg_held_out": error, "null_log_likelihood_held_out": density}


def test_closed_loop_error_comes_before_density():
    choice = choose_method({"a": figures(3.0, 10.0), "b": figures(4.0, 90.0)})
    assert choice.method == "a"
    assert "25% below the next: " in choice.reason
    assert "a 3.00 deg / 10.0 nats, b 4.00 deg" in choice.reason


def test_among_equal_errors_the_denser_is_taken():
    near = 3.0 * (AS_GOOD - 0.01)
    choice = choose_method({"a": figures(3.0, 10.0), "b": figures(near, 12.0)})
    assert choice.method == "b"
    assert "densest of 2 within 3% of it, by 2.0 nats: " in choice.reason


def test_without_roll_outs_density_decides_and_says_so():
    choice = choose_method({"a": figures(None, 10.0), "b": figures(None, 12.0)})
    assert choice.method == "b"
    assert "too little motion" in choice.reason


@pytest.fixture(scope="module")
def automatic():
    _, demonstrations = planar_demonstrations(seed=3)
    options = TrainingOptions(
        method="auto", optimizer="gradient", tasks=("position",), blocks=3, max_evaluations=200
    )
    return train_operator(PlanarChain(), demonstrations, seed=1, options=options)


def test_auto_takes_the_candidate_its_own_figures_prefer(automatic):
    held_out = {name: automatic.fitted(name, "position").metrics for name in automatic.method_names}
    assert set(held_out) == {"mi-nsgp", "locov-ik", "cc-gp", "cov-ik", "minimum-norm"}
    choice = choose_method(held_out)
    assert (automatic.method, automatic.training["chosen_by"]) == (choice.method, choice.reason)
    errors = [m["rollout_rmse_deg_held_out"] for m in held_out.values()]
    assert np.isfinite(errors).all() and max(errors) > 1.2 * min(errors)
