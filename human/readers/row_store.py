"""Rows of numbers as they are read; a long file's go to a temporary file instead of memory.

An hour of fifty markers at 100 Hz is half a gigabyte of positions, of which only a window is ever
worked on.
"""

from collections.abc import Callable, Iterator
from tempfile import TemporaryFile
from typing import IO

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Rows are kept in memory up to this size.
IN_MEMORY_BYTES = 64 << 20
_BLOCK_BYTES = 1 << 20


class RowStore:
    """Collects rows of one width, and gives them back as one array."""

    def __init__(self, width: int, in_memory_bytes: int = IN_MEMORY_BYTES) -> None:
        """Takes rows of ``width`` numbers, and at most ``in_memory_bytes`` of memory for them."""
        self._width = width
        self._limit = in_memory_bytes
        self._blocks: list[Array] = []
        self._file: IO[bytes] | None = None
        self.rows = 0

    def __del__(self) -> None:
        """Closes the file; arrays over it keep their own hold of it."""
        if self._file is not None:
            self._file.close()

    def append(self, block: Array) -> None:
        """Adds rows ``(n, width)``."""
        block = np.ascontiguousarray(block, dtype=np.float64)
        self.rows += len(block)
        if self._file is None and self.rows * self._width * 8 > self._limit:
            self._file = TemporaryFile()
            for kept in self._blocks:
                self._file.write(kept.tobytes())
            self._blocks = []
        if self._file is None:
            self._blocks.append(block)
        else:
            self._file.write(block.tobytes())

    def change(self, by: Callable[[Array], Array]) -> None:
        """Replaces the rows by what ``by`` makes of them, block by block."""
        if self._file is None:
            self._blocks = [by(block) for block in self._blocks]
            return
        for start, block in self._read():
            self._file.seek(start * self._width * 8)
            self._file.write(np.ascontiguousarray(by(block)).tobytes())

    def every(self, step: int) -> Array:
        """Returns every ``step``-th row, the first included.

        Rows picked from a mapped array would bring their neighbours into memory, too.
        """
        if self._file is None:
            return self.array()[::step]
        # Copies: a view would keep all of its block.
        picked = [block[-start % step :: step].copy() for start, block in self._read()]
        return np.concatenate(picked)

    def array(self) -> Array:
        """Returns all rows ``(rows, width)``: in memory, or mapped from the file, read-only."""
        if self._file is None:
            if not self._blocks:
                return np.zeros((0, self._width))
            return np.concatenate(self._blocks)
        self._file.flush()
        return np.memmap(self._file, dtype=np.float64, mode="r", shape=(self.rows, self._width))

    def _read(self) -> Iterator[tuple[int, Array]]:
        assert self._file is not None
        step = max(1, _BLOCK_BYTES // (8 * self._width))
        for start in range(0, self.rows, step):
            count = min(step, self.rows - start)
            self._file.seek(start * self._width * 8)
            content = self._file.read(count * self._width * 8)
            yield start, np.frombuffer(content, dtype=np.float64).reshape(count, self._width)
