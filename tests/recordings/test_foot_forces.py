"""Real people over real plates: whose foot stood where, by markers and forces alone."""

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation import FootState, align, contacts_of_tracks, feet_from_plates
from human import Subject
from human.marker_recording import MarkerRecording, PlateForces
from human.markers import body_from_static, fit_markers
from human.readers import read_markers
from human.readers.opensim_table import plate_forces, read_opensim_table

#: A foot that bears more than this, N, is down.
LOADED_N = 20.0


@pytest.fixture(scope="module")
def opencap(recordings_dir: Path):
    folder = recordings_dir / "opencap_subject4"
    body = body_from_static(read_markers(folder / "static1.trc"), Subject(1.70, 60.03, "female"))

    def trial(name: str, seconds: float):
        recording = read_markers(folder / f"{name}.trc")
        keep = recording.time_s < seconds
        recording = replace(
            recording,
            time_s=recording.time_s[keep],
            position=recording.position[keep],
            valid=recording.valid[keep],
        )
        plates = plate_forces(read_opensim_table(folder / f"{name}_grf.mot"))
        return body.model, fit_markers(body, recording).motion, plates

    return trial


@pytest.fixture(scope="module")
def walks(recordings_dir: Path, tmp_path_factory: pytest.TempPathFactory):
    """Heel and toe tracks of four people's gait, and which foot bears when, where plates know."""
    with zipfile.ZipFile(recordings_dir / "ktk_walk" / "walk.c3d.zip") as archive:
        ktk = Path(archive.extract("walk.c3d", tmp_path_factory.mktemp("ktk")))
    folder = recordings_dir / "opencap_subject4"
    opencap = read_markers(folder / "walking1.trc")
    files = {
        "opencap": (
            replace(
                opencap,
                plates=plate_forces(read_opensim_table(folder / "walking1_grf.mot")),
            ),
            (("r_calc", "r_toe"), ("L_calc", "L_toe")),
            # Plates by foot, and when all that the foot bears is on them.
            (((0,), 0.0, 1.3), ((1,), 0.12, 1.3)),
        ),
        "rehazenter": (
            read_markers(recordings_dir / "rehazenter_gait" / "2014001_C1_01.c3d"),
            (("R_FCC", "R_FM2"), ("L_FCC", "L_FM2")),
            # The left foot is landing as the recording begins.
            (((0,), 0.6, 3.6), ((1,), 0.1, 2.4)),
        ),
        "ktk": (
            read_markers(ktk),
            (("RHEE", "RTOE"), ("LHEE", "LTOE")),
            (((0, 3), 1.5, 3.2), ((1,), 1.95, 3.15)),
        ),
        "walking5": (
            read_markers(recordings_dir / "opensim_walking_c3d" / "walking5.c3d"),
            (("RCAL", "RMT2"), ("LCAL", "LMT2")),
            # The left heel lands before its plate begins; the forefoot loads it later.
            (((1,), 2.15, 3.2), ((0,), 1.97, 2.8)),
        ),
    }
    return files


def tracks(recording: MarkerRecording, names) -> np.ndarray:
    out = np.empty((recording.frames, 2, 2, 3))
    for side in range(2):
        for point, name in enumerate(names[side]):
            column = recording.marker_names.index(name)
            seen = recording.valid[:, column]
            for axis in range(3):
                out[:, side, point, axis] = np.interp(
                    recording.time_s,
                    recording.time_s[seen],
                    recording.position[seen, column, axis],
                )
    return out


def loaded(plates: PlateForces, which, time_s) -> np.ndarray:
    vertical = plates.force[:, list(which), 2].sum(axis=1)
    return np.interp(time_s, plates.time_s, vertical) > LOADED_N


@pytest.mark.parametrize(
    ("name", "share", "switch_s"),
    [("opencap", 0.98, 0.03), ("rehazenter", 0.97, 0.065), ("ktk", 0.96, 0.05),
     ("walking5", 0.97, 0.03)],
)  # fmt: skip
def test_heel_and_toe_tell_when_a_foot_bears(walks, name, share, switch_s) -> None:
    """Frames right, both feet together, and the worst switch; five to seven switches each."""
    recording, names, feet = walks[name]
    time = recording.time_s
    found = contacts_of_tracks(time, tracks(recording, names), meaning="load").feet
    right, frames = 0, 0
    for side, (which, start, end) in enumerate(feet):
        known = np.flatnonzero((time > start) & (time < end))
        truth = loaded(recording.plates, which, time)[known]
        right += np.count_nonzero(truth == found[known, side])
        frames += len(known)
        true, seen = (np.diff(x.astype(int)) for x in (truth, found[:, side]))
        for at in np.flatnonzero(true):
            same = np.flatnonzero(seen == true[at])
            assert np.abs(time[same] - time[known][at]).min() <= switch_s
    assert right / frames >= share


@pytest.mark.parametrize(("name", "seconds"), [("walking1", 1.4), ("squats1", 4.0)])
def test_opencap_plates_go_to_the_feet_that_stand_on_them(opencap, name, seconds) -> None:
    model, motion, plates = opencap(name, seconds)
    feet = feet_from_plates(model, motion, plates)
    assert {(s.plate, s.foot) for s in feet.stances} == {("1", "right"), ("2", "left")}
    assert max(s.distance_m for s in feet.stances) < 0.01
    if name == "squats1":
        assert np.all(feet.known)
        assert np.sqrt(np.mean(feet.missing_n[20:-20] ** 2)) < 0.03 * 9.81 * model.total_mass_kg
    else:
        # Until 0.12 s the left foot pushes off beside its plate.
        beside = motion.time_s < 0.08
        assert np.all(feet.left.state[beside] == FootState.UNMEASURED)
        assert np.all(feet.known[(motion.time_s > 0.2)])


def test_feet_of_who_sits_stay_on_their_plates_and_the_chair_is_named(opencap) -> None:
    model, motion, plates = opencap("STS1", 4.0)
    feet = feet_from_plates(model, motion, plates)
    assert [(s.plate, s.foot) for s in feet.stances] == [("1", "right"), ("2", "left")]
    assert any("a chair" in text for text in feet.findings)
    assert not any("unloaded it reads" in text for text in feet.assumed)
    seated = (motion.time_s > 2.9) & (motion.time_s < 3.2)
    assert np.median(feet.missing_n[seated]) > 400.0


def test_clocks_of_one_laboratory_agree(opencap) -> None:
    model, motion, plates = opencap("squats1", 6.0)
    clock = align(model, motion, plates)
    assert abs(clock.estimated_s) < 0.02
    late = replace(plates, time_s=plates.time_s + 0.2)
    moved = align(model, motion, late)
    assert moved.offset_s == pytest.approx(clock.estimated_s - 0.2, abs=0.004)


def test_gait_over_several_plates(walks) -> None:
    recording = walks["ktk"][0]
    body = body_from_static(recording, Subject(1.639, 73.4, "male"))
    feet = feet_from_plates(body.model, fit_markers(body, recording).motion, recording.plates)
    order = [(s.plate, s.foot) for s in feet.stances]
    assert order[:3] == [("4", "right"), ("2", "left"), ("1", "right")]
    # The last step of the left foot is half on plate 1, and before the first it is on none.
    assert any("left foot" in text and "half on plate 1" in text for text in feet.findings)
    assert any("left foot" in text and "no plate" in text for text in feet.findings)
    walking5 = walks["walking5"][0]
    body = body_from_static(walking5, Subject(1.75, 65.0, "male"))
    quick = replace(
        walking5,
        time_s=walking5.time_s[350:800],
        position=walking5.position[350:800],
        valid=walking5.valid[350:800],
    )
    feet = feet_from_plates(body.model, fit_markers(body, quick).motion, walking5.plates)
    assert {(s.plate, s.foot) for s in feet.stances} == {("1", "left"), ("2", "right")}
    # Its plates read -14 and -18 N while nobody stands on them.
    zeros = [text for text in feet.assumed if "unloaded it reads" in text]
    assert len(zeros) == 2 and "-14.2 N" in zeros[0] and "-18.5 N" in zeros[1]
