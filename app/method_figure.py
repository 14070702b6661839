"""The picture of a comparison of methods: error against horizon, split by split, coverage."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from prediction import PairedRow, SplitScores

REFERENCE = "cov-ik"
#: Horizons the splits are paired at, s; the first that every split of the design reaches.
_PAIRED_AT = ("1", "0.5", "0.25")
#: Okabe and Ito's colours, told apart with any colour vision; beyond eight, lines are dashed.
_COLOURS = (
    "#000000", "#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#999999",
)  # fmt: skip
_MARKERS = "osv^D"


def draw(
    tables: Mapping[str, Sequence[PairedRow]],
    titles: Mapping[str, str],
    groups: Mapping[str, Sequence[SplitScores]],
    path: Path,
) -> None:
    """Draws a column for each design.

    Args:
        tables: Rows by design.
        titles: Heading by design.
        groups: Scores of the splits, by whose they are; each group has its own marker.
        path: The picture to write.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.2 * len(tables), 11.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(3, len(tables), squeeze=False)
    names = dict.fromkeys(row.method for rows in tables.values() for row in rows)
    style = {name: _style(number) for number, name in enumerate(names)}
    for column, (design, rows) in enumerate(tables.items()):
        splits = {
            group: [one for one in scores if one.split[0] == design and one.scores]
            for group, scores in groups.items()
        }
        axes[0, column].set_title(fill(titles[design], 48), fontsize=10)
        _errors(axes[0, column], rows, style)
        _paired(axes[1, column], rows, splits, style)
        _coverage(axes[2, column], rows, style)
    figure.savefig(path, dpi=110)


def _style(number: int) -> dict[str, Any]:
    return {
        "color": _COLOURS[number % len(_COLOURS)],
        "ls": "-" if number < len(_COLOURS) else "--",
    }


def _errors(axis: Any, rows: Sequence[PairedRow], style: Mapping[str, dict[str, Any]]) -> None:
    for row in rows:
        seconds = [float(key) for key in row.rollout_rmse_deg]
        values = list(row.rollout_rmse_deg.values())
        axis.plot(seconds, values, marker="o", ms=4, label=row.method, **style[row.method])
    axis.set_xlabel("horizon [s]")
    axis.set_ylabel("joint error, RMS [deg]")
    axis.set_ylim(bottom=0.0)
    axis.grid(alpha=0.3)
    axis.legend(fontsize=8)


def _paired(
    axis: Any,
    rows: Sequence[PairedRow],
    splits: Mapping[str, Sequence[SplitScores]],
    style: Mapping[str, dict[str, Any]],
) -> None:
    """Draws each split's error over Cov-IK's, and the interval of their mean."""
    everyone = [one for some in splits.values() for one in some]
    horizon = paired_horizon(everyone)
    others = [row for row in rows if row.method != REFERENCE]
    for place, row in enumerate(others):
        colour = style[row.method]["color"]
        for number, some in enumerate(splits.values()):
            ratios = [_ratio(one, row.method, horizon) for one in some]
            there = [ratio for ratio in ratios if ratio is not None]
            beside = place - 0.2 + 0.4 * (np.arange(len(there)) + 0.5) / max(len(there), 1)
            marker = _MARKERS[number % len(_MARKERS)]
            axis.plot(beside, there, marker, ms=5, alpha=0.6, color=colour, mew=0)
        between = row.rollout_interval.get(horizon)
        if between is not None:
            axis.plot([place + 0.3] * 2, between, color=colour, lw=2)
        if horizon in row.rollout_ratio:
            axis.plot([place + 0.3], [row.rollout_ratio[horizon]], "_", ms=9, color=colour)
    if len(splits) > 1:
        for number, (group, some) in enumerate(splits.items()):
            if some:
                axis.plot([], [], _MARKERS[number % len(_MARKERS)], color="0.4", label=group)
        axis.legend(fontsize=8)
    axis.axhline(1.0, color="k", lw=1)
    axis.set_yscale("log", base=2)
    axis.yaxis.set_major_formatter("x{x:g}")
    axis.set_xticks(range(len(others)), [row.method for row in others], rotation=40, ha="right")
    axis.set_ylabel(f"error at {horizon} s over {REFERENCE}'s\na point a split, bar: 95 % of mean")
    axis.grid(alpha=0.3)


def paired_horizon(splits: Sequence[SplitScores]) -> str:
    """Returns the horizon splits are paired at, s: one second, or less if not all reach it."""
    reached = [set(score.rollout_rmse_deg_at) for one in splits for score in one.scores.values()]
    common = [horizon for horizon in _PAIRED_AT if all(horizon in one for one in reached)]
    return common[0] if common else _PAIRED_AT[-1]


def _ratio(split: SplitScores, name: str, horizon: str) -> float | None:
    ours, cov = split.scores.get(name), split.scores.get(REFERENCE)
    if ours is None or cov is None or horizon not in ours.rollout_rmse_deg_at:
        return None
    return ours.rollout_rmse_deg_at[horizon] / cov.rollout_rmse_deg_at[horizon]


def _coverage(axis: Any, rows: Sequence[PairedRow], style: Mapping[str, dict[str, Any]]) -> None:
    held = [(row.method, row.coverage90) for row in rows if row.coverage90 is not None]
    axis.barh(
        [name for name, _ in held],
        [share for _, share in held],
        color=[style[name]["color"] for name, _ in held],
    )
    axis.axvline(0.9, color="k", lw=1, ls="--")
    axis.set_xlim(0.0, 1.0)
    axis.invert_yaxis()
    axis.set_xlabel("share of recorded postures in the 90 % band")
