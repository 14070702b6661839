from dataclasses import replace

import numpy as np
import pytest

from estimation import (
    ForceTorque,
    FreeWrench,
    MeasurementError,
    ModelErrors,
    estimate,
    payload,
    real_tree,
)
from estimation.model_uncertainty import draw_models, model_spread, widened
from human import Wrench, forward_kinematics, inverse_dynamics

NOTHING = {
    "segment_mass": 0.0,
    "segment_length": 0.0,
    "joint_angle_deg": 0.0,
    "plate_offset_m": 0.0,
}
FOOT = np.array([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])


@pytest.fixture(scope="module")
def tree(person):
    return real_tree(person)


@pytest.fixture(scope="module")
def scene(person):
    """Three postures at rest on a plate under the right foot, nothing in the hand."""
    rng = np.random.default_rng(2)
    q = np.tile(person.neutral(), (3, 1))
    q[:, 7:] = rng.uniform(-0.4, 0.4, (3, person.n_dof))
    plate = inverse_dynamics(person, q)[:, :6]
    return q, plate


def sensors(plate):
    return [ForceTorque("RightFoot", plate, FOOT, fixed_to="world"), FreeWrench("RightHandCOM")]


def solve(tree, q, measurements, **more):
    still = np.zeros((len(q), 6 + tree.n_dof))
    return estimate(tree, q, still, still, measurements, **more)


def other_body(person, draw):
    """The model of a draw, made from the person's own tables."""
    longer = 1.0 + draw.length[: len(person.masses)]
    heavier = 1.0 + draw.mass[: len(person.masses)]
    return replace(
        person,
        offsets=person.offsets * longer[list(person.parents[1:]), None],
        masses=person.masses * heavier,
        centers_of_mass=person.centers_of_mass * longer[:, None],
        inertias=person.inertias * (heavier * longer**2)[:, None, None],
    )


def spread_of(tree, scene, errors, **more):
    q, plate = scene
    draws = draw_models(tree, errors, np.random.default_rng(7), **more)

    def means(drawn, posture, measurements):
        return solve(drawn, posture, measurements, spreads=False)

    time_s = np.arange(3.0)
    return draws, model_spread(tree, q, time_s, sensors(plate), errors, draws, means), time_s


def errors_of(**given):
    return ModelErrors(**{**NOTHING, "pairs": 4, **given})


def test_mass_errors_are_a_payload_of_their_sum(tree, scene):
    errors = errors_of(segment_mass=0.05)
    # Where moments are left open the hand bears exactly what the body lacks.
    q, plate = scene
    draws = draw_models(tree, errors, np.random.default_rng(7))
    given = [
        ForceTorque("RightFoot", plate, FOOT, fixed_to="world"),
        ForceTorque("Pelvis", np.zeros((3, 6)), np.array([1e-4] * 3 + [1e6] * 3)),
        FreeWrench("RightHandCOM", 1e2, 1e3),
    ]

    def means(drawn, posture, measurements):
        return solve(drawn, posture, measurements, spreads=False)

    spread = model_spread(tree, q, np.arange(3.0), given, errors, draws, means)
    hand = tree.link_names.index("RightHandCOM")
    heavier = np.array([tree.inertias[:, 0, 0] @ draw.mass for draw in draws])
    np.testing.assert_allclose(
        spread.external_wrench[:, :, hand, 2], 9.81 * heavier[:, None] * np.ones(3), rtol=0.02
    )


def test_a_weighed_body_has_the_mass_it_was_weighed_with(tree):
    errors = ModelErrors()
    rng = np.random.default_rng(0)
    for draw in draw_models(tree, errors, rng, body_mass_sd_kg=0.0):
        assert draw.tree(tree).mass_kg == pytest.approx(tree.mass_kg, abs=1e-9)
    loose = [draw.tree(tree).mass_kg for draw in draw_models(tree, errors, rng)]
    assert np.std(loose) > 0.3


def test_a_longer_body_is_the_one_that_scaling_makes(person, tree, scene):
    """Every length by the same share: positions grow with it, moments of weight too."""
    q, _ = scene
    draw = draw_models(tree, errors_of(), np.random.default_rng(0))[0]
    draw = type(draw)(draw.mass, draw.length + 0.1, draw.angle, {})
    longer = draw.tree(tree)
    still = np.zeros((3, person.nv))
    short = estimate(tree, q, still, still, method="deterministic")
    found = estimate(longer, q, still, still, method="deterministic")
    np.testing.assert_allclose(found.torque, 1.1 * short.torque, atol=1e-9)
    spin = still.copy()
    spin[:, 6:] = 1.0
    inertial = [
        estimate(body, q, still, spin, method="deterministic").torque
        - estimate(body, q, still, still, method="deterministic").torque
        for body in (tree, longer)
    ]
    np.testing.assert_allclose(inertial[1], 1.21 * inertial[0], atol=1e-9)


def test_angles_and_plates_are_moved_as_drawn(person, tree, scene):
    q, plate = scene
    errors = errors_of(joint_angle_deg=2.0, plate_offset_m=0.01)
    draw = draw_models(tree, errors, np.random.default_rng(1), plates=("RightFoot",))[0]
    moved = draw.configuration(q)
    np.testing.assert_allclose(moved[:, 7:] - q[:, 7:], np.tile(draw.angle, (3, 1)), atol=1e-15)
    assert np.array_equal(moved[:, :7], q[:, :7])
    found = [
        solve(tree, q, given, method="deterministic").external_wrench[
            :, tree.link_names.index("RightFoot")
        ]
        for given in (sensors(plate)[:1], draw.sensors(sensors(plate)[:1]))
    ]
    rotation, _ = forward_kinematics(person, q).of("RightFoot")
    difference = np.einsum("nij,nj->ni", rotation, (found[1] - found[0])[:, 3:])
    shift = draw.plate_m["RightFoot"]
    np.testing.assert_allclose(difference, np.cross(shift, plate[:, :3]), atol=1e-9)
    assert shift[2] == 0.0 < np.linalg.norm(shift)
    opposite = draw.opposite().sensors(sensors(plate))[0]
    np.testing.assert_allclose(opposite.position, -shift)


def test_bands_grow_by_the_spread_and_say_so(tree, scene):
    q, plate = scene
    errors = errors_of(segment_mass=0.05, joint_angle_deg=2.0)
    draws, spread, time_s = spread_of(tree, scene, errors)
    found = solve(tree, q, sensors(plate))
    wide = widened(found, spread, time_s)
    expected = errors.widening * np.sqrt(np.mean(spread.torque**2, axis=0))
    np.testing.assert_allclose(np.sqrt(wide.torque_sd**2 - found.torque_sd**2), expected, atol=1e-9)
    assert errors.widening > 1.2
    assert wide.bands == payload(wide).bands == "widened"
    assert np.all(payload(wide).sd_kg > payload(found).sd_kg)
    np.testing.assert_array_equal(wide.torque, found.torque)
    moment = wide.joint_moment_covariance - found.joint_moment_covariance
    own = spread.joint_wrench[:, :, 3, 3:]
    np.testing.assert_allclose(
        moment[:, 3],
        errors.widening**2 * np.einsum("pni,pnj->nij", own, own) / len(draws),
        atol=1e-9,
    )
    with pytest.raises(MeasurementError, match="uncertainty"):
        widened(wide, spread, time_s)


def test_a_foot_that_was_seen_takes_its_force_along(tree, scene):
    """An ankle under 690 N: hips and knees 2 deg wrong put it beside a force that stays."""
    ankle = tree.joint_names.index("jRightAnkle")
    found = {}
    for seen in (False, True):
        errors = errors_of(joint_angle_deg=2.0, feet_seen=seen)
        _, spread, _ = spread_of(tree, scene, errors, plates=("RightFoot",))
        found[seen] = np.sqrt(np.mean(np.sum(spread.joint_wrench[:, :, ankle, 3:] ** 2, axis=-1)))
    assert found[False] > 10.0
    assert found[True] < 0.5 * found[False]


def test_between_the_grid_deviations_are_interpolated(tree, scene):
    _, spread, _ = spread_of(tree, scene, errors_of(segment_mass=0.05))
    middle = spread.at(spread.torque, np.array([-1.0, 0.25, 2.0, 5.0]))
    np.testing.assert_allclose(middle[:, 0], spread.torque[:, 0])
    np.testing.assert_allclose(
        middle[:, 1], 0.75 * spread.torque[:, 0] + 0.25 * spread.torque[:, 1]
    )
    np.testing.assert_allclose(middle[:, 3], spread.torque[:, 2])


def test_bands_hold_the_truth_of_other_bodies_as_often_as_they_say(person, tree):
    """Each frame is the same posture of another person, taken for the one of the model."""
    rng = np.random.default_rng(3)
    errors = ModelErrors(pairs=10)
    count = 60
    q = np.tile(person.neutral(), (count, 1))
    q[:, 7:] = rng.uniform(-0.4, 0.4, person.n_dof)
    plate, true = np.empty((count, 6)), np.empty((count, person.n_dof))
    for row, draw in enumerate(
        draw_models(tree, ModelErrors(pairs=count), rng, plates=("RightFoot",))
    ):
        other, posture = other_body(person, draw), draw.configuration(q)[row]
        # The base sits at the world's origin, unturned.
        needed = inverse_dynamics(other, posture)[:6]
        plate[row] = needed
        _, origin = forward_kinematics(other, posture).of("RightFoot")
        at_foot = Wrench("RightFoot", needed[:3], needed[3:] - np.cross(origin, needed[:3]))
        true[row] = inverse_dynamics(other, posture, wrenches=[at_foot])[6:]
        plate[row, 3:] -= np.cross(draw.plate_m["RightFoot"], needed[:3])
    plate += np.sqrt(FOOT) * rng.normal(size=plate.shape)
    given = sensors(plate)[:1]
    found = solve(tree, q, given)

    def means(drawn, posture, measurements):
        return solve(drawn, posture, measurements, spreads=False)

    draws = draw_models(tree, errors, rng, plates=("RightFoot",))
    time_s = np.arange(count) * 1.0
    wide = widened(found, model_spread(tree, q, time_s, given, errors, draws, means), time_s)
    error = found.torque - true
    inside = [np.mean(np.abs(error) < 1.96 * each.torque_sd) for each in (found, wide)]
    assert inside[0] < 0.7
    assert 0.92 < inside[1] < 0.985
