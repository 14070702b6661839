"""A person measured from markers: known bodies are found again, impossible ones are refused."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from human import HumanModel, Subject, forward_kinematics, generate_model, scale_model
from human.marker_recording import MarkerRecording
from human.markers import (
    MarkerBody,
    MarkerBodyError,
    MarkerFitError,
    MarkerSet,
    MarkersRefusedError,
    MissingLandmarksError,
    body_from_static,
    fit_markers,
    known_marker_sets,
)
from human.markers.pelvis_chest import harrington_hip
from human.simulate import MarkerNoise, SensorNoise, simulate_markers, wear_markers

SUBJECT = Subject(1.72, 71.0, "female")
SPINE = ("jL5S1", "jL4L3", "jL1T12", "jT9T8", "jT1C7")
#: Hang on the spine's height, which L5S1 shifts: another published place than the model's own.
ON_SPINE = (*SPINE, "jRightC7Shoulder", "jLeftC7Shoulder")


def unlike_the_tables() -> HumanModel:
    """A person whose limbs are not those of the tables."""
    model = generate_model(SUBJECT)
    offsets = dict(zip(model.joint_names, model.offsets, strict=True))
    stretch = {"jRightKnee": 1.06, "jLeftKnee": 1.05, "jRightAnkle": 0.93, "jLeftAnkle": 0.94}
    stretch |= {"jRightElbow": 1.08, "jLeftElbow": 1.07, "jRightWrist": 0.9, "jLeftWrist": 0.91}
    stretch |= {"jRightHip": 1.1, "jLeftHip": 1.1, "jRightShoulder": 1.05, "jLeftShoulder": 1.04}
    return scale_model(SUBJECT, {j: s * offsets[j] for j, s in stretch.items()})


def standing(model: HumanModel, frames: int = 2) -> np.ndarray:
    """Upright, arms a little away from the body, elbows slightly bent."""
    q = np.tile(model.neutral(), (frames, 1))
    q[:, 2] = 0.95
    for side, sign in (("Right", 1.0), ("Left", -1.0)):
        q[:, 7 + model.dof_names.index(f"j{side}Shoulder_rotx")] = sign * 1.3
    return q


def recorded(body: MarkerBody, q: np.ndarray, noise: MarkerNoise | None = None) -> MarkerRecording:
    time = np.arange(len(q)) / 100.0
    return simulate_markers(body, time, q, np.random.default_rng(5), noise=noise)


def changed(recording: MarkerRecording, **fields: object) -> MarkerRecording:
    return dataclasses.replace(recording, **fields)  # type: ignore[arg-type]


@pytest.mark.parametrize("marker_set", known_marker_sets(), ids=lambda s: s.name)
def test_a_known_body_is_found_again(marker_set: MarkerSet) -> None:
    model = unlike_the_tables()
    worn = wear_markers(model, marker_set)
    found = body_from_static(recorded(worn, standing(model)), SUBJECT, marker_set)
    shown = [
        j for j, joint in enumerate(model.joint_names)
        if joint not in ON_SPINE and f"{model.segment_names[j + 1]}" in found.observed
    ]  # fmt: skip
    # Without C7 and the breastbone the chest's lean is a guess, and the arms hang on it.
    roles = marker_set.roles()
    guessed = "c7" not in roles or not roles & {"jugular_notch", "right_sternal"}
    assert guessed == any("both seen" in note for note in found.notes)
    tolerance = 0.02 if guessed else 1e-12
    np.testing.assert_allclose(found.model.offsets[shown], model.offsets[shown], atol=tolerance)
    legs = [j for j in shown if any(p in model.joint_names[j] for p in ("Hip", "Knee", "Ankle"))]
    np.testing.assert_allclose(found.model.offsets[legs], model.offsets[legs], atol=1e-12)
    assert found.marker_names == worn.marker_names
    spine = [model.segment_index(name) for name in ("L5", "L3", "T12", "T8")]
    free = ~np.isin(worn.segment, spine)
    np.testing.assert_allclose(found.offset[free], worn.offset[free], atol=tolerance)
    assert set(found.observed) >= set(worn.observed)


def test_the_spine_reaches_from_the_lumbar_joint_to_the_neck() -> None:
    model = unlike_the_tables()
    found = body_from_static(recorded(wear_markers(model, "isb"), standing(model)), SUBJECT)
    neck, lumbar = (
        forward_kinematics(body, body.neutral()).of(name)[1]
        for body, name in ((model, "Neck"), (found.model, "L5"))
    )
    spine = [found.model.offsets[found.model.joint_names.index(joint)] for joint in SPINE[1:]]
    assert np.linalg.norm(np.sum(spine, axis=0)) == pytest.approx(np.linalg.norm(neck - lumbar))
    # L5S1 as published: behind the hips by a little, above them by a third of the width.
    assert -0.03 < lumbar[0] < 0.0 < 0.06 < lumbar[2] < 0.13


def test_the_place_and_heading_of_the_scene_do_not_matter() -> None:
    model = unlike_the_tables()
    recording = recorded(wear_markers(model, "opencap"), standing(model))
    c, s = np.cos(2.1), np.sin(2.1)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    moved = changed(recording, position=recording.position @ turn.T + [3.0, -2.0, 0.4])
    here, there = (body_from_static(r, SUBJECT) for r in (recording, moved))
    np.testing.assert_allclose(there.model.offsets, here.model.offsets, atol=1e-12)
    np.testing.assert_allclose(there.offset, here.offset, atol=1e-12)
    assert any("faces 120 degrees" in note for note in there.notes)


def test_a_moving_trial_stands_in_for_a_still_one() -> None:
    """Lengths do not depend on the posture, also where only the outer marker of a joint is seen."""
    model = unlike_the_tables()
    q = standing(model, 120)
    phase = np.linspace(0.0, 4.0 * np.pi, 120)
    q[:, 0] = np.linspace(0.0, 1.5, 120)
    for side, shift in (("Right", 0.0), ("Left", np.pi)):
        knee = 0.5 + 0.5 * np.sin(phase + shift)
        q[:, 7 + model.dof_names.index(f"j{side}Hip_roty")] = -knee
        q[:, 7 + model.dof_names.index(f"j{side}Knee_roty")] = knee
        q[:, 7 + model.dof_names.index(f"j{side}Hip_rotz")] = 0.2
    limbs = [model.joint_names.index(f"jRight{name}") for name in ("Knee", "Ankle", "Elbow")]
    for name, tolerance in (("isb", 1e-9), ("cmu", 2e-3)):
        found = body_from_static(recorded(wear_markers(model, name), q), SUBJECT)
        np.testing.assert_allclose(found.model.offsets[limbs], model.offsets[limbs], atol=tolerance)
        assert any("Not a still trial" in note for note in found.notes)


def test_noise_is_averaged_over_the_frames() -> None:
    model = unlike_the_tables()
    noise = MarkerNoise(SensorNoise(sd=0.003))
    recording = recorded(wear_markers(model, "isb"), standing(model, 300), noise)
    found = body_from_static(recording, SUBJECT)
    for joint in ("jRightKnee", "jLeftAnkle", "jRightElbow", "jLeftHip"):
        k = model.joint_names.index(joint)
        np.testing.assert_allclose(found.model.offsets[k], model.offsets[k], atol=1.5e-3)


def test_what_no_marker_shows_is_named_and_keeps_usual_lengths() -> None:
    model = unlike_the_tables()
    recording = recorded(wear_markers(model, "right-arm"), standing(model))
    found = body_from_static(recording, SUBJECT)
    assert {"Head", "LeftHand", "RightUpperLeg"} <= set(found.unobserved())
    assert any("LeftUpperLeg" in note and "no marker shows" in note.lower() for note in found.notes)
    left, right = (found.model.joint_names.index(f"j{side}Elbow") for side in ("Left", "Right"))
    assert found.model.offsets[left, 1] == -found.model.offsets[right, 1]
    knee = found.model.joint_names.index("jLeftKnee")
    np.testing.assert_array_equal(found.model.offsets[knee], generate_model(SUBJECT).offsets[knee])


def test_markers_that_are_lost_now_and_then_are_placed_from_the_rest() -> None:
    model = unlike_the_tables()
    worn = wear_markers(model, "opencap")
    recording = recorded(worn, standing(model, 20))
    valid = recording.valid.copy()
    knee, thigh = (recording.marker_names.index(name) for name in ("r_knee", "r_thigh1"))
    valid[:15, knee], valid[:, thigh] = False, False
    found = body_from_static(changed(recording, valid=valid), SUBJECT)
    assert "r_thigh1" not in found.marker_names
    assert any("r_thigh1" in note for note in found.notes)
    at = found.marker_names.index("r_knee")
    np.testing.assert_allclose(found.offset[at], worn.offset[knee], atol=1e-12)


def test_a_pelvis_that_is_not_seen_whole_is_refused() -> None:
    model = unlike_the_tables()
    recording = recorded(wear_markers(model, "opencap"), standing(model))
    valid = recording.valid.copy()
    valid[:, recording.marker_names.index("L.PSIS")] = False
    with pytest.raises(MissingLandmarksError, match="left_psis"):
        body_from_static(changed(recording, valid=valid), SUBJECT)


def test_a_pelvis_on_one_line_is_refused() -> None:
    model = unlike_the_tables()
    recording = recorded(wear_markers(model, "opencap"), standing(model))
    position = recording.position.copy()
    right, left, *back = (
        recording.marker_names.index(f"{side}.{spine}")
        for spine in ("ASIS", "PSIS")
        for side in "rL"
    )
    position[:, back] = 0.5 * (position[:, right] + position[:, left])[:, None]
    with pytest.raises(MarkerBodyError, match="span a plane"):
        body_from_static(changed(recording, position=position), SUBJECT)


def swapped(recording: MarkerRecording, *parts: str) -> MarkerRecording:
    """Right and left names exchanged, of the markers that hold one of these words."""
    names = []
    for name in recording.marker_names:
        side = {"R": "L", "L": "R"}.get(name[0]) if any(p in name for p in parts) else None
        names.append(side + name[1:] if side else name)
    return changed(recording, marker_names=tuple(names))


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        (("",), "upside down"),
        (("KNE", "ANK", "HEE", "TOE", "THI", "TIB"), "left knee, ankle, heel are exchanged"),
        (("SHO", "ELB", "WR", "UP", "FRM", "FIN"), "left acromion, elbow are exchanged"),
    ],
)
def test_exchanged_sides_are_refused(parts: tuple[str, ...], said: str) -> None:
    model = unlike_the_tables()
    recording = recorded(wear_markers(model, "cgm"), standing(model))
    crossed = swapped(recording, *parts)
    with pytest.raises(MarkersRefusedError, match=said) as error:
        body_from_static(crossed, SUBJECT)
    assert {f.code for f in error.value.findings} == {"sides"}


def together(first: MarkerRecording, second: MarkerRecording) -> MarkerRecording:
    """Two persons in one file, each with their name before their markers'."""
    return changed(
        first,
        marker_names=(
            *(f"Anna:{name}" for name in first.marker_names),
            *(f"Ben:{name}" for name in second.marker_names),
        ),
        position=np.concatenate(
            [first.position, second.position + np.array([0.8, 0.5, 0.0])], axis=1
        ),
        valid=np.concatenate([first.valid, second.valid], axis=1),
    )


def test_two_persons_in_one_file_are_not_mixed() -> None:
    model = unlike_the_tables()
    alone = recorded(wear_markers(model, "cgm"), standing(model))
    fewer = changed(
        alone,
        marker_names=alone.marker_names[1:],
        position=alone.position[:, 1:],
        valid=alone.valid[:, 1:],
    )
    both = together(fewer, alone)
    with pytest.raises(MarkersRefusedError, match="several persons: 'Ben', 'Anna'"):
        body_from_static(both, SUBJECT)
    body = body_from_static(both, SUBJECT, accept=("persons",))
    assert all(name.startswith("Ben:") for name in body.marker_names)
    assert abs(fit_markers(body, both).motion.q[0, 1] - 0.5) < 0.05
    # Of a person with another name nobody can tell which of the two it is.
    with pytest.raises(MarkerFitError, match="'Anna', 'Ben'"):
        fit_markers(body_from_static(alone, SUBJECT), both)


def test_an_inner_marker_taken_for_an_outer_one_is_refused() -> None:
    model = unlike_the_tables()
    recording = recorded(wear_markers(model, "isb"), standing(model))
    names = tuple(
        {"R_FLE": "R_FME", "R_FME": "R_FLE"}.get(name, name) for name in recording.marker_names
    )
    with pytest.raises(MarkersRefusedError, match="inner and outer markers of the right knee"):
        body_from_static(changed(recording, marker_names=names), SUBJECT)


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda x: 1e3 * x, "units"),
        (lambda x: x[..., [0, 2, 1]] * [1.0, -1.0, 1.0], "up"),
        (lambda x: 0.7 * x, "height"),
    ],
)
def test_wrong_units_and_verticals_are_refused(
    change: Callable[[np.ndarray], np.ndarray], code: str
) -> None:
    model = unlike_the_tables()
    recording = recorded(wear_markers(model, "isb"), standing(model))
    wrong = changed(recording, position=np.asarray(change(recording.position)))
    with pytest.raises(MarkersRefusedError, match=f"accept by name: {code}") as error:
        body_from_static(wrong, SUBJECT)
    assert [f.code for f in error.value.findings] == [code]


def test_a_stature_that_the_legs_contradict_is_refused_unless_accepted() -> None:
    model = unlike_the_tables()
    recording = recorded(wear_markers(model, "isb"), standing(model))
    small = Subject(1.25, 40.0, "female")
    with pytest.raises(MarkersRefusedError, match="times as long"):
        body_from_static(recording, small)
    found = body_from_static(recording, small, accept=("height",))
    assert any("check the height" in note for note in found.notes)


def test_a_mass_that_the_plates_contradict_is_noted() -> None:
    model = unlike_the_tables()
    recording = recorded(wear_markers(model, "isb"), standing(model))
    found = body_from_static(recording, SUBJECT, supported_mass_kg=78.0)
    assert any("78.0 kg" in note for note in found.notes)
    same = body_from_static(recording, SUBJECT, supported_mass_kg=71.5)
    assert not any("plates" in note for note in same.notes)


def test_harringtons_hip_by_hand() -> None:
    """240 mm wide, 130 mm deep: 0.24 x 130 + 9.9, 0.33 x 240 + 7.3, 0.30 x 240 + 10.9 mm."""
    np.testing.assert_allclose(harrington_hip(0.240, 0.130, "Right"), [-0.0411, -0.0865, -0.0829])
    np.testing.assert_allclose(harrington_hip(0.240, 0.130, "Left"), [-0.0411, 0.0865, -0.0829])
