import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from human import JOINTS, SEGMENTS, ModelError, Subject, SubjectError, generate_model, scale_model
from human.anthropometry import anthropometry_table
from human.kinematics import forward_kinematics
from human.names import mirrored


def subjects():
    return st.builds(
        lambda height, bmi, sex: Subject(height, min(250.0, max(30.0, bmi * height**2)), sex),
        st.floats(1.3, 2.2),
        st.floats(16.0, 45.0),
        st.sampled_from(["female", "male", "unknown"]),
    )


@settings(deadline=None, max_examples=40)
@given(subjects())
def test_masses_sum_exactly(subject):
    model = generate_model(subject)
    assert math.fsum(model.masses) == subject.mass_kg
    assert model.total_mass_kg == subject.mass_kg
    assert np.all(model.masses > 0.0)


@settings(deadline=None, max_examples=40)
@given(subjects())
def test_inertias_are_possible(subject):
    moments = np.linalg.eigvalsh(generate_model(subject).inertias)
    assert np.all(moments > 0.0)
    # No moment of a body exceeds the sum of the two others.
    assert np.all(moments[:, 2] <= (moments[:, 0] + moments[:, 1]) * (1.0 + 1e-12))


@settings(deadline=None, max_examples=40)
@given(subjects())
def test_solids_have_the_segment_masses_at_published_density(subject):
    model = generate_model(subject)
    density = anthropometry_table()["density_kg_m3"]
    for name, mass in zip(model.segment_names, model.masses, strict=True):
        got = mass / model.shapes[name].volume()
        assert min(v for v in density.values() if not isinstance(v, str)) * 0.999 < got < 1161.0


@pytest.mark.parametrize("sex", ["female", "male"])
def test_masses_are_de_levas(sex):
    table = anthropometry_table()["deleva"][sex]["mass_percent"]
    model = generate_model(Subject(1.7, 100.0, sex))
    mass = dict(zip(model.segment_names, model.masses, strict=True))
    groups = {
        "head_neck": mass["Head"] + mass["Neck"],
        "upper_arm": mass["RightUpperArm"],
        "forearm": mass["LeftForeArm"],
        "hand": mass["RightHand"],
        "thigh": mass["LeftUpperLeg"],
        "shank": mass["RightLowerLeg"],
        "foot": mass["RightFoot"] + mass["RightToe"],
    }
    for name, got in groups.items():
        assert got == pytest.approx(table[name], rel=2e-4)
    trunk = sum(mass[n] for n in ("Pelvis", "L5", "L3", "T12", "T8"))
    trunk += mass["RightShoulder"] + mass["LeftShoulder"]
    whole = table["upper_trunk"] + table["middle_trunk"] + table["lower_trunk"]
    assert trunk == pytest.approx(whole, rel=2e-4)


def test_trunk_and_head_balance_where_published():
    # de Leva: trunk 44.86 % of the way down from the suprasternale, 0.3055 statures above the hips;
    # head and neck 50.02 % of the way from the crown to C7. Our cuts keep both to 3 % of stature.
    model = generate_model(Subject(1.741, 73.0, "male"))
    poses = forward_kinematics(model, model.neutral())
    height = (
        poses.position[:, 2]
        + np.einsum("nij,nj->ni", poses.rotation, model.centers_of_mass)[:, 2]
        + 0.53 * 1.741
    )
    mass = model.masses

    def balance(*names):
        rows = [model.segment_names.index(name) for name in names]
        return np.average(height[rows], weights=mass[rows]) / 1.741

    trunk = balance("Pelvis", "L5", "L3", "T12", "T8", "RightShoulder", "LeftShoulder")
    assert trunk == pytest.approx(0.530 + (1.0 - 0.4486) * 0.3055, abs=0.03)
    assert balance("Head", "Neck") == pytest.approx(1.0 - 0.5002 * 0.1395, abs=0.02)


def test_stands_as_tall_as_told():
    subject = Subject(1.82, 80.0, "female")
    model = generate_model(subject)
    poses = forward_kinematics(model, model.neutral())
    head, foot, toe = (model.shapes[name] for name in ("Head", "RightFoot", "LeftToe"))
    crown = poses.of("Head")[1][2] + head.center[2] + head.radius
    soles = [
        poses.of("RightFoot")[1][2] + foot.center[2] - foot.size[2] / 2,
        poses.of("LeftToe")[1][2] + toe.center[2] - toe.size[2] / 2,
    ]
    for sole in soles:
        assert crown - sole == pytest.approx(subject.height_m, abs=1e-12)


@pytest.mark.parametrize("sex", ["female", "male", "unknown"])
def test_arm_span_is_human(sex):
    model = generate_model(Subject(1.75, 70.0, sex))
    poses = forward_kinematics(model, model.neutral())
    hand = model.shapes["LeftHand"]
    tip = poses.of("LeftHand")[1][1] + hand.center[1] + hand.size[1] / 2
    assert 0.98 < 2.0 * tip / 1.75 < 1.08


def test_left_is_right_mirrored(model):
    for index, name in enumerate(model.segment_names):
        twin = model.segment_names.index(mirrored(name))
        assert model.masses[index] == pytest.approx(model.masses[twin], rel=1e-15)
        np.testing.assert_allclose(
            model.centers_of_mass[index], model.centers_of_mass[twin] * [1, -1, 1], atol=1e-15
        )
        np.testing.assert_allclose(model.inertias[index], model.inertias[twin], rtol=1e-13)
    for joint in JOINTS:
        here, there = JOINTS.index(joint), JOINTS.index(mirrored(joint))
        np.testing.assert_array_equal(model.offsets[here], model.offsets[there] * [1, -1, 1])


def test_unknown_sex_is_said_and_between():
    parts = [generate_model(Subject(1.7, 70.0, sex)) for sex in ("female", "male", "unknown")]
    assert "assumed" in parts[2].provenance["sex"]
    assert "sex" not in parts[0].provenance
    thigh = SEGMENTS.index("RightUpperLeg")
    assert parts[2].masses[thigh] == pytest.approx(
        (parts[0].masses[thigh] + parts[1].masses[thigh]) / 2
    )


@pytest.mark.parametrize(
    ("height", "mass", "sex", "quantity"),
    [
        (17.6, 70.0, "male", "height"),
        (0.5, 70.0, "male", "height"),
        (float("nan"), 70.0, "male", "height"),
        ("1.75", 70.0, "male", "height"),
        (True, 70.0, "male", "height"),
        (1.75, -3.0, "male", "mass"),
        (1.75, float("inf"), "male", "mass"),
        (2.2, 31.0, "male", "body mass index"),
        (1.75, 70.0, "m", "sex"),
    ],
)
def test_impossible_people_are_refused(height, mass, sex, quantity):
    with pytest.raises(SubjectError, match="expected") as caught:
        Subject(height, mass, sex)
    assert caught.value.quantity.startswith(quantity)


def test_scaled_model_has_the_measured_offsets(model):
    offsets = {"jRightElbow": np.array([0.01, -0.31, 0.0]), "jL5S1": np.array([0.0, 0.0, 0.1])}
    scaled = scale_model(model.subject, offsets)
    for joint, offset in offsets.items():
        np.testing.assert_array_equal(scaled.offsets[JOINTS.index(joint)], offset)
    same = [j for j in JOINTS if j not in offsets]
    rows = [JOINTS.index(j) for j in same]
    np.testing.assert_array_equal(scaled.offsets[rows], model.offsets[rows])
    assert scaled.total_mass_kg == model.subject.mass_kg
    # The longer arm carries its centre of mass further out, at the published fraction.
    arm = SEGMENTS.index("RightUpperArm")
    np.testing.assert_allclose(scaled.centers_of_mass[arm], 0.5772 * offsets["jRightElbow"])


@pytest.mark.parametrize(
    ("joint", "offset", "message"),
    [
        ("jTail", [0, 0, 1], "expected one of"),
        ("jRightElbow", [0, -31.0, 0], "units metres"),
        ("jRightElbow", [0, 0, 0], "units metres"),
        ("jRightElbow", [0, np.nan, 0], "finite"),
        ("jRightElbow", [0.3, 0.0], "three finite"),
        ("jL5S1", [0.1, 0, 0], "point up"),
    ],
)
def test_broken_offsets_are_refused(model, joint, offset, message):
    with pytest.raises(ModelError, match=message):
        scale_model(model.subject, {joint: np.array(offset, dtype=float)})
