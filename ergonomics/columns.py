"""Checking and chunking of the array inputs of the vectorised scorers."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import PostureError

#: Postures handled at a time: the working set of one chunk stays in the second-level cache.
CHUNK = 16_384


@dataclass(frozen=True, slots=True)
class Column:
    """What a field of the inputs may hold: an ``angle``, a ``flag`` or whole ``points``."""

    kind: str
    high: int = 0

    def checked(self, name: str, value: ArrayLike) -> NDArray[Any]:
        """Returns the field as a read-only array of its own type.

        Raises:
            PostureError: If a value is not finite, not a truth value, or out of range.
        """
        array = np.asarray(value)
        if self.kind == "angle":
            if array.dtype.kind not in "fiu":
                raise PostureError(name, f"expected angles in degrees, got type {array.dtype}")
            array = array.astype(np.float64, copy=False)
            _refuse(name, ~np.isfinite(array), array, "expected a finite angle in degrees")
        elif self.kind == "flag":
            if array.dtype != np.bool_:
                raise PostureError(name, f"expected true or false, got type {array.dtype}")
        else:
            if array.dtype.kind not in "iu":
                raise PostureError(name, f"expected whole points, got type {array.dtype}")
            bad = (array < 0) | (array > self.high)
            _refuse(name, bad, array, f"expected points from 0 to {self.high}")
            array = array.astype(np.uint8)
        view = array.view()
        view.setflags(write=False)
        return view


def _refuse(name: str, bad: NDArray[np.bool_], array: NDArray[Any], expected: str) -> None:
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        raise PostureError(name, f"{expected}, got {array[index]}", index)


ANGLE = Column("angle")
FLAG = Column("flag")


def points(high: int) -> Column:
    """Returns a column of whole points from 0 to ``high``."""
    return Column("points", high)


def common_shape(arrays: Mapping[str, NDArray[Any]]) -> tuple[int, ...]:
    """Returns the shape that all fields broadcast to.

    Raises:
        PostureError: If they do not broadcast together.
    """
    try:
        return np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = {array.shape: name for name, array in arrays.items() if array.ndim}
        listed = ", ".join(f"{name} {shape}" for shape, name in shapes.items())
        raise PostureError("inputs", f"shapes do not broadcast together: {listed}") from None


def entry(array: NDArray[Any], index: tuple[int, ...]) -> Any:
    """Returns the value that an array has at an index of the batch it broadcasts to."""
    aligned = index[len(index) - array.ndim :]
    sizes = zip(aligned, array.shape, strict=True)
    return array[tuple(0 if size == 1 else i for i, size in sizes)].item()


def chunks(
    arrays: Mapping[str, NDArray[Any]], shape: tuple[int, ...], size: int = CHUNK
) -> Iterator[tuple[slice, dict[str, NDArray[Any]]]]:
    """Yields runs of postures as flat arrays; a field of one value stays one value.

    Args:
        arrays: Fields that broadcast to ``shape``.
        shape: Shape of the batch.
        size: Most postures per run.

    Yields:
        The slice of the flattened batch, and each field's ``(run,)`` or ``(1,)`` values.
    """
    flat = {
        name: array.reshape(1) if array.size == 1 else np.broadcast_to(array, shape).reshape(-1)
        for name, array in arrays.items()
    }
    total = int(np.prod(shape, dtype=np.int64))
    for start in range(0, total, size):
        run = slice(start, min(start + size, total))
        yield run, {name: a if a.size == 1 else a[run] for name, a in flat.items()}
