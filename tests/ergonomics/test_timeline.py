import numpy as np
import pytest

from ergonomics import PostureError, dose, summarise, time_mean, time_quantile, time_share


def test_mean_is_the_trapezoid_and_ignores_how_often_frames_come():
    time = np.array([0.0, 1.0, 1.1, 1.2, 3.0])
    values = 2.0 * time + 1.0
    assert time_mean(values, time) == pytest.approx(4.0)
    assert dose(values, time) == pytest.approx(12.0)
    both = np.stack([values, -values])
    np.testing.assert_allclose(time_mean(both, time), [4.0, -4.0])


def test_one_frame_stands_for_itself():
    assert time_mean([3.0], [7.0]) == 3.0
    assert dose([3.0], [7.0]) == 0.0
    assert summarise([5], [7.0]).p90 == 5.0


def test_quantile_weighs_by_time():
    time = np.array([0.0, 0.01, 0.02, 0.03, 10.0])
    values = np.array([7.0, 7.0, 7.0, 1.0, 1.0])
    assert time_quantile(values, time, 0.9) == 1.0
    even = np.arange(101.0)
    # Each frame but the two ends stands for one hundredth of the time.
    assert time_quantile(even, even, 0.5) == pytest.approx(50.0)
    assert time_quantile(np.stack([even, even[::-1]]), even, 0.9).tolist() == [90.0, 90.0]


def test_summary_of_a_score():
    time = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    scores = np.array([2, 5, 7, 3, 7])
    summary = summarise(scores, time)
    assert summary.max == 7
    assert summary.time_of_max_s == 2.0
    assert summary.time_at_or_above[5] == pytest.approx((1 + 1 + 0.5) / 4)
    assert summary.time_at_or_above[7] == pytest.approx((1 + 0.5) / 4)
    assert summary.longest_at_or_above_s == {3: 3.0, 5: 1.0, 7: 0.0}
    assert float(time_share(scores >= 3, time)) == pytest.approx(summary.time_at_or_above[3])


@pytest.mark.parametrize(
    ("values", "time", "message"),
    [
        ([1.0, 2.0], [0.0, 0.0], r"time_s at index \[1\].*increasing"),
        ([1.0, 2.0], [0.0, np.nan], "time_s.*finite"),
        ([1.0], [], "time_s.*frame"),
        ([1.0, 2.0, 3.0], [0.0, 1.0], "values.*2"),
        ([1.0, np.inf], [0.0, 1.0], r"values at index \[1\]"),
    ],
)
def test_what_does_not_fit_is_refused(values, time, message):
    with pytest.raises(PostureError, match=message):
        time_mean(values, time)
