"""Rows on disk are the rows in memory."""

import numpy as np
import pytest

from human.mapped_arrays import forget_pages
from human.readers.row_store import RowStore


@pytest.mark.parametrize("in_memory_bytes", [0, 400, 1 << 20])
def test_rows_come_back_as_they_went_in_wherever_they_are_kept(in_memory_bytes: int) -> None:
    rows = np.random.default_rng(1).normal(size=(50, 3))
    store = RowStore(3, in_memory_bytes)
    for start in range(0, 50, 8):
        store.append(rows[start : start + 8])
    store.change(lambda block: 2.0 * block[:, ::-1])
    np.testing.assert_array_equal(store.every(7), 2.0 * rows[::7, ::-1])
    found = store.array()
    assert isinstance(found, np.memmap) == (in_memory_bytes < rows.nbytes)
    np.testing.assert_array_equal(found, 2.0 * rows[:, ::-1])
    view = found.reshape(25, 6)[3:]
    forget_pages(view)
    np.testing.assert_array_equal(view.ravel(), 2.0 * rows[6:, ::-1].ravel())


def test_a_mapped_array_outlives_its_store() -> None:
    def made() -> np.ndarray:
        store = RowStore(2, 0)
        store.append(np.arange(10.0).reshape(5, 2))
        return store.array()

    np.testing.assert_array_equal(made().sum(axis=0), [20.0, 25.0])
