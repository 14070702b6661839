import numpy as np
import pytest

from human import DOF_NAMES
from human.simulate import OPERATOR_KINDS, SimulationError, operator
from human.simulate.operators import coherent_noise


def _of(name):
    return [i for i, dof in enumerate(DOF_NAMES) if dof.startswith(name)]


def test_null_velocity_goes_down_the_cost(average):
    comfort, rng = average.comfort, np.random.default_rng(0)
    for q in rng.uniform(comfort.lower, comfort.upper, (4, 66)):
        h = 1e-6
        slope = [(comfort.cost(q + h * e) - comfort.cost(q - h * e)) / (2 * h) for e in np.eye(66)]
        np.testing.assert_allclose(comfort.null_velocity(q), -np.array(slope), atol=1e-6)


def test_comfort_pushes_back_at_the_limits(average):
    comfort = average.comfort
    assert np.all(comfort.null_velocity(comfort.upper) < -0.9 * comfort.edge_rate)
    assert np.all(comfort.null_velocity(comfort.lower) > 0.9 * comfort.edge_rate)
    np.testing.assert_array_equal(comfort.null_velocity(comfort.neutral), 0.0)


def test_part_of_a_comfort_is_the_same_comfort(average):
    dof = np.array([3, 20, 41])
    q = average.comfort.upper - 0.05
    np.testing.assert_array_equal(
        average.comfort.of(dof).null_velocity(q[dof]), average.comfort.null_velocity(q)[dof]
    )


@pytest.mark.parametrize("kind", OPERATOR_KINDS)
def test_people_are_within_their_limits_and_mirror_symmetric_up_to_chance(kind, person):
    one = operator(kind, np.random.default_rng(0), person)
    assert np.all(one.mobility > 0.0)
    assert np.all((one.comfort.neutral > person.lower) & (one.comfort.neutral < person.upper))
    plain = operator(kind, np.random.default_rng(0), person, spread=0.0)
    right, left = _of("jRight"), _of("jLeft")
    np.testing.assert_allclose(plain.mobility[right], plain.mobility[left])


def test_kinds_differ_in_what_they_are_named_for(person):
    kinds = {k: operator(k, np.random.default_rng(0), person, spread=0.0) for k in OPERATOR_KINDS}
    lumbar = _of("jL5S1_roty") + _of("jL4L3_roty")
    turn = _of("jT9T8_rotz")
    girdle = _of("jRightC7Shoulder")
    spine = {k: o.mobility[lumbar].mean() for k, o in kinds.items()}
    assert max(spine, key=spine.__getitem__) == "stooper"
    assert max(kinds, key=lambda k: kinds[k].mobility[turn].mean()) == "twister"
    assert max(kinds, key=lambda k: kinds[k].mobility[girdle].mean()) == "arm-reacher"
    assert max(kinds, key=lambda k: kinds[k].leg_share) == "squatter"


def test_two_people_of_a_kind_differ_and_seeds_repeat(person):
    one, two, again = (operator("average", np.random.default_rng(s), person) for s in (0, 1, 0))
    assert np.std(np.log(one.mobility / two.mobility)) > 0.1
    np.testing.assert_array_equal(one.mobility, again.mobility)


def test_noise_has_the_stated_deviation_and_memory():
    sd = np.array([0.1, 0.3])
    noise = coherent_noise(np.random.default_rng(0), sd, start_s=0.0, end_s=2000.0, memory_s=0.3)
    knots = noise(np.arange(0.0, 2000.0, 0.04))
    np.testing.assert_allclose(knots.std(axis=0), sd, rtol=0.05)
    lagged = np.sum(knots[3:] * knots[:-3], axis=0) / np.sum(knots * knots, axis=0)
    np.testing.assert_allclose(lagged, np.exp(-0.12 / 0.3), atol=0.03)


def test_unknown_kinds_and_other_models_are_refused(person):
    with pytest.raises(SimulationError, match="unknown kind 'tall'"):
        operator("tall", np.random.default_rng(0))
