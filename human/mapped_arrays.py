"""Arrays that lie in a file and not in memory."""

import mmap
from typing import Any

import numpy as np
from numpy.typing import NDArray


def forget_pages(array: NDArray[Any]) -> None:
    """Lets the system take back the memory of what was read of a mapped array; it can be read on.

    Args:
        array: mapped from a file, or any view of such a one; others are left alone.
    """
    base: object = array
    while isinstance(base, np.ndarray):
        mapped = getattr(base, "_mmap", None)
        if mapped is not None and hasattr(mapped, "madvise"):
            mapped.madvise(mmap.MADV_DONTNEED)
            return
        base = base.base
