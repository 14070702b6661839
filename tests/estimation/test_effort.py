import numpy as np
import pytest

from estimation import (
    FreeWrench,
    UnknownLinkError,
    estimate,
    joint_efforts,
    joint_load,
    real_tree,
)
from human import Wrench, joint_loads

from .balanced_scene import balanced, random_motion


@pytest.fixture(scope="module")
def tree(person):
    return real_tree(person)


@pytest.fixture(scope="module")
def scene(person):
    rng = np.random.default_rng(23)
    return balanced(person, *random_motion(person, rng, 30), rng)


ARM = ("jRightC7Shoulder", "jRightShoulder", "jRightElbow", "jRightWrist")


def test_efforts_are_the_norms_of_the_true_moments(person, tree, scene):
    """Of the arm, whose loads hang below it, by the other package's inverse dynamics."""
    found = joint_efforts(estimate(tree, scene.q, scene.v, scene.a, scene.sensors))
    loads = joint_loads(
        person,
        scene.q,
        scene.v,
        scene.a,
        [Wrench("RightHandCOM", scene.load_world())],
        joints=ARM,
    )
    true = np.linalg.norm(loads.moment, axis=-1)
    columns = [found.joint_names.index(name) for name in loads.joint_names]
    np.testing.assert_allclose(found.effort_nm[:, columns], true, atol=0.3)
    l2 = np.linalg.norm(loads.torque.reshape(30, 4, 3), axis=-1)
    np.testing.assert_allclose(found.paper_l2_nm[:, columns], l2, atol=0.3)
    assert np.abs(true - l2).max() > 1.0


def test_quantiles_cover_the_true_efforts(tree, scene):
    exact = joint_efforts(
        estimate(tree, scene.q, scene.v, scene.a, scene.sensors, method="deterministic")
    )
    assert exact.quantiles_nm is None
    found = estimate(tree, scene.q, scene.v, scene.a, scene.noisy(np.random.default_rng(2)))
    band = joint_efforts(found, (0.025, 0.975)).quantiles_nm
    truth = joint_efforts(estimate(tree, scene.q, scene.v, scene.a, scene.sensors)).effort_nm
    inside = (band[..., 0] < truth) & (truth < band[..., 1])
    # Limbs that the noise hardly reaches are covered more often than stated.
    assert 0.92 < np.mean(inside) < 0.99


def test_efforts_that_nobody_can_tell_are_flagged(tree, scene):
    both = [*scene.sensors, FreeWrench("LeftHandCOM")]
    found = joint_efforts(estimate(tree, scene.q, scene.v, scene.a, both))
    arm = found.joint_names.index("jRightShoulder")
    hip = found.joint_names.index("jRightHip")
    assert np.mean(found.unsure[:, arm]) > 0.5
    assert not np.any(found.unsure[:, hip])


def test_the_low_back_has_force_moment_and_their_spread(person, tree, scene):
    found = joint_load(estimate(tree, scene.q, scene.v, scene.a, scene.sensors))
    loads = joint_loads(
        person,
        scene.q,
        scene.v,
        scene.a,
        [Wrench("RightHandCOM", scene.load_world())],
        joints=["jL5S1"],
    )
    for mine, true, sd in (
        (found.force, loads.force[:, 0], found.force_sd),
        (found.moment, loads.moment[:, 0], found.moment_sd),
    ):
        np.testing.assert_allclose(
            np.linalg.norm(mine, axis=1), np.linalg.norm(true, axis=1), atol=0.6
        )
        assert mine.shape == sd.shape == (30, 3)
        assert np.all(sd > 0.0)
    still = estimate(tree, scene.q, scene.v, scene.a, scene.sensors, spreads=False)
    assert joint_load(still).force_sd is None
    with pytest.raises(UnknownLinkError, match="jTail"):
        joint_load(still, "jTail")
