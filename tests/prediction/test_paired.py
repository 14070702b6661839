"""Methods paired split by split: no test sample is trained on, ratios are those of the scores."""

import numpy as np
import pytest
from planar import PlanarChain, planar_demonstrations

from prediction import DemonstrationError, TrainingOptions
from prediction.comparison.paired import compare_on_splits, paired_table
from prediction.comparison.splits import splits_of
from prediction.errors import PredictionError


@pytest.fixture(scope="module")
def takes():
    return [(f"take {seed}", planar_demonstrations(seed=seed)[1]) for seed in (3, 4)]


def test_splits_hold_out_parts_and_whole_recordings(takes):
    splits = splits_of(takes)
    assert [s.design for s in splits] == ["part"] * 4 + ["recording"] * 2
    total = sum(len(take) for _, take in takes)
    for split in splits:
        assert len(split.train) + len(split.test) == total
        seen = {tuple(row) for row in split.train.q}
        assert not any(tuple(row) in seen for row in split.test.q)
    assert [s.name for s in splits[4:]] == ["take 3", "take 4"]
    np.testing.assert_array_equal(splits[4].test.q, takes[0][1].q)
    assert len(splits_of(takes[:1])) == 4


def test_table_is_that_of_the_scores(takes):
    splits = splits_of(takes)[:3]
    told = []
    results = compare_on_splits(
        PlanarChain(),
        splits,
        ["locov-ik"],
        seed=1,
        options=TrainingOptions(blocks=2),
        also={"another way": TrainingOptions(method="w-ik", blocks=2, optimizer="gradient")},
        task="position",
        samples=8,
        progress=lambda what, done, _: told.append((what, done)),
    )
    rows = {row.method: row for row in paired_table(results, "part")}
    assert set(rows) == {"locov-ik", "cov-ik", "minimum-norm", "another way"}
    assert rows["another way"].rmse_ratio not in {rows["cov-ik"].rmse_ratio, 1.0}
    assert rows["cov-ik"].nats_more == 0.0
    assert set(rows["cov-ik"].rollout_ratio.values()) == {1.0}
    ours = [r.scores["locov-ik"].rollout_rmse_deg_at["1"] for r in results]
    cov = [r.scores["cov-ik"].rollout_rmse_deg_at["1"] for r in results]
    assert rows["locov-ik"].rollout_ratio["1"] == pytest.approx(
        np.prod(np.divide(ours, cov)) ** (1.0 / 3.0)
    )
    assert rows["locov-ik"].rollout_wins["1"] == (int(np.sum(np.less(ours, cov))), 3)
    # Student's t with two degrees of freedom: 4.3027 at .975.
    logs = np.log(np.divide(ours, cov))
    half = 4.3027 * logs.std(ddof=1) / np.sqrt(3.0)
    assert rows["locov-ik"].rollout_interval["1"] == pytest.approx(
        tuple(np.exp([logs.mean() - half, logs.mean() + half])), rel=1e-4
    )
    shares = [done for _, done in told]
    assert shares == sorted(shares) and told[0][0].startswith("part 1 of 4, locov-ik")


def test_a_split_that_cannot_be_trained_on_is_named_and_the_rest_scored(takes):
    good = splits_of(takes[:1])[0]
    bad = splits_of([("few", takes[0][1].take(slice(0, 12)))])[0]
    results = compare_on_splits(
        PlanarChain(), [bad, good], ["cov-ik"], seed=1, task="position", samples=4
    )
    assert "samples" in results[0].problem and not results[0].scores
    assert results[1].problem is None and "cov-ik" in results[1].scores
    assert paired_table(results, "part")[0].splits == 1
    with pytest.raises(PredictionError, match="no split was scored"):
        paired_table(results, "recording")


def test_nothing_to_compare_is_refused():
    with pytest.raises(DemonstrationError):
        splits_of([])
