import dataclasses

import numpy as np
import pinocchio as pin
import pytest

from estimation import MeasurementError, TreeError, hinge_tree, real_tree
from estimation.momentum import center_of_mass, newton_euler
from estimation.tree_kinematics import (
    base_acceleration,
    check_state,
    link_accelerations,
    tree_kinematics,
)
from human import UnknownNameError

from .balanced_scene import random_motion

TREES = {"real": real_tree, "hinges": hinge_tree}


@pytest.fixture
def state(person):
    return random_motion(person, np.random.default_rng(3), 4)


def test_real_links_are_the_segments_and_two_hand_frames(person):
    tree = real_tree(person)
    assert tree.link_names == (*person.segment_names, "RightHandCOM", "LeftHandCOM")
    assert [len(axes) for axes in tree.axes] == [0] + [3] * 22 + [0, 0]
    assert tree.mass_kg == pytest.approx(70.0, abs=1e-12)


def test_hinges_are_the_papers_67_links(person):
    tree = hinge_tree(person, frames=())
    assert tree.n_links == 67
    assert [len(axes) for axes in tree.axes[1:]] == [1] * 66
    assert tree.joint_names == person.dof_names
    assert tree.mass_kg == pytest.approx(70.0, abs=1e-12)


@pytest.mark.parametrize("make", TREES.values(), ids=TREES)
def test_accelerations_are_pinocchios(person, state, make):
    q, v, a = state
    tree = make(person)
    kinematics = tree_kinematics(tree, q, v)
    base = base_acceleration(kinematics, v, a)
    found = link_accelerations(tree, kinematics, base, a[:, 6:])
    model = person.pinocchio()
    data = model.createData()
    for frame in range(len(q)):
        pin.forwardKinematics(model, data, q[frame], v[frame], a[frame])
        pin.updateFramePlacements(model, data)
        for name in (*person.segment_names, "LeftHandCOM"):
            index, link = model.getFrameId(name), tree.link_names.index(name)
            place = data.oMf[index]
            true = pin.getFrameClassicalAcceleration(model, data, index, pin.LOCAL).vector
            true[:3] -= place.rotation.T @ [0.0, 0.0, -9.81]
            np.testing.assert_allclose(found[link, frame], true, atol=1e-11)
            np.testing.assert_allclose(kinematics.position[link, frame], place.translation)
            np.testing.assert_allclose(kinematics.rotation[link, frame], place.rotation, atol=1e-13)


@pytest.mark.parametrize("make", TREES.values(), ids=TREES)
def test_newton_and_euler_are_pinocchios_rnea(person, state, make):
    q, v, a = state
    tree = make(person)
    kinematics = tree_kinematics(tree, q, v)
    base = base_acceleration(kinematics, v, a)
    accelerations = link_accelerations(tree, kinematics, base, a[:, 6:])
    joints, residual = newton_euler(tree, kinematics, accelerations, 0.0 * accelerations)
    model = person.pinocchio()
    data = model.createData()
    for frame in range(len(q)):
        tau = pin.rnea(model, data, q[frame], v[frame], a[frame])
        np.testing.assert_allclose(residual[frame], tau[:6], atol=1e-10)
        for link, dofs in enumerate(tree.dofs):
            H = kinematics.H[link][frame]
            np.testing.assert_allclose(H.T @ joints[link, frame], tau[6 + dofs], atol=1e-10)
        center = pin.centerOfMass(model, data, q[frame])
        found = kinematics.rotation[0, frame] @ center_of_mass(tree, kinematics)[frame]
        np.testing.assert_allclose(found + q[frame, :3], center, atol=1e-12)


def test_frames_the_model_has_not_are_refused(person):
    with pytest.raises(UnknownNameError, match="Tail"):
        real_tree(person, frames=("Tail",))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parents": (-1, 5, *([0] * 23))}, "parent before it"),
        ({"dof_names": ("one",)}, "every degree of freedom once"),
        ({"offsets": np.full((25, 3), np.nan)}, "offsets"),
        ({"joint_names": ("a",)}, "one joint above each"),
        ({"parents": (0, *([0] * 24))}, "base first"),
        ({"parents": (-1,)}, "one for each link"),
        ({"axes": ((), *([(7, -1, 10**9)] * 22), (), ())}, "axes of 0, 1 and 2"),
    ],
)
def test_what_is_no_tree_is_refused(person, change, message):
    with pytest.raises(TreeError, match=message):
        dataclasses.replace(real_tree(person), **change)


def test_nobody_changes_what_compiled_code_reads_as_addresses(person):
    tree = real_tree(person)
    with pytest.raises(ValueError, match="read-only"):
        tree.dofs[1][0] = 10**9
    halves = [np.arange(3) + 0.5 if len(dofs) else dofs for dofs in tree.dofs]
    with pytest.raises(TreeError, match="whole numbers"):
        dataclasses.replace(tree, dofs=halves)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda q, v, a: (q[:, :-1], v, a), "shape"),
        (lambda q, v, a: (q[0], v, a), "shape"),
        (lambda q, v, a: (q, v[:2], a), "shape"),
        (lambda q, v, a: (q, v, a * np.nan), r"finite.*frames 0, 1, 2, 3"),
        (lambda q, v, a: (q * 1.01, v, a), "unit base quaternions"),
    ],
)
def test_states_that_do_not_fit_are_refused(person, state, spoil, message):
    with pytest.raises(MeasurementError, match=message):
        check_state(real_tree(person), *spoil(*state))
