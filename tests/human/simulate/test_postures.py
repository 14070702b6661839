import numpy as np
import pytest

from human import forward_kinematics
from human.simulate import Posture, SimulationError, simulate_postures
from human.simulate.legs import legs_of

T_ARM = {f"jRightShoulder_rot{axis}": 0.0 for axis in "xyz"}


@pytest.fixture(scope="module")
def course(person, average):
    postures = [
        Posture(hold_s=0.4),
        Posture(move_s=0.8, hold_s=0.6, angles=T_ARM, load=1.0),
        Posture(move_s=1.2, hold_s=0.6, feet="left", drop_m=0.05, load=1.0),
        Posture(move_s=1.2, hold_s=0.3),
    ]
    rng = np.random.default_rng(0)
    load = {"RightHandCOM": 5.0}
    return simulate_postures(person, average, rng, postures, load_kg=load, rate_hz=50.0)


def test_a_lifted_foot_bears_nothing_and_the_other_holds_the_balance(course, person):
    truth, held = course.truth, course.truth.segment_id
    np.testing.assert_array_equal(truth.contact_left, True)
    assert not truth.contact_right[held == 2].any()
    assert truth.contact_right[(held != 2) & (held >= 0)].all()
    poses = forward_kinematics(person, course.motion.q)
    pressure = truth.dynamics.center_of_pressure
    right, left = legs_of(person)
    R, p = poses.of("LeftFoot")
    assert np.ptp(p, axis=0).max() < 1e-9
    floor = np.column_stack((pressure, np.zeros(len(pressure))))
    seen = np.einsum("tji,tj->ti", R, floor - p)[~truth.contact_right]
    assert np.all((seen[:, 0] > left.heel) & (seen[:, 0] < left.toe))
    assert np.all(np.abs(seen[:, 1]) < left.half_width)
    lifted = poses.of("RightFoot")[1][:, 2] - right.sole
    assert lifted[held == 2].min() > 0.1
    np.testing.assert_allclose(lifted[truth.contact_right], 0.0, atol=1e-9)


def test_the_postures_are_taken_and_the_ground_bears_the_load(course, person):
    held, truth = course.truth.segment_id, course.truth
    arm = [person.dof_names.index(name) for name in T_ARM]
    assert np.abs(course.motion.joint_angles[held == 1][:, arm]).max() < 0.15
    assert np.abs(course.motion.joint_angles[held == 0][:, arm]).max() > 1.0
    low, high = course.motion.q[held == 2, 2], course.motion.q[held == 1, 2]
    assert high.min() - low.max() > 0.035
    share = truth.load_kg["RightHandCOM"] / 5.0
    np.testing.assert_allclose(share[held >= 0], held[held >= 0] % 3 > 0, atol=1e-9)
    for number, kg in enumerate((0.0, 5.0, 5.0, 0.0)):
        force = truth.dynamics.ground[held == number, 2].mean()
        assert force == pytest.approx(9.81 * (person.total_mass_kg + kg), rel=0.01)


def test_velocities_are_the_derivatives_of_the_positions(course):
    step = np.diff(course.motion.time_s)[0]
    rates = course.motion.joint_rates
    seen = np.gradient(course.motion.joint_angles, step, axis=0)[1:-1]
    assert np.abs(seen - rates[1:-1]).max() < 0.02 * np.abs(rates).max()


@pytest.mark.parametrize(
    "postures",
    [
        [Posture(), Posture(feet="right"), Posture(feet="left")],
        [Posture(feet="left"), Posture()],
        [Posture(), Posture(angles={"jTail_rotx": 1.0})],
        [Posture(), Posture(move_s=0.0)],
    ],
)
def test_what_nobody_can_do_is_refused(person, average, postures):
    with pytest.raises(SimulationError, match="posture"):
        simulate_postures(person, average, np.random.default_rng(0), postures)
