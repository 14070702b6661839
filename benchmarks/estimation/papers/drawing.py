"""Drawings that all figures share: panels, phases in the background, ours beside the papers'."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

#: Told apart by colour-blind people, too (Okabe and Ito 2008).
MEASURED, ESTIMATED, TRUE, OTHER = "#D55E00", "#0072B2", "#000000", "#009E73"
SERIES = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9")
SUPPORT_SHADES = {"right": "#cfe3f5", "left": "#fbe3c0", "double": "#ffffff"}


def panels(
    rows: int,
    columns: int,
    title: str,
    *,
    size: tuple[float, float] | None = None,
    sharex: bool | str = False,
    sharey: bool | str = False,
) -> tuple[Figure, np.ndarray]:
    """Makes a figure of equal panels with time below the last row.

    Returns:
        The figure, and its panels ``rows x columns``.
    """
    width, height = size or (3.2 * columns + 1.0, 1.9 * rows + 1.0)
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
    figure.suptitle(title, fontsize=11)
    for axis in axes.flat:
        axis.grid(True, color="#dddddd", linewidth=0.6)
        axis.tick_params(labelsize=8)
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
    return figure, axes


def label(axis: Axes, *, title: str = "", y: str = "", x: str = "") -> None:
    """Names a panel and its axes."""
    if title:
        axis.set_title(title, fontsize=9)
    axis.set_ylabel(y, fontsize=8)
    axis.set_xlabel(x, fontsize=8)


def legend_below(figure: Figure, axis: Axes, columns: int = 4) -> None:
    """Puts one legend for all panels below them."""
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=columns, fontsize=8, frameon=False
    )


def band(
    axis: Axes, time_s: np.ndarray, middle: np.ndarray, sd: np.ndarray, color: str, text: str
) -> None:
    """Fills the 95 % band about a line."""
    axis.fill_between(
        time_s,
        middle - 1.96 * sd,
        middle + 1.96 * sd,
        color=color,
        alpha=0.25,
        linewidth=0.0,
        label=text,
    )


def shade_supports(axis: Axes, time_s: np.ndarray, right: np.ndarray, left: np.ndarray) -> None:
    """Colours the background by the feet that stand."""
    kind = np.where(right & left, "double", np.where(right, "right", "left"))
    edges = np.flatnonzero(kind[1:] != kind[:-1]) + 1
    for start, stop in zip((0, *edges), (*edges, len(kind)), strict=True):
        stop_s = time_s[min(stop, len(kind) - 1)]
        axis.axvspan(time_s[start], stop_s, color=SUPPORT_SHADES[kind[start]], zorder=0)


def mark_interval(axis: Axes, time_s: np.ndarray, inside: np.ndarray) -> None:
    """Draws dashed lines where an interval starts and ends, as 2021 does for the T-pose."""
    at = np.flatnonzero(inside)
    for k in (at[0], at[-1]):
        axis.axvline(time_s[k], color="#666666", linestyle="--", linewidth=0.8)


def log_sweep(values: Sequence[float]) -> list[str]:
    """Returns covariances as powers of ten for a legend."""
    return [rf"$10^{{{round(np.log10(value))}}}$" for value in values]
