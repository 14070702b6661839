"""RULA and REBA as data: bands, modifiers and tables, read once from the package's own JSON."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .bands import BandScale

Method = Literal["rula", "reba"]


@dataclass(frozen=True, slots=True)
class Part:
    """One scored part of the body.

    Attributes:
        low: Least score.
        high: Greatest score; modifiers are held inside the two.
        bands: Points by angle, or None for a part scored by a word.
        modifiers: Points by flag.
        values: Points by word.
    """

    low: int
    high: int
    bands: BandScale | None
    modifiers: Mapping[str, int]
    values: Mapping[str, int]

    def hold(self, score: int) -> int:
        """Returns the score held inside the range of the table's axis."""
        return min(max(score, self.low), self.high)


@dataclass(frozen=True, slots=True)
class ActionLevel:
    """What a final score asks for."""

    level: int
    up_to: int
    meaning: str


@dataclass(frozen=True, slots=True)
class MethodData:
    """One method: its parts, tables and action levels.

    Attributes:
        name: ``RULA`` or ``REBA``.
        parts: By name.
        tables: ``A``, ``B``, ``C`` as ``uint8`` arrays; axes count from score 1.
        axes: Names of the axes of each table.
        final_low: Least final score.
        final_high: Greatest final score.
        action_levels: In ascending order.
        other: The rest of the file: force, load, coupling, activity.
    """

    name: str
    parts: Mapping[str, Part]
    tables: Mapping[str, NDArray[np.uint8]]
    axes: Mapping[str, tuple[str, ...]]
    final_low: int
    final_high: int
    action_levels: tuple[ActionLevel, ...]
    other: Mapping[str, Any]

    @property
    def final_scores(self) -> tuple[int, ...]:
        """Every final score that exists, ascending."""
        return tuple(range(self.final_low, self.final_high + 1))

    def action(self, final: int) -> ActionLevel:
        """Returns the action level of a final score."""
        return next(level for level in self.action_levels if final <= level.up_to)

    def look_up(self, table: str, *scores: int) -> int:
        """Returns one cell; the scores count from 1."""
        return int(self.tables[table][tuple(score - 1 for score in scores)])


@cache
def method_data(method: Method) -> MethodData:
    """Returns the data of a method.

    Args:
        method: ``rula`` or ``reba``.

    Source: the file's own ``sources``: McAtamney & Corlett 1993, Hignett & McAtamney 2000, the
        printed worksheets; every table cell-checked against several independent transcriptions.
    """
    text = resources.files(__package__).joinpath("tables", f"{method}.json").read_text("utf-8")
    raw: dict[str, Any] = json.loads(text)
    tables = {}
    for name, table in raw["tables"].items():
        values = np.asarray(table["values"], dtype=np.uint8)
        values.setflags(write=False)
        tables[name] = values
    low, high = raw["final_range"]
    return MethodData(
        name=raw["method"],
        parts=MappingProxyType({name: _part(part) for name, part in raw["parts"].items()}),
        tables=MappingProxyType(tables),
        axes=MappingProxyType({k: tuple(table["axes"]) for k, table in raw["tables"].items()}),
        final_low=low,
        final_high=high,
        action_levels=tuple(
            ActionLevel(level["level"], level["to"], level["meaning"])
            for level in raw["action_levels"]
        ),
        other=MappingProxyType(
            {k: v for k, v in raw.items() if k not in {"parts", "tables", "action_levels"}}
        ),
    )


def _part(raw: Mapping[str, Any]) -> Part:
    low, high = raw["range"]
    bands = None
    if "edges" in raw:
        bands = BandScale(tuple(raw["edges"]), tuple(raw["scores"]))
    return Part(
        low=low,
        high=high,
        bands=bands,
        modifiers=MappingProxyType(dict(raw.get("modifiers", {}))),
        values=MappingProxyType(dict(raw.get("values", {}))),
    )
