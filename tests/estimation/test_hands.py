import numpy as np
import pytest

from estimation import HandState
from estimation.run.hands import HandTracker, states_by_hand

DT = 0.01


def follow(mass, sd=0.15, known=None, tracker=None):
    mass = np.asarray(mass, dtype=float)
    time_s = DT * np.arange(len(mass))
    known = np.ones(len(mass), dtype=bool) if known is None else known
    tracker = tracker or HandTracker(0.5)
    return tracker.take(time_s, mass, np.full(len(mass), sd), known)


def test_a_load_is_noticed_and_its_end_too():
    rng = np.random.default_rng(0)
    true = np.zeros(600)
    true[200:400] = 3.0
    states, chance = follow(true + 0.15 * rng.normal(size=600))
    changes = np.flatnonzero(np.diff(states)) + 1
    assert states[0] == HandState.FREE
    assert len(changes) == 2
    assert np.all(np.abs(changes - [200, 400]) * DT <= 0.15)
    assert np.all(chance[250:400] > 0.99)
    assert np.all(chance[450:] < 0.05)


def test_near_the_limit_the_state_does_not_flicker():
    rng = np.random.default_rng(1)
    states, chance = follow(0.55 + 0.15 * rng.normal(size=2000))
    assert np.count_nonzero(np.diff(states)) <= 2
    assert np.std(chance) > 0.05


def test_what_is_known_badly_is_believed_later():
    states, _ = follow(np.full(100, 1.0), sd=1.0)
    assert np.all(states == HandState.FREE)
    states, _ = follow(np.full(100, 1.0), sd=0.1)
    assert states[-1] == HandState.LOADED


def test_where_nothing_is_known_nothing_is_said_and_then_it_starts_afresh():
    known = np.ones(90, dtype=bool)
    known[30:60] = False
    states, chance = follow(np.full(90, 5.0), known=known)
    assert np.all(states[:30] == HandState.LOADED)
    assert np.all(states[30:60] == HandState.UNKNOWN)
    assert np.all(chance[30:60] == 0.5)
    assert states[60] == HandState.LOADED


@pytest.mark.parametrize("cut", [1, 37, 250])
def test_frames_may_come_in_any_portions(cut):
    mass = np.concatenate([np.zeros(200), np.full(200, 2.0)])
    time_s = DT * np.arange(400)
    sd, known = np.full(400, 0.15), np.ones(400, dtype=bool)
    whole = HandTracker(0.5).take(time_s, mass, sd, known)
    tracker = HandTracker(0.5)
    parts = [
        tracker.take(time_s[part], mass[part], sd[part], known[part])
        for part in (slice(0, cut), slice(cut, None))
    ]
    np.testing.assert_array_equal(np.concatenate([p[0] for p in parts]), whole[0])
    np.testing.assert_array_equal(np.concatenate([p[1] for p in parts]), whole[1])


def test_of_two_hands_a_load_shows_in_the_sum_alone():
    together = np.array([HandState.FREE, HandState.LOADED, HandState.LOADED, HandState.UNKNOWN])
    parts = np.array([[0.0, 0.0], [3.0, 2.0], [5.0, 0.1], [0.0, 0.0]])
    told = np.array([[False, False], [False, False], [True, True], [False, False]])
    found = states_by_hand(together, (True, True), parts, told, 0.5)
    assert found.tolist() == [[0, 0], [2, 2], [1, 0], [2, 2]]
    assert states_by_hand(together, (True, False), parts, told, 0.5)[:, 0].tolist() == [0, 1, 1, 2]
    assert not np.any(states_by_hand(together, (False, False), parts, told, 0.5))
