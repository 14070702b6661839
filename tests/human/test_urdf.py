import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from human import (
    ModelError,
    Subject,
    UrdfError,
    from_urdf,
    generate_model,
    inverse_dynamics,
    to_urdf,
)
from human.kinematics import forward_kinematics
from human.urdf_xml import LARGEST_BYTES

INERTIAL = (
    '<inertial><mass value="{mass}"/><origin xyz="{com}"/>'
    '<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0.001" ixz="0" iyz="0"/></inertial>'
)


def link(name, mass=1.0, com="0 0 0.1", more=""):
    return f'<link name="{name}">{INERTIAL.format(mass=mass, com=com)}{more}</link>'


def joint(name, parent, child, kind="revolute", xyz="0 0 0", rpy="0 0 0", axis="0 1 0"):
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{xyz}" rpy="{rpy}"/>'
        f'<parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{axis}"/>'
        '<limit lower="-1" upper="2" effort="9" velocity="9"/></joint>'
    )


def robot(*parts):
    return f'<robot name="toy">{"".join(parts)}</robot>'


#: A trunk of two segments, the second on a two-axis joint, with a weight and a camera fixed to it.
TOY = robot(
    link("base", 3.0),
    '<link name="between"/>',
    link("upper", 2.0),
    link("weight", 0.5, "0.02 0 0"),
    '<link name="camera"/>',
    joint("jWaist_rotz", "base", "between", xyz="0 0 0.4", axis="0 0 1"),
    joint("jWaist_rotx", "between", "upper", axis="1 0 0"),
    joint("bolt", "upper", "weight", "fixed", xyz="0.1 0.2 0.3"),
    joint("screw", "weight", "camera", "fixed", xyz="0 0 0.1"),
)


def peer_of(xml):
    peer = pin.buildModelFromXML(xml, pin.JointModelFreeFlyer())
    return peer, peer.createData()


def test_round_trip_is_exact(model):
    back = from_urdf(to_urdf(model))
    for name in ("offsets", "lower", "upper", "masses", "centers_of_mass", "inertias", "dof_axes"):
        np.testing.assert_array_equal(getattr(back, name), getattr(model, name), err_msg=name)
    for name in ("segment_names", "joint_names", "dof_names", "parents", "name"):
        assert getattr(back, name) == getattr(model, name)
    assert dict(back.shapes) == dict(model.shapes)
    assert back.frames.keys() == model.frames.keys()
    for name, frame in model.frames.items():
        np.testing.assert_array_equal(back.frames[name].position, frame.position)


def test_pinocchio_reads_ours_as_we_mean_it(model, configurations):
    peer, data = peer_of(to_urdf(model))
    assert pin.computeTotalMass(peer) == pytest.approx(model.total_mass_kg, rel=1e-12)
    order = np.array([peer.idx_vs[peer.getJointId(name)] for name in model.dof_names])
    for q in configurations(model, 5):
        theirs = q.copy()
        theirs[order + 1] = q[7:]
        expected = pin.rnea(peer, data, theirs, np.zeros(peer.nv), np.zeros(peer.nv))
        got = inverse_dynamics(model, q)
        np.testing.assert_allclose(got[6:], expected[order], atol=1e-9)
        np.testing.assert_allclose(got[:6], expected[:6], atol=1e-9)
        pin.framesForwardKinematics(peer, data, theirs)
        poses = forward_kinematics(model, q)
        for name in model.segment_names:
            place = data.oMf[peer.getFrameId(name)]
            np.testing.assert_allclose(poses.of(name)[1], place.translation, atol=1e-12)
            np.testing.assert_allclose(poses.of(name)[0], place.rotation, atol=1e-12)


def test_every_segment_shows(model):
    document = ElementTree.fromstring(to_urdf(model))
    shown = {e.get("name") for e in document.findall("link") if e.find("visual") is not None}
    assert shown == set(model.segment_names)
    assert "mesh" not in to_urdf(model)


def test_toy_against_pinocchio():
    toy = from_urdf(TOY)
    assert toy.segment_names == ("base", "upper")
    assert toy.joint_names == ("jWaist",)
    assert toy.dof_names == ("jWaist_rotz", "jWaist_rotx")
    np.testing.assert_array_equal(toy.frames["camera"].position, [0.1, 0.2, 0.4])
    peer, data = peer_of(TOY)
    rng = np.random.default_rng(0)
    q = toy.neutral()
    q[7:] = rng.normal(size=2)
    v, a = rng.normal(size=(2, 8))
    np.testing.assert_allclose(
        inverse_dynamics(toy, q, v, a), pin.rnea(peer, data, q, v, a), atol=1e-12
    )


def test_fixed_segment_of_the_body_stays_a_segment():
    xml = robot(
        link("RightFoot"), link("RightToe"), joint("jBall", "RightFoot", "RightToe", "fixed")
    )
    model = from_urdf(xml)
    assert model.segment_names == ("RightFoot", "RightToe")
    assert model.dof_names == ()
    assert from_urdf(to_urdf(model)).masses.tolist() == [1.0, 1.0]


def test_other_spellings_are_resolved():
    xml = robot(link("L3"), link("T12"), joint("jL1T2_rotx", "L3", "T12", axis="1 0 0"))
    assert from_urdf(xml).dof_names == ("jL1T12_rotx",)


def test_visuals_of_every_kind():
    def visual(geometry, rpy="0 0 0"):
        return f'<visual><origin xyz="1 2 3" rpy="{rpy}"/><geometry>{geometry}</geometry></visual>'

    solids = {
        "box": visual('<box size="1 2 3"/>', "0 0 1.5708"),
        "along_x": visual('<cylinder radius="0.1" length="2"/>', "0 1.57 0"),
        "ball": visual('<sphere radius="0.3"/>'),
        "mesh": visual('<mesh filename="body.stl"/>'),
        "tilted": visual('<cylinder radius="0.1" length="2"/>', "0 0.5 0"),
    }
    names = list(solids)
    links = [link(name, more=solid) for name, solid in solids.items()]
    joints = [joint(f"to_{n}", names[0], n, axis="0 0 1") for n in names[1:]]
    shapes = from_urdf(robot(*links, *joints)).shapes
    assert shapes["box"].size == (2.0, 1.0, 3.0)
    assert shapes["along_x"].axis == 0
    assert shapes["ball"].center == (1.0, 2.0, 3.0)
    assert set(shapes) == {"box", "along_x", "ball"}


BOMB = (
    '<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>'
    '<robot name="&b;"><link name="base"/></robot>'
)
STOLEN = (
    '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot><link name="&x;"/></robot>'
)
PAIR = (link("a"), link("b"))
REFUSED = [
    ("", "not well-formed"),
    ("not xml", "not well-formed"),
    (b"\xff\xfe\x00", "not well-formed|decoded"),
    ('<?xml version="1.0" encoding="no-such"?><robot/>', "not well-formed|decoded"),
    (TOY[: len(TOY) // 2], "not well-formed"),
    (BOMB, "document type"),
    (STOLEN, "document type"),
    (" " * (LARGEST_BYTES + 1), "at most"),
    ("<sdf/>", "expected <robot>"),
    (robot(), "one root, got 0"),
    (robot(*PAIR), "one root, got 2"),
    (robot(link("a"), link("a")), "link 'a'.*twice"),
    (robot("<link/>"), "expected a name"),
    (robot(*PAIR, joint("j", "a", "b"), joint("j", "a", "b")), "joint 'j'.*twice"),
    (robot(*PAIR, joint("j", "a", "b"), joint("k", "a", "b")), "one joint above"),
    (robot(*PAIR, joint("j", "a", "c")), "joint 'j' child.*'c'"),
    (robot(*PAIR, joint("j", "a", "b", "floating")), "revolute, continuous or fixed"),
    (robot(*PAIR, joint("j", "a", "b", rpy="0 0 0.1")), "rpy 0 0 0"),
    (robot(*PAIR, joint("j", "a", "b", axis="0 0.6 0.8")), "joint 'j' axis"),
    (robot(*PAIR, joint("j", "a", "b", axis="0 0 -1")), "joint 'j' axis"),
    (robot(*PAIR, joint("j", "a", "b", xyz="0 0")), "three numbers"),
    (robot(*PAIR, joint("j", "a", "b", xyz="0 0 nan")), "finite"),
    (robot(*PAIR, joint("j", "a", "b", xyz="0 0 one")), "expected a number"),
    (robot(*PAIR, joint("j", "a", "b").replace('upper="2"', 'upper="-2"')), "lower <= upper"),
    (robot(*PAIR, joint("j", "a", "b").replace('upper="2"', "")), "limit upper"),
    (robot(link("a", mass=-1.0)), "zero or more kg"),
    (robot(link("a").replace('ixx="0.02"', 'ixx="-0.02"')), "negative moment"),
    (robot(*PAIR, link("c"), joint("j", "b", "c"), joint("k", "c", "b")), "tree"),
    (
        robot(
            link("a"),
            '<link name="m"/>',
            link("b"),
            joint("j", "a", "m"),
            joint("k", "m", "b"),
        ),
        "each axis once",
    ),
]


@pytest.mark.parametrize(("xml", "message"), REFUSED)
def test_what_is_no_human_is_refused(xml, message):
    with pytest.raises(UrdfError, match=message) as caught:
        from_urdf(xml)
    assert caught.value.place


@settings(deadline=None, max_examples=60)
@given(st.integers(0, len(TOY)), st.integers(0, 40), st.binary(max_size=8))
def test_damaged_documents_raise_nothing_else(start, length, put):
    data = TOY.encode()
    try:
        from_urdf(data[:start] + put + data[start + length :])
    except UrdfError:
        pass


def test_names_other_tools_cannot_take_are_refused(model):
    with pytest.raises(ModelError, match="letters, digits"):
        to_urdf(replace(model, name='a"b'))


def test_subject_is_kept():
    subject = Subject(1.7, 60.0, "female")
    assert from_urdf(to_urdf(generate_model(subject)), subject=subject).subject is subject
