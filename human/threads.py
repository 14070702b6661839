"""Linear algebra on one thread, so that results depend neither on cores nor on their load.

A matrix product split over threads sums in another order, and the same seed would give other bytes
on another machine. Threads that wait for each other on a busy machine also cost several times what
they gain on matrices of the sizes met here.
"""

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

P = ParamSpec("P")
R = TypeVar("R")


def single_threaded(function: Callable[P, R]) -> Callable[P, R]:
    """Returns the function, its matrix products on one thread while it runs."""
    wrapped: Callable[P, R] = threadpool_limits.wrap(limits=1, user_api="blas")(function)
    return wrapped
