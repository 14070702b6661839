import numpy as np
import pinocchio as pin
import pytest

from estimation import (
    Contact,
    MeasurementError,
    NoContactError,
    SingularContactsError,
    base_velocity,
    configuration_from_link,
)
from human import forward_kinematics, frame_poses
from human.rotations import matrix_to_quaternion

FEET = ("RightFoot", "LeftFoot")


def feet_of(walk, **more):
    stands = (walk.truth.contact_right, walk.truth.contact_left)
    return [Contact(name, active=stand, **more) for name, stand in zip(FEET, stands, strict=True)]


def pin_jacobian(model, q, name):
    pin_model = model.pinocchio()
    frame = pin_model.getFrameId(name)
    return pin.computeFrameJacobian(
        pin_model, pin_model.createData(), q, frame, pin.LOCAL_WORLD_ALIGNED
    )


def test_exact_rates_give_the_exact_base_velocity_in_single_and_double_support(person, walk):
    motion = walk.motion
    found = base_velocity(person, motion.q, motion.joint_rates, feet_of(walk))
    both = walk.truth.contact_right & walk.truth.contact_left
    assert 0.2 < both.mean() < 0.8
    np.testing.assert_allclose(found.twist_body, motion.v[:, :6], atol=2e-6)
    for k, contact in enumerate(feet_of(walk)):
        assert np.abs(found.slip[contact.active, k]).max() < 2e-6
        assert np.linalg.norm(found.slip[~contact.active, k, :3], axis=-1).max() > 0.5


@pytest.mark.parametrize("base", ["Pelvis", "T8", "LeftLowerLeg", "RightHandCOM"])
def test_any_link_may_be_the_base_and_moves_as_its_positions_do(person, walk, base):
    motion = walk.motion
    found = base_velocity(person, motion.q, motion.joint_rates, feet_of(walk), base=base)
    R, position = frame_poses(person, forward_kinematics(person, motion.q), base)
    h = motion.time_s[1]
    rate = (position[:-4] - 8.0 * position[1:-3] + 8.0 * position[3:-1] - position[4:]) / (12 * h)
    # Accelerations jump at steps; the median is where the fourth order of the difference holds.
    error = np.abs(found.twist_world[2:-2, :3] - rate).max(axis=1)
    assert np.median(error) < 1e-4
    assert error.max() < 0.02
    back = np.einsum("tij,tj->ti", R, found.twist_body[:, 3:])
    np.testing.assert_allclose(back, found.twist_world[:, 3:], atol=1e-12)
    for i in (60, 200, 300):
        data, pin_model = person.pinocchio().createData(), person.pinocchio()
        pin.forwardKinematics(pin_model, data, motion.q[i], motion.v[i])
        frame = pin_model.getFrameId(base)
        true = pin.getFrameVelocity(pin_model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        np.testing.assert_allclose(found.twist_world[i], true.vector, atol=5e-6)


@pytest.mark.parametrize("scale", [1.0, 0.2])
def test_contradicting_feet_are_reconciled_by_least_squares(person, walk, scale):
    rng = np.random.default_rng(5)
    motion = walk.motion.select(np.array([20, 150, 240, 320]))
    rates = motion.joint_rates + rng.normal(scale=0.3, size=motion.joint_rates.shape)
    contacts = [Contact("RightFoot"), Contact("LeftToe", velocity=(-1.1, 0.0, 0.0))]
    found = base_velocity(person, motion.q, rates, contacts, angular_scale_m=scale)
    weight = np.diag([1, 1, 1, scale, scale, scale])
    for i in range(len(motion)):
        jacobians = [weight @ pin_jacobian(person, motion.q[i], c.frame) for c in contacts]
        J = np.concatenate(jacobians)
        ground = np.r_[np.zeros(6), -1.1, np.zeros(5)]
        # Columns of the base are in its own axes: the unknown of this independent solution.
        twist, *_ = np.linalg.lstsq(J[:, :6], ground - J[:, 6:] @ rates[i], rcond=None)
        np.testing.assert_allclose(found.twist_body[i], twist, atol=1e-10)
        left = np.concatenate([weight @ s for s in found.slip[i]])
        np.testing.assert_allclose(left, J @ np.r_[twist, rates[i]] - ground, atol=1e-10)
        np.testing.assert_allclose(J[:, :6].T @ left, 0.0, atol=1e-10)


def test_on_a_treadmill_the_belt_carries_the_standing_foot(person, walk):
    motion, belt = walk.motion, np.array([-1.25, 0.1, 0.0])
    on_floor = base_velocity(person, motion.q, motion.joint_rates, feet_of(walk))
    on_belt = base_velocity(person, motion.q, motion.joint_rates, feet_of(walk, velocity=belt))
    expected = on_floor.twist_world + np.r_[belt, 0, 0, 0]
    np.testing.assert_allclose(on_belt.twist_world, expected, atol=1e-12)
    for i in (60, 200, 300):
        v = np.r_[on_belt.twist_body[i], motion.joint_rates[i]]
        for contact in feet_of(walk):
            if contact.active[i]:
                moved = pin_jacobian(person, motion.q[i], contact.frame) @ v
                np.testing.assert_allclose(moved, np.r_[belt, 0, 0, 0], atol=2e-6)


def test_three_points_hold_the_base_as_a_rigid_foot_does(person, walk):
    motion = walk.motion.select(walk.truth.contact_right & walk.truth.contact_left)
    three = [Contact(n, rigid=False) for n in ("RightFoot", "LeftFoot", "LeftToe")]
    found = base_velocity(person, motion.q, motion.joint_rates, three)
    np.testing.assert_allclose(found.twist_body, motion.v[:, :6], atol=1e-4)


@pytest.mark.parametrize("points", [("RightFoot",), ("RightFoot", "LeftFoot")])
def test_points_that_leave_a_turn_free_are_refused_by_name(person, walk, points):
    motion = walk.motion
    off = np.zeros(len(motion), dtype=bool)
    held = off.copy()
    held[7:] = True
    contacts = [Contact(name, active=held, rigid=False) for name in points]
    contacts.append(Contact("LeftToe", active=~held))
    contacts.append(Contact("RightToe", active=off))
    with pytest.raises(SingularContactsError, match=", ".join(points)) as caught:
        base_velocity(person, motion.q, motion.joint_rates, contacts)
    assert (caught.value.contacts, caught.value.index) == (points, 7)


def test_frames_without_contact_are_refused_or_marked(person, walk):
    motion = walk.motion
    gone = np.zeros(len(motion), dtype=bool)
    gone[40:45] = True
    feet = [Contact(c.frame, active=c.active & ~gone) for c in feet_of(walk)]
    with pytest.raises(NoContactError, match=r"in 5 of \d+ frames") as caught:
        base_velocity(person, motion.q, motion.joint_rates, feet)
    assert caught.value.frames == tuple(range(40, 45))
    marked = base_velocity(person, motion.q, motion.joint_rates, feet, allow_unsupported=True)
    np.testing.assert_array_equal(marked.supported, ~gone)
    np.testing.assert_array_equal(marked.twist_world[gone], 0.0)
    np.testing.assert_allclose(marked.twist_body[~gone], motion.v[~gone, :6], atol=2e-6)
    with pytest.raises(NoContactError, match="none"):
        base_velocity(person, motion.q, motion.joint_rates, [])


def test_one_frame_equals_its_row_of_a_batch(person, walk):
    motion = walk.motion
    all_frames = base_velocity(person, motion.q, motion.joint_rates, feet_of(walk), base="T8")
    i = 210
    one = [Contact(c.frame, active=bool(c.active[i])) for c in feet_of(walk)]
    found = base_velocity(person, motion.q[i], motion.joint_rates[i], one, base="T8")
    assert found.twist_body.shape == (6,)
    np.testing.assert_allclose(found.twist_body, all_frames.twist_body[i], atol=1e-12)


@pytest.mark.parametrize("link", ["Pelvis", "T8", "LeftForeArm"])
def test_a_measured_link_gives_back_the_whole_configuration(person, walk, link):
    q = walk.motion.q[::50]
    R, position = frame_poses(person, forward_kinematics(person, q), link)
    found = configuration_from_link(person, q[:, 7:], link, position, matrix_to_quaternion(R))
    again = forward_kinematics(person, found)
    true = forward_kinematics(person, q)
    np.testing.assert_allclose(again.position, true.position, atol=1e-12)
    np.testing.assert_allclose(again.rotation, true.rotation, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"q": np.zeros(5)}, "q: expected shape"),
        ({"joint_rates": np.zeros(3)}, "joint_rates: expected shape"),
        ({"joint_rates": np.full(66, np.nan)}, "joint_rates: expected finite"),
        ({"contacts": [Contact("RightFoot", active=1.0)]}, "active of RightFoot: expected bool"),
        ({"contacts": [Contact("RightFoot", velocity=(1.0, 2.0))]}, "velocity under RightFoot"),
        ({"angular_scale_m": 0.0}, "angular_scale_m"),
    ],
)
def test_what_does_not_fit_is_refused(person, change, words):
    given = {
        "q": person.neutral(),
        "joint_rates": np.zeros(66),
        "contacts": [Contact("RightFoot")],
    }
    with pytest.raises(MeasurementError, match=words):
        base_velocity(person, **(given | change))
