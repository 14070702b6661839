import numpy as np
import pytest

from ergonomics import method_data

_SHAPES = {
    ("rula", "A"): (6, 3, 4, 2),
    ("rula", "B"): (6, 6, 2),
    ("rula", "C"): (8, 7),
    ("reba", "A"): (3, 5, 4),
    ("reba", "B"): (6, 2, 3),
    ("reba", "C"): (12, 12),
}
_TABLES = pytest.mark.parametrize(("method", "table"), list(_SHAPES))


@_TABLES
def test_table_never_falls_along_an_axis(method, table):
    values = method_data(method).tables[table].astype(int)
    assert values.shape == _SHAPES[method, table]
    for axis in range(values.ndim):
        assert (np.diff(values, axis=axis) >= 0).all(), f"axis {axis}"


@_TABLES
def test_table_starts_at_one_and_cannot_be_written(method, table):
    values = method_data(method).tables[table]
    assert values.min() == values.reshape(-1)[0] == 1
    with pytest.raises(ValueError, match="read-only"):
        values[0] = 1


# Cells on which published transcriptions differ, read off the score sheets.
@pytest.mark.parametrize(
    ("method", "table", "cell", "score"),
    [
        ("rula", "A", (2, 2, 1, 1), 3),
        ("rula", "A", (6, 3, 4, 2), 9),
        ("rula", "B", (4, 2, 2), 6),
        ("rula", "B", (6, 6, 2), 9),
        ("rula", "C", (8, 3), 6),
        ("reba", "A", (1, 4, 4), 7),
        ("reba", "A", (1, 5, 4), 8),
        ("reba", "B", (6, 2, 3), 9),
        ("reba", "C", (6, 1), 6),
        ("reba", "C", (1, 6), 3),
        ("reba", "C", (6, 9), 10),
    ],
)
def test_disputed_cells(method, table, cell, score):
    assert method_data(method).look_up(table, *cell) == score


@pytest.mark.parametrize("method", ["rula", "reba"])
def test_action_levels_cover_every_final_score_in_order(method):
    data = method_data(method)
    levels = [data.action(score).level for score in data.final_scores]
    assert levels == sorted(levels)
    assert set(levels) == {level.level for level in data.action_levels}
    assert data.tables["C"].max() <= data.final_high


def test_part_ranges_match_the_axes_of_their_tables():
    for method in ("rula", "reba"):
        data = method_data(method)
        for name in ("A", "B"):
            highest = [data.parts[axis].high for axis in data.axes[name]]
            assert highest == list(data.tables[name].shape)
