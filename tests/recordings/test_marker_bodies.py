"""People measured from real recordings: sets told by names, lengths and joint centres as stated."""

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from human import Subject
from human.marker_recording import MarkerRecording
from human.markers import MarkerBody, body_from_static, recognise_marker_set
from human.markers.landmarks import Landmarks, axes_along, frames_with, in_axes, median
from human.markers.limbs import measure_leg
from human.markers.pelvis_chest import harrington_hip, measure_pelvis
from human.readers import read_markers

#: Statures are not stated but for one; these fit the legs.
PEOPLE = {
    "opencap_subject4/static1.trc": Subject(1.70, 60.0),
    "opencap_subject4/walking1.trc": Subject(1.70, 60.0),
    "ktk_walk/walk.c3d": Subject(1.639, 73.4),
    "rehazenter_gait/2014001_ST.c3d": Subject(1.65, 65.0),
    "rehazenter_gait/2014001_C1_01.c3d": Subject(1.65, 65.0),
    "cmu_c3d/cmu_02_05.c3d": Subject(1.75, 70.0),
    "pyomeca_arm_box/markers_analogs.c3d": Subject(1.75, 70.0),
    "opensim_walking_c3d/walking5.c3d": Subject(1.78, 70.0),
}
PELVIS = ("right_asis", "left_asis", "right_psis", "left_psis")


@pytest.fixture
def load(recordings_dir: Path, tmp_path: Path):  # type: ignore[no-untyped-def]
    def read(name: str) -> MarkerRecording:
        if name.startswith("ktk"):
            with zipfile.ZipFile(recordings_dir / "ktk_walk" / "walk.c3d.zip") as archive:
                return read_markers(Path(archive.extract("walk.c3d", tmp_path)))
        return read_markers(recordings_dir / name)

    return read


def span(body: MarkerBody, joint: str) -> float:
    return float(np.linalg.norm(body.model.offsets[body.model.joint_names.index(joint)]))


@pytest.mark.parametrize(
    ("name", "set_name", "placed", "unknown", "hidden"),
    [
        ("opencap_subject4/static1.trc", "opencap", 51, 0, 6),
        ("opencap_subject4/walking1.trc", "opencap", 47, 0, 6),
        ("ktk_walk/walk.c3d", "cgm", 18, 0, 16),
        ("rehazenter_gait/2014001_ST.c3d", "isb", 52, 0, 4),
        ("rehazenter_gait/2014001_C1_01.c3d", "isb", 52, 0, 4),
        ("cmu_c3d/cmu_02_05.c3d", "cmu", 41, 0, 2),
        ("pyomeca_arm_box/markers_analogs.c3d", "right-arm", 43, 8, 14),
        ("opensim_walking_c3d/walking5.c3d", "clusters", 34, 0, 12),
    ],
)
def test_every_set_is_told_and_the_person_measured(  # type: ignore[no-untyped-def]
    load, name: str, set_name: str, placed: int, unknown: int, hidden: int
) -> None:
    recording = load(name)
    matched = recognise_marker_set(recording.marker_names)
    assert (matched.marker_set.name, len(matched.unknown)) == (set_name, unknown)
    body = body_from_static(recording, PEOPLE[name])
    assert (len(body.marker_names), len(body.unobserved())) == (placed, hidden)
    # A marker lies on its segment's skin, not across the room.
    assert np.max(np.linalg.norm(body.offset, axis=1)) < 0.55
    for joint in ("Knee", "Ankle", "Elbow", "Wrist"):
        right, left = span(body, f"jRight{joint}"), span(body, f"jLeft{joint}")
        assert right == pytest.approx(left, rel=0.08)
        assert 0.20 < right < 0.50


def test_a_walk_measures_the_same_person_as_the_standing_trial(load) -> None:  # type: ignore[no-untyped-def]
    for still, walking, tolerance in (
        ("rehazenter_gait/2014001_ST.c3d", "rehazenter_gait/2014001_C1_01.c3d", 0.008),
        # Here the walk lacks the inner markers of knee and ankle.
        ("opencap_subject4/static1.trc", "opencap_subject4/walking1.trc", 0.015),
    ):
        first, second = (body_from_static(load(n), PEOPLE[n]) for n in (still, walking))
        for joint in ("Hip", "Knee", "Ankle", "Elbow", "Wrist"):
            for side in ("Right", "Left"):
                apart = abs(span(first, f"j{side}{joint}") - span(second, f"j{side}{joint}"))
                assert apart < tolerance, (still, side, joint)


def landmarks_of(recording: MarkerRecording, *without: str) -> Landmarks:
    matched = recognise_marker_set(recording.marker_names)
    place_of = {n: p for n, p in matched.place_of.items() if p.role not in without}
    needed = [str(matched.name_of_role(role)) for role in PELVIS]
    frames = frames_with(recording, needed, 300)
    return Landmarks(recording, replace(matched, place_of=place_of), frames)


def test_the_regression_finds_the_hips_near_those_in_the_file(load) -> None:  # type: ignore[no-untyped-def]
    """The file has the hip found from motion and one by regression; ours is a regression."""
    recording = load("opencap_subject4/static1.trc")
    points = landmarks_of(recording)
    front, back = points.middle(*PELVIS[:2]), points.middle(*PELVIS[2:])
    across = points.of("left_asis") - points.of("right_asis")
    plane = axes_along(across, 1, front - back, 0)
    width, depth = (float(median(np.linalg.norm(v, axis=1))) for v in (across, front - back))
    error = {}
    for side in ("Right", "Left"):
        ours = harrington_hip(width, depth, side)
        for kind in ("HJC", "HJC_reg"):
            column = recording.marker_names.index(f"{side[0]}_{kind}")
            theirs = median(in_axes(plane, recording.position[:300, column] - front[:300]))
            error[side, kind] = float(np.linalg.norm(ours - theirs))
    assert error["Right", "HJC_reg"] < 0.005
    assert error["Left", "HJC_reg"] < 0.013
    assert max(error.values()) < 0.019


@pytest.mark.parametrize(
    ("name", "knee_m", "ankle_m"),
    [
        ("opencap_subject4/static1.trc", 0.012, 0.010),
        ("rehazenter_gait/2014001_C1_01.c3d", 0.016, 0.010),
        ("ktk_walk/walk.c3d", 0.009, 0.011),
    ],
)
def test_one_marker_finds_a_joint_near_where_two_or_other_software_do(  # type: ignore[no-untyped-def]
    load, name: str, knee_m: float, ankle_m: float
) -> None:
    recording, height = load(name), PEOPLE[name].height_m
    full = landmarks_of(recording)
    for side in ("Right", "Left"):
        low = side.lower()
        inner = [f"{low}_{j}_{w}" for j in ("knee", "ankle") for w in ("medial", "center")]
        few = landmarks_of(recording, *inner)
        one, two = (
            measure_leg(points, measure_pelvis(points, "unknown"), side, height)
            for points in (few, full)
        )
        for joint, most in (("Knee", knee_m), ("Ankle", ankle_m)):
            apart = np.linalg.norm(one.centers[joint] - two.centers[joint], axis=1)
            assert np.nanmedian(apart) < most, (side, joint)
