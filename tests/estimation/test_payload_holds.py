import numpy as np
import pytest

from estimation import HandState
from estimation.run.payload_holds import HoldCollector, HoldFrames
from estimation.run.run_words import hold_in_words

DT = 0.01


def frames_of(force, pull, state=None, covariance=None, deviation=None, parts_known=True):
    count = len(force)
    state = np.full(count, int(HandState.LOADED)) if state is None else state
    covariance = np.tile(2.0 * np.eye(3), (count, 1, 1)) if covariance is None else covariance
    deviation = np.zeros((0, count, 3)) if deviation is None else deviation
    return HoldFrames(
        time_s=DT * np.arange(count),
        state=state,
        force=force,
        covariance=covariance,
        pull=pull,
        deviation=deviation,
        parts=force[:, None, :],
        parts_known=np.full(count, parts_known),
    )


def cut(frames, part):
    return HoldFrames(
        frames.time_s[part],
        frames.state[part],
        frames.force[part],
        frames.covariance[part],
        frames.pull[part],
        frames.deviation[:, part],
        frames.parts[part],
        frames.parts_known[part],
    )


def moved(rng, count):
    """Proper accelerations of a hand that swings a load."""
    t = DT * np.arange(count)
    phase = rng.uniform(0, 6, 3)
    return np.array([0.0, 0.0, 9.81]) + 3.0 * np.sin(5.0 * t[:, None] + phase)


def holds(frames, widening=1.0):
    collector = HoldCollector(("right",), 1.0, widening)
    return [*collector.take(frames), *collector.close()]


def test_least_squares_are_those_of_all_frames_at_once():
    rng = np.random.default_rng(0)
    pull = moved(rng, 500)
    half = rng.normal(size=(500, 3, 3))
    covariance = half @ half.swapaxes(1, 2) + np.eye(3)
    force = -4.0 * pull + np.einsum(
        "nij,nj->ni", np.linalg.cholesky(covariance), rng.normal(size=(500, 3))
    )
    frames = frames_of(force, pull, covariance=covariance)
    (hold,) = holds(frames)
    rows = slice(40, 460)  # but for the edges
    white = np.linalg.cholesky(np.linalg.inv(covariance[rows])).swapaxes(1, 2)
    A = np.einsum("nij,nj->ni", white, -pull[rows]).ravel()
    y = np.einsum("nij,nj->ni", white, force[rows]).ravel()
    assert hold.frames == 420
    assert hold.mass().mass_kg == pytest.approx(A @ y / (A @ A), abs=1e-9)
    assert hold.split_kg == pytest.approx((4.0,), abs=0.1)


@pytest.mark.parametrize("memory", [0.0, 0.95])
def test_the_band_of_a_hold_covers_also_where_errors_hang_together(memory):
    rng = np.random.default_rng(1)
    inside, sds, found = [], [], []
    for _ in range(150):
        pull = moved(rng, 1000)
        error = rng.normal(size=(1000, 3)) * np.sqrt(2.0)
        for row in range(1, 1000):
            error[row] = memory * error[row - 1] + np.sqrt(1 - memory**2) * error[row]
        (hold,) = holds(frames_of(-5.0 * pull + error, pull))
        mass = hold.mass()
        inside.append(abs(mass.mass_kg - 5.0) < 1.96 * mass.sd_kg)
        sds.append(mass.sd_kg)
        found.append(mass.mass_kg)
    assert 0.9 < np.mean(inside) <= 0.99
    assert np.median(sds) == pytest.approx(np.std(found), rel=0.35)


def test_no_averaging_takes_errors_of_the_model_away():
    pull = np.tile([0.0, 0.0, 9.81], (800, 1))
    kilograms = np.array([0.5, -1.0, 2.0])
    deviation = -9.81 * np.array([0.0, 0.0, 1.0]) * kilograms[:, None, None] * np.ones((3, 800, 3))
    (hold,) = holds(frames_of(-5.0 * pull, pull, deviation=deviation), widening=1.5)
    expected = 1.5 * np.sqrt(np.mean(kilograms**2))
    for definition in ("inertial", "vertical", "norm"):
        assert hold.mass(definition).sd_kg == pytest.approx(expected, rel=1e-3)
        assert hold.mass(definition).mass_kg == pytest.approx(5.0)


def test_three_definitions_differ_where_they_should():
    rng = np.random.default_rng(2)
    pull = np.tile([2.0, 0.0, 9.81 + 1.0], (500, 1))
    (hold,) = holds(frames_of(-3.0 * pull + rng.normal(size=(500, 3)), pull))
    assert hold.mass("inertial").mass_kg == pytest.approx(3.0, abs=0.02)
    assert hold.mass("vertical").mass_kg == pytest.approx(3.0 * 10.81 / 9.81, abs=0.02)
    assert hold.mass("norm").mass_kg == pytest.approx(3.0 * np.hypot(2.0, 10.81) / 9.81, abs=0.02)


@pytest.mark.parametrize("portions", [2, 7, 60])
def test_holds_are_cut_by_state_whatever_the_portions(portions):
    rng = np.random.default_rng(3)
    pull = moved(rng, 1200)
    mass = np.zeros((1200, 1))
    mass[400:800] = 6.0
    state = np.where(mass[:, 0] > 0.0, HandState.LOADED, HandState.FREE).astype(np.intp)
    state[1000:] = HandState.UNKNOWN
    frames = frames_of(-mass * pull + rng.normal(size=(1200, 3)), pull, state)
    whole = holds(frames)
    assert [hold.state for hold in whole] == [HandState.FREE, HandState.LOADED, HandState.FREE]
    assert whole[1].mass().mass_kg == pytest.approx(6.0, abs=0.02)
    collector, parts = HoldCollector(("right",), 1.0), []
    for part in np.array_split(np.arange(1200), portions):
        parts.extend(collector.take(cut(frames, part)))
    parts.extend(collector.close())
    for ours, theirs in zip(parts, whole, strict=True):
        assert (ours.start_s, ours.end_s, ours.frames) == (
            theirs.start_s,
            theirs.end_s,
            theirs.frames,
        )
        assert ours.mass().mass_kg == pytest.approx(theirs.mass().mass_kg, abs=1e-12)
        assert ours.mass("norm").sd_kg == pytest.approx(theirs.mass("norm").sd_kg, abs=1e-12)


def test_short_stretches_are_no_holds_and_an_untold_split_is_none():
    pull = np.tile([0.0, 0.0, 9.81], (90, 1))
    assert holds(frames_of(-pull, pull)) == []
    pull = np.tile([0.0, 0.0, 9.81], (300, 1))
    (hold,) = holds(frames_of(-pull, pull, parts_known=False))
    assert hold.split_kg is None


def test_a_hold_too_short_to_tell_its_errors_apart_takes_them_for_one():
    pull = np.tile([0.0, 0.0, 9.81], (130, 1))
    covariance = np.tile(100.0 * np.eye(3), (130, 1, 1))
    (hold,) = holds(frames_of(-pull, pull, covariance=covariance))
    for definition in ("inertial", "vertical"):
        assert hold.mass(definition).sd_kg == pytest.approx(10.0 / 9.81, rel=1e-6)
    assert hold.mass("norm").sd_kg == pytest.approx(10.0 / 9.81, rel=1e-6)


def test_hands_that_would_pull_upwards_are_said():
    pull = np.tile([0.0, 0.0, 9.81], (400, 1))
    (hold,) = holds(frames_of(5.0 * pull, pull))
    assert "-5.0 kg, less than nothing" in hold_in_words(hold)
    for true in (0.0, 5.0):
        (hold,) = holds(frames_of(-true * pull, pull))
        assert not hold_in_words(hold)
