import numpy as np
import pytest

from estimation import MeasurementError, contacts_of_motion, contacts_of_tracks
from human import HumanModel, motion_from_configurations
from human.simulate import Cadence, Stance, operator, simulate_walking

#: Standing added before and after the walk, as in the paper's T4 (static, walking, static) [s].
STILL_S = 2.0
#: sd of each joint angle [rad] and of each coordinate of the pelvis [m], frame by frame.
ANGLE_SD, PLACE_SD = 5e-4, 5e-4


def t4(person: HumanModel, seed: int, kind: str, rate_hz: float, cadence: Cadence | None = None):
    """A walk between two rests, differentiated from noisy positions, and the truth."""
    rng = np.random.default_rng(seed)
    walk = simulate_walking(
        person,
        operator(kind, rng, person),
        rng,
        route=(Stance(), Stance(x=3.0)),
        rate_hz=rate_hz,
        cadence=cadence,
    )
    extra, count = round(STILL_S * rate_hz), len(walk.motion)
    index = np.r_[np.zeros(extra, int), np.arange(count), np.full(extra, count - 1)]
    q = walk.motion.q[index].copy()
    q[:, 7:] += rng.normal(scale=ANGLE_SD, size=q[:, 7:].shape)
    q[:, :3] += rng.normal(scale=PLACE_SD, size=(len(q), 3))
    motion = motion_from_configurations(person.dof_names, np.arange(len(q)) / rate_hz, q)
    rest = np.stack([walk.truth.contact_right, walk.truth.contact_left], axis=-1)
    return motion, rest[index]


def worst_switch_s(found, truth, time_s):
    """Longest time from a true switch to the nearest one found, and how many there are too many."""
    worst, others = 0.0, 0
    for foot in range(2):
        true, seen = (np.diff(x[:, foot].astype(int)) for x in (truth, found))
        for at in np.flatnonzero(true):
            same = np.flatnonzero(seen == true[at])
            worst = max(worst, np.abs(time_s[same] - time_s[at]).min())
        others += np.count_nonzero(seen) - np.count_nonzero(true)
    return worst, others


@pytest.mark.parametrize(
    ("kind", "rate_hz", "cadence"),
    [
        ("average", 50.0, None),
        ("stooper", 100.0, None),
        ("twister", 240.0, None),
        ("average", 60.0, Cadence(step_s=0.9, double_s=0.2)),
        ("stooper", 120.0, Cadence(step_m=0.25, clearance_m=0.05)),
    ],
    ids=["50 Hz", "100 Hz", "240 Hz", "slow", "short steps"],
)
def test_positions_alone_tell_rest_within_sixty_milliseconds(person, kind, rate_hz, cadence):
    motion, rest = t4(person, 7, kind, rate_hz, cadence)
    found = contacts_of_motion(person, motion).feet
    assert np.mean(np.all(found == rest, axis=1)) >= 0.98
    worst, others = worst_switch_s(found, rest, motion.time_s)
    assert worst <= 0.06
    assert others == 0


def rolling_steps(time_s, speed=1.0, lift_m=0.05):
    """Tracks of feet that roll: heel up first, toes last; heel down first. Truth is made up here.

    Both points follow their own minimum-jerk steps, the toes' a tenth of a second of the slowed
    clock later.
    """
    clock = time_s * speed
    track = np.zeros((len(time_s), 2, 2, 3))
    for side in range(2):
        for point in range(2):
            phase = clock - 0.6 * side - 0.1 * point
            step, part = np.floor(phase / 1.2), np.clip((phase % 1.2) / 0.5, 0.0, 1.0)
            along = part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
            track[:, side, point, 0] = step + along + 0.2 * point
            track[:, side, point, 1] = 0.1 - 0.2 * side
            track[:, side, point, 2] = lift_m * np.sin(np.pi * part) ** 2
    return track


def test_load_keeps_its_phase_however_slowly_one_walks():
    """A walk slowed by three is told down at the same phases: thresholds go with the swing."""
    quick = np.arange(480) / 100.0
    slow = 3.0 * quick
    at_once = contacts_of_tracks(quick, rolling_steps(quick), meaning="load").feet
    slowed = contacts_of_tracks(slow, rolling_steps(slow, speed=1.0 / 3.0), meaning="load").feet
    assert 0.2 < np.mean(~at_once) < 0.5
    assert np.mean(at_once == slowed) > 0.96


def test_a_rolling_foot_is_down_from_its_heel_to_its_toes():
    time = np.arange(0.0, 4.8, 0.01)
    feet = contacts_of_tracks(time, rolling_steps(time)).feet
    # The right heel lifts at 1.2 s and lands at 1.7 s, the toes 0.1 s later: up in between.
    lift = time[np.flatnonzero(np.diff(feet[:, 0].astype(int)) < 0)]
    land = time[np.flatnonzero(np.diff(feet[:, 0].astype(int)) > 0)]
    np.testing.assert_allclose(lift[np.argmin(np.abs(lift - 1.3))], 1.3, atol=0.02)
    np.testing.assert_allclose(land[np.argmin(np.abs(land - 1.7))], 1.7, atol=0.03)


def test_where_the_scene_lies_and_how_the_belt_runs_does_not_matter(person, walk):
    motion = walk.motion
    q = motion.q.copy()
    q[:, 2] += 1.3
    q[:, 0] -= 1.1 * (motion.time_s - motion.time_s[0])
    on_belt = motion_from_configurations(person.dof_names, motion.time_s, q)
    there = contacts_of_motion(person, on_belt, belt_velocity=(-1.1, 0.0, 0.0))
    here = contacts_of_motion(person, motion)
    assert np.mean(there.feet == here.feet) > 0.998
    np.testing.assert_allclose(here.floor_m, 0.0, atol=1e-3)
    np.testing.assert_allclose(there.floor_m, 1.3, atol=1e-3)
    assert np.mean(contacts_of_motion(person, on_belt).feet == here.feet) < 0.9


def test_standing_and_nothing_else_is_down_throughout():
    rng = np.random.default_rng(1)
    track = np.array([[[0.0, -0.1, 0.0], [0.2, -0.1, 0.0]], [[0.0, 0.1, 0.0], [0.2, 0.1, 0.0]]])
    still = track + rng.normal(scale=1e-3, size=(300, 2, 2, 3))
    assert np.all(contacts_of_tracks(np.arange(300) / 100.0, still).feet)
    one = contacts_of_tracks([0.0], track[None])
    assert np.all(one.feet)


@pytest.mark.parametrize(
    ("shape", "bad", "words"),
    [((5, 2, 3), False, "position: expected shape"), ((5, 2, 2, 3), True, "at frame 3")],
)
def test_tracks_that_do_not_fit_are_refused(shape, bad, words):
    track = np.zeros(shape)
    if bad:
        track[3, 0, 0, 0] = np.nan
    with pytest.raises(MeasurementError, match=words):
        contacts_of_tracks(np.arange(5.0), track)
