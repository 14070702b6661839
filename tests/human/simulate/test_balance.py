import numpy as np
import pytest

from human.simulate import SimulationError, Stance
from human.simulate.balance import GRID_S, cart_on_table, grid_of, smoothed
from human.simulate.gait import Cadence, cadence_of, lay_footsteps, walk_duration_s
from human.simulate.legs import legs_of


def test_cart_on_table_gives_back_the_pressure_it_was_asked_for():
    t = np.arange(0.0, 6.0, GRID_S)
    wanted = np.stack((0.2 * np.tanh(3 * (t - 3)), 0.1 * np.exp(-((t - 3) ** 2))), axis=-1)
    mass = cart_on_table(wanted, 1.0)
    bend = (mass[2:] - 2 * mass[1:-1] + mass[:-2]) / GRID_S**2
    np.testing.assert_allclose(mass[1:-1] - bend / 9.81, wanted[1:-1], atol=1e-9)
    # The mass leads: it moves before its pressure does.
    assert np.argmax(mass[:, 0] > 0.0) == pytest.approx(np.argmax(wanted[:, 0] > 0.0), abs=2)
    assert mass[200, 0] > wanted[200, 0]


def test_smoothing_keeps_constants_and_has_finite_support():
    step = np.r_[np.zeros(100), np.ones(100)]
    out = smoothed(step, 0.2)
    np.testing.assert_array_equal(out[:88], 0.0)
    np.testing.assert_allclose(out[112:], 1.0)
    assert np.all(np.diff(out) >= 0.0)
    np.testing.assert_allclose(smoothed(np.full((50, 2), 3.0), 0.4), 3.0)


def test_feet_rest_between_swings_and_never_swing_together(person):
    legs = legs_of(person)
    falls = lay_footsteps(legs, [(0.5, [Stance(x=2.0)])], start=Stance(), begin_s=0.0)
    t = np.arange(0.0, falls.end_s, 0.005)
    moving = [np.linalg.norm(f.sample(t).twist, axis=1) > 0.0 for f in falls.feet]
    assert not np.any(moving[0] & moving[1])
    for foot, contact in zip(falls.feet, falls.contacts, strict=True):
        for start, end in contact:
            inside = t[(t >= start) & (t <= end)]
            at = foot.sample(inside)
            np.testing.assert_array_equal(np.ptp(at.position, axis=0), 0.0)
            np.testing.assert_array_equal(np.ptp(at.rotation, axis=0), 0.0)
    both = ~moving[0] & ~moving[1]
    lands = np.flatnonzero(np.diff(both.astype(int)) == 1)
    lifts = np.flatnonzero(np.diff(both.astype(int)) == -1)
    between = t[lifts[1:]] - t[lands[:-1]]
    np.testing.assert_allclose(between, 0.1, atol=0.011)


def test_a_walk_ends_where_it_was_to_with_both_feet_together(person):
    legs, goal = legs_of(person), Stance(1.3, 0.7, 2.0)
    cadence = cadence_of(legs)
    route = [Stance(1.0, 0.0, 0.5), goal]
    falls = lay_footsteps(legs, [(0.2, route)], start=Stance(), begin_s=0.0)
    for leg, foot in zip(legs, falls.feet, strict=True):
        last = foot.sample(falls.end_s)
        np.testing.assert_allclose(last.position[0], goal.ankle(leg), atol=1e-12)
        np.testing.assert_allclose(last.rotation[0], goal.rotation, atol=1e-12)
    took = walk_duration_s(Stance(), route, cadence)
    assert falls.end_s == pytest.approx(0.2 + took)


def test_a_walk_before_the_last_is_over_is_refused(person):
    walks = [(0.5, [Stance(x=1.0)]), (1.0, [Stance(x=2.0)])]
    with pytest.raises(SimulationError, match=r"begins at 1\.00 s, before"):
        lay_footsteps(legs_of(person), walks, start=Stance(), begin_s=0.0, cadence=Cadence())


def test_the_grid_covers_what_it_should():
    grid = grid_of(-0.5, 1.02)
    assert grid[0] == -0.5
    assert grid[-1] >= 1.02
    assert (grid.size - 1) % 5 == 0
