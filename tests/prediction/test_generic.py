"""An operator nobody has seen: the hand exact, the law other people's, the bands wide."""

from itertools import islice

import numpy as np
import pytest

from benchmarks.prediction.generic_prior import judge, simulated_people
from human import Chain, Subject, generate_model
from prediction import (
    MinimumNormIk,
    UnsupportedMethodError,
    generic_operator,
    load_model,
    save_model,
)
from prediction.following.familiarity import widening
from prediction.training.generic import posture_at_ease
from prediction.training.generic_prior import generic_prior, prior_table

MODEL = generate_model(Subject(1.8, 80.0))
#: Mirror image about the plane through the middle of the body, y = 0.
MIRROR = np.diag([1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def right():
    return generic_operator(Chain(MODEL, tip="RightHandCOM"))


def lead(model, samples=20, task="pose", mirrored=False, **options):
    """Rolls out half a metre up and forward from a posture at ease."""
    chain = model.chain
    q0 = posture_at_ease(chain.dof_names)
    start, rotation, _ = chain.forward_and_jacobian(q0)
    time_s = np.linspace(0.0, 2.0, 51)
    side = -1.0 if mirrored else 1.0
    way = np.array([0.15, 0.1 * side, 0.4]) * (0.5 - 0.5 * np.cos(np.pi * time_s / 2.0))[:, None]
    turns = np.broadcast_to(rotation, (51, 3, 3)) if task == "pose" else None
    rng = np.random.default_rng(0)
    return model.rollout(start + way, turns, time_s, q0, samples, rng, **options), start + way


@pytest.mark.parametrize("task", ["pose", "position"])
@pytest.mark.parametrize("method", ["w-ik", "minimum-norm"])
def test_the_hand_goes_where_it_is_led_and_everything_is_unfamiliar(right, method, task):
    run, _ = lead(right, task=task, method=method)
    assert run.hand_error_m.mean() < 2e-4 and run.followed.all()
    np.testing.assert_array_equal(run.familiarity, 0.0)
    # Nobody knows where the elbow is after two seconds: the band must say so.
    elbow = [name.startswith("jRightElbow") for name in run.joint_names]
    low, high = np.quantile(run.q[:, -1][:, elbow], [0.05, 0.95], axis=0)
    assert np.degrees(high - low).max() > 20.0


def test_it_says_what_it_is_and_survives_its_file(right, tmp_path):
    assert right.is_generic and right.method == "w-ik"
    assert right.training["samples"] == 0 and "no demonstrations" in right.training["chosen_by"]
    save_model(tmp_path / "generic", right)
    again = load_model(tmp_path / "generic")
    assert again.is_generic and again.metrics == {"demonstrations": "none"}
    np.testing.assert_array_equal(lead(again)[0].q, lead(right)[0].q)


def test_joints_move_in_proportion_to_how_fast_people_move_them(right):
    W = right.fitted("w-ik").predictor.weights
    rate = generic_prior(right.joint_names, "w-ik", "pose").rate
    np.testing.assert_allclose(W / rate, W[0] / rate[0])
    least = right.fitted("minimum-norm").predictor
    assert isinstance(least, MinimumNormIk)
    np.testing.assert_array_equal(least.weights, 1.0)
    covariance = least.covariance
    np.testing.assert_allclose(covariance, covariance[0, 0] * np.eye(18), atol=1e-12)


def test_the_band_far_along_the_way_is_the_measured_spread(right):
    for method in ("w-ik", "minimum-norm"):
        for task in ("pose", "position"):
            prior = generic_prior(right.joint_names, method, task)
            far = right.fitted(method, task).band.deviation(np.array(1e9))
            np.testing.assert_allclose(far * widening(np.zeros(())), prior.deviation)


def test_the_left_hand_is_the_mirror_of_the_right(right):
    left = generic_operator(Chain(MODEL, tip="LeftHandCOM"))
    one, way = lead(right, samples=0)
    other, mirrored = lead(left, samples=0, mirrored=True)
    np.testing.assert_allclose(mirrored, way @ MIRROR, atol=1e-12)
    sign = [1.0 if name.endswith("roty") else -1.0 for name in left.joint_names]
    np.testing.assert_allclose(other.central, one.central * sign, atol=1e-9)


def test_joints_that_nobody_measured_are_refused():
    with pytest.raises(UnsupportedMethodError, match="jRightHip"):
        generic_operator(Chain(MODEL, tip="RightFoot"))


def test_bands_hold_on_people_who_did_not_make_them_and_the_generic_law_is_nearer():
    people = list(islice(simulated_people([11]), 2))
    table = dict(prior_table())
    found = [judge(one, table, "w-ik", "pose", 40) for one in people]
    least = [judge(one, table, "minimum-norm", "pose", 40) for one in people]
    assert min(one.coverage for one in found + least) >= 0.87
    ratio = [a.error_deg / b.error_deg for a, b in zip(found, least, strict=True)]
    assert np.exp(np.mean(np.log(ratio))) < 0.95
