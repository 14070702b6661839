"""Turns frozen records and arrays into what JSON can hold."""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """Returns dicts, lists, numbers and text only; a number that is not finite becomes None."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        items = sorted(value) if isinstance(value, set | frozenset) else value
        return [plain(item) for item in items]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def rounded(array: Any, digits: int = 6) -> Any:
    """Returns an array as nested lists, rounded: answers need no more, and stay the same bytes."""
    # Adding zero turns a negative zero into zero, so that equal numbers are equal bytes.
    return (np.round(np.asarray(array, dtype=float), digits) + 0.0).tolist()
