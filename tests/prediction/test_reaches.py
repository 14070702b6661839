"""Reaches: found where they were put, and never on both sides of a split."""

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from prediction import (
    DemonstrationError,
    Stretches,
    TrainingOptions,
    find_reaches,
    score_method,
    splits_by_primitive,
    splits_by_reach,
    train_operator,
)
from prediction.demonstrations import Demonstrations, join

RATE_HZ = 30.0
NAMES = ("x", "y", "z", "spare")


def led(*ways, rest_s=0.4, breath=0.02, rate_hz=RATE_HZ):
    """A hand led along straight minimum-jerk ways: (displacement in m, duration in s) each.

    The first three joints are the hand's coordinates, so J is the identity with a spare column;
    the hand trembles at ``breath`` m/s throughout.
    """
    velocity = [np.zeros((round(rest_s * rate_hz), 3))]
    truth, at = [], len(velocity[0])
    for displacement, duration in ways:
        s = (np.arange(round(duration * rate_hz)) + 0.5) / round(duration * rate_hz)
        bell = 30.0 * (s**2 - 2.0 * s**3 + s**4) / duration
        velocity += [bell[:, None] * np.asarray(displacement), velocity[0]]
        truth.append((at, at + len(s)))
        at += len(s) + len(velocity[0])
    xdot = np.concatenate(velocity)
    time_s = np.arange(len(xdot)) / rate_hz
    xdot = xdot + breath * np.sin(40.0 * time_s)[:, None] * [1.0, 0.0, 0.0]
    qdot = np.concatenate([xdot, np.cos(time_s)[:, None]], axis=1)
    jacobian = np.broadcast_to(np.eye(3, 4), (len(qdot), 3, 4)).copy()
    q = np.cumsum(qdot, axis=0) / rate_hz
    ids = np.zeros(len(q), dtype=np.int64)
    return Demonstrations(NAMES, q, qdot, jacobian, ids, time_s), truth


UP, DOWN, SIDE = (0.0, 0.1, 0.4), (0.0, -0.1, -0.4), (0.3, 0.0, 0.02)


@pytest.mark.parametrize("rest_s", [0.0, 0.4])
@pytest.mark.parametrize("slower", [1.0, 0.5])
def test_reaches_are_found_where_they_were_led(rest_s, slower):
    ways = [(UP, 1.0), (SIDE, 0.8), (DOWN, 1.5), (UP, 0.7)]
    ways = [(step, duration / slower) for step, duration in ways]
    demonstrations, truth = led(*ways, rest_s=rest_s)
    found = find_reaches(demonstrations)
    assert len(found) == 4
    # The ends of a bell are slower than rest.
    np.testing.assert_allclose(found.start, [a for a, _ in truth], atol=0.2 * RATE_HZ / slower)
    np.testing.assert_allclose(found.stop, [b for _, b in truth], atol=0.2 * RATE_HZ / slower)
    np.testing.assert_allclose(found.displacement, [step for step, _ in ways], atol=0.02)
    np.testing.assert_allclose(found.way_m, [np.linalg.norm(s) for s, _ in ways], atol=0.03)


def test_fidgeting_and_rest_are_no_reach():
    demonstrations, truth = led((UP, 1.0), ((0.05, 0.0, 0.0), 0.5), (DOWN, 1.0))
    assert len(find_reaches(demonstrations)) == 2
    still, _ = led(((0.01, 0.0, 0.0), 1.0))
    assert len(find_reaches(still)) == 0
    with pytest.raises(DemonstrationError, match="no reach"):
        splits_by_reach([("still", still)])
    # A dip that is not deep beside its peaks is within one purpose.
    waver, _ = led((UP, 1.0))
    middle = np.arange(len(waver)) - (truth[0][0] + 15)
    dipped = waver.qdot * (1.0 - 0.4 * np.exp(-0.5 * (middle / 2.0) ** 2))[:, None]
    again = Demonstrations(
        NAMES, waver.q, dipped, waver.jacobian, waver.trajectory_id, waver.time_s
    )
    assert len(find_reaches(again)) == 1


def test_no_reach_goes_across_a_hole_or_into_another_take():
    demonstrations, truth = led((UP, 1.2))
    middle = sum(truth[0]) // 2
    holed = demonstrations.take(np.abs(np.arange(len(demonstrations)) - middle) > 3)
    for broken in (holed, join([demonstrations.take(slice(0, middle)), demonstrations])):
        found = find_reaches(broken)
        assert len(found) >= 2
        runs = broken.runs()
        for start, stop in zip(found.start, found.stop, strict=True):
            assert any(start in run and stop - 1 in run for run in runs)


def test_two_hands_reach_as_the_object_between_them_and_feet_that_are_held_do_not():
    one, _ = led((UP, 1.0), (SIDE, 0.8), (DOWN, 1.2))
    # A held foot, then two hands that turn against each other about their middle.
    apart = np.zeros((len(one), 3, 4))
    apart[:, 0, 3] = 0.5
    hands = [one.jacobian + apart, one.jacobian - apart]
    jacobian = np.concatenate([np.zeros((len(one), 3, 4)), *hands], axis=1)
    names = tuple(f"j{k}" for k in range(10))
    wide = np.zeros((len(one), 9, 10))
    wide[..., :4] = jacobian
    q, qdot = (np.pad(a, ((0, 0), (0, 6))) for a in (one.q, one.qdot))
    both = Demonstrations(names, q, qdot, wide, one.trajectory_id, one.time_s, 9, held_tips=1)
    alone, together = find_reaches(one), find_reaches(both)
    np.testing.assert_array_equal(together.start, alone.start)
    np.testing.assert_allclose(together.displacement, alone.displacement)


def rows(demonstrations):
    return {tuple(row) for row in np.column_stack([demonstrations.q, demonstrations.time_s])}


def test_a_held_out_reach_and_its_neighbours_are_not_trained_on():
    demonstrations, truth = led(*[(UP, 1.0), (DOWN, 0.9)] * 4)
    found = find_reaches(demonstrations)
    train, test = found.holding_out([3], neighbours=1)
    seen, asked = rows(train), rows(test)
    for number, (a, b) in enumerate(truth):
        inside = rows(demonstrations.take(slice(a + 5, b - 5)))
        assert (inside <= seen) == (abs(number - 3) > 1)
        assert (inside <= asked) == (number == 3)
    # With none left out, training comes as near as half the rest between, and no nearer.
    near, _ = found.holding_out([3])
    gap = test.time_s[0] - near.time_s[near.time_s < test.time_s[0]].max()
    assert 0.1 < gap < 0.4


def test_designs_by_reach_share_no_sample_and_ask_what_they_say():
    ways = [(UP, 1.0), (DOWN, 0.9)] * 4
    takes = [("one", led(*ways)[0]), ("two", led(*ways[:6], rest_s=0.3, breath=0.03)[0])]
    splits = splits_by_reach(takes, 4)
    counts = {d: sum(s.design == d for s in splits) for d in ("block", "interleaved", "direction")}
    # The shorter take has three reaches of a kind: too few to be asked about by direction.
    assert counts == {"block": 8, "interleaved": 8, "direction": 2}
    assert [s.name for s in splits if s.design == "recording"] == ["one", "two"]
    for split in splits:
        assert not rows(split.train) & rows(split.test)
    upwards = next(s for s in splits if "upwards" in s.name)
    rising = upwards.test.xdot[:, 2]
    assert rising.sum() / RATE_HZ == pytest.approx(4 * 0.4, abs=0.05)
    # Every reach is asked about once in a design.
    asked = sum(len(s.test) for s in splits if s.design == "interleaved" and "one" in s.name)
    assert asked == sum(find_reaches(takes[0][1]).stop - find_reaches(takes[0][1]).start)


def test_primitives_are_held_out_in_parts_and_whole():
    chain, whole = PlanarChain(), planar_demonstrations(seed=3)[1]
    assert len(chain.dof_names) == len(whole.joint_names)
    pieces = [whole.take(slice(k * 60, (k + 1) * 60)) for k in range(5)]
    primitives = {
        "reach": [(str(k), p) for k, p in enumerate(pieces[:4])],
        "turn": [("4", pieces[4])],
    }
    splits = splits_by_primitive(primitives)
    same = [s for s in splits if s.design == "same"]
    assert [s.name for s in same][:2] == ["reach, part 1 of 4", "reach, part 2 of 4"]
    # Four takes are four parts; a single take is cut in time.
    assert rows(same[0].test) == rows(pieces[0])
    assert rows(same[4].test) == rows(pieces[4].take(slice(0, 15)))
    for split in same:
        assert not rows(split.train) & rows(split.test)
    assert rows(same[0].train) == set().union(*map(rows, pieces[1:4]))
    other = {s.name: s for s in splits if s.design == "other"}
    assert rows(other["turn"].train) == set().union(*map(rows, pieces[:4]))
    assert rows(other["reach"].train) == rows(other["turn"].test) == rows(pieces[4])
    with pytest.raises(DemonstrationError, match="at least two"):
        splits_by_primitive({"reach": primitives["reach"]})


def test_runs_of_any_length_are_rolled_out_on_and_asked_only_what_they_reach():
    whole = planar_demonstrations(seed=3)[1]
    rate = 1.0 / np.median(np.diff(whole.time_s))
    sizes = [round(seconds * rate) for seconds in (3.2, 0.8, 0.1)]
    starts = np.cumsum([0, *sizes])[:-1] + np.arange(3) * round(rate)
    take = whole.trajectory_id == whole.trajectory_id[0]
    assert take.sum() > starts[-1] + sizes[-1]
    kept = np.concatenate([np.arange(a, a + n) for a, n in zip(starts, sizes, strict=True)])
    broken = whole.take(kept)
    assert [len(run) for run in broken.runs()] == sizes
    stretches = Stretches.by_length(broken)
    # Two of two seconds, half overlapping; the short run as it is; a tenth of a second is nothing.
    assert [len(one.index) for one in stretches] == [2, 1]
    times = [broken.time_s[one.index] for one in stretches]
    assert np.ptp(times[0], axis=1) == pytest.approx(2.0, abs=1.0 / rate)
    assert np.ptp(times[1], axis=1) == pytest.approx(0.8, abs=2.0 / rate)
    chain = PlanarChain()
    model = train_operator(
        chain,
        whole.take(slice(-200, None)),
        seed=1,
        options=TrainingOptions(method="cov-ik", tasks=("position",), blocks=2),
    )

    def score_of(held_out, of=None):
        rng = np.random.default_rng(0)
        return score_method(
            model, "cov-ik", held_out, rng, task="position", chain=chain, stretches=of, samples=4
        )

    score, alone = score_of(broken), score_of(broken.take(broken.runs()[1]))
    two = score_of(broken, stretches[0])
    assert set(score.rollout_rmse_deg_at) == {"0.25", "0.5", "1", "2"}
    assert set(alone.rollout_rmse_deg_at) == {"0.25", "0.5"}
    # All points of all pieces count alike: two long ones and a short one.
    at = [run.rollout_rmse_deg_at["0.5"] ** 2 for run in (two, alone)]
    assert score.rollout_rmse_deg_at["0.5"] ** 2 == pytest.approx((2.0 * at[0] + at[1]) / 3.0)
    assert score.rollout_rmse_deg_at["1"] == two.rollout_rmse_deg_at["1"]
