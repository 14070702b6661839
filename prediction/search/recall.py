"""Remembers what the costly steps of a search came to, so that a broken-off one is replayed."""

import time
from collections.abc import Callable, MutableMapping

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load as load_tensors
from safetensors.numpy import save as save_tensors

Array = NDArray[np.float64]

#: Answers a costly question ``(k,)``: by asking, or from what was kept.
Remember = Callable[[Callable[[], Array]], Array]

#: Work that may be lost, s: results are written at most this often.
_PERIOD_S = 2.0


class Recall:
    """Answers the first calls from what was kept, the others by computing, and keeps those.

    A search whose randomness is a seeded generator asks for the same things in the same order
    each time, so its state is the list of answers it got: nothing of the optimiser is written.

    Args:
        kept: Where to.
        key: Under which name.
    """

    def __init__(self, kept: MutableMapping[str, bytes], key: str) -> None:
        """Reads what was kept; what is damaged counts as not kept."""
        self._kept = kept
        self._key = key
        self._answers = _read(kept[key]) if key in kept else []
        self._asked = 0
        self._written_s = time.monotonic()

    def __call__(self, compute: Callable[[], Array]) -> Array:
        """Returns the next answer, ``(k,)``."""
        if self._asked == len(self._answers):
            self._answers.append(np.array(compute(), dtype=np.float64))
            if time.monotonic() - self._written_s > _PERIOD_S:
                self._write()
        self._asked += 1
        return self._answers[self._asked - 1]

    def forget(self) -> None:
        """Removes what was kept, once the search is done and its result kept."""
        self._kept.pop(self._key, None)

    def _write(self) -> None:
        sizes = np.array([len(answer) for answer in self._answers], dtype=np.int64)
        values = np.concatenate(self._answers)
        self._kept[self._key] = bytes(save_tensors({"sizes": sizes, "values": values}))
        self._written_s = time.monotonic()


def ask(compute: Callable[[], Array]) -> Array:
    """Asks: what there is where nothing is kept."""
    return compute()


def _read(content: bytes) -> list[Array]:
    try:
        tensors = load_tensors(content)
        sizes, values = tensors["sizes"], tensors["values"]
        if sizes.ndim != 1 or values.shape != (int(sizes.sum()),):
            raise ValueError("sizes and values do not fit together")
    except (SafetensorError, ValueError, KeyError):
        return []  # damaged: all is asked again
    return np.split(values, np.cumsum(sizes)[:-1])
