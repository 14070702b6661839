"""An estimate at a glance, as one picture."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.estimates.series import Series

Array = NDArray[np.float64]

_MOST_POINTS = 4000
_JOINTS = 5
#: Colours that people with a colour vision deficiency can tell apart (Okabe and Ito 2008).
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00")


def draw(series_path: Path, summary: dict[str, Any], out: Path) -> None:
    """Draws payload, efforts, low back and feet over time; what cannot be told is hatched.

    Args:
        series_path: The time series.
        summary: Of the same estimate.
        out: The picture to write, PNG or PDF by its name.
    """
    # Neither a display nor pyplot's global state is needed, nor half a second at every start.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    series = Series(series_path)
    time_s = series["time_s"]
    some = slice(None, None, max(1, -(-len(time_s) // _MOST_POINTS)))
    t = time_s[some]
    figure = Figure(figsize=(11.0, 11.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(4, 1, sharex=True)
    figure.suptitle(f"{summary['source']}: {_bands(summary['bands'])}", fontsize=11)

    payload = [series[f"payload_{q}_kg"][some] for q in ("p05", "p50", "p95")]
    _band(axes[0], t, payload, _COLOURS[0], "both hands together")
    _hatch(axes[0], t, ~np.isfinite(payload[1]))
    for hold in summary["holds"]:
        if hold["state"] == "loaded":
            middle = hold["mass_kg"]["p50"]
            axes[0].plot([hold["start_s"], hold["end_s"]], [middle, middle], "k", lw=2)
            axes[0].annotate(
                f"{middle:.2f} kg", (hold["start_s"], middle), xytext=(2, 4),
                textcoords="offset points", fontsize=9,
            )  # fmt: skip
    axes[0].set_ylabel("payload [kg]")

    unknown = np.ones(len(t), dtype=np.bool_)
    for colour, effort in zip(_COLOURS, summary["efforts"][:_JOINTS], strict=False):
        name = effort["joint"]
        values = [series[f"{name}_effort_{q}_nm"][some] for q in ("p05", "p50", "p95")]
        _band(axes[1], t, values, colour, name.removeprefix("j"))
        unknown &= ~np.isfinite(values[1])
    _hatch(axes[1], t, unknown)
    axes[1].set_ylabel("joint effort [N m]")

    force = np.linalg.norm(series.vectors("l5s1_force", "n")[some], axis=-1)
    moment = np.linalg.norm(series.vectors("l5s1_moment", "nm")[some], axis=-1)
    axes[2].plot(t, force, color=_COLOURS[0], lw=1, label="force [N]")
    right = axes[2].twinx()
    right.plot(t, moment, color=_COLOURS[1], lw=1, label="moment [N m]")
    axes[2].set_ylabel("L5S1 force [N]")
    right.set_ylabel("L5S1 moment [N m]")
    axes[2].legend(*_both_legends(axes[2], right), fontsize=8, loc="upper right")
    _hatch(axes[2], t, ~np.isfinite(force))

    for colour, side in zip(_COLOURS, ("right", "left"), strict=False):
        axes[3].plot(
            t, series[f"{side}_foot_force_z_n"][some], color=colour, lw=1, label=f"{side} foot"
        )
    axes[3].set_ylabel("vertical force [N]")
    axes[3].set_xlabel("time [s]")
    feet = [series[f"{side}_foot_force_z_n"][some] for side in ("right", "left")]
    _hatch(axes[3], t, ~np.isfinite(feet[0]) & ~np.isfinite(feet[1]))
    for ax in (axes[0], axes[1], axes[3]):
        if ax.get_legend_handles_labels()[0]:
            ax.legend(fontsize=8, loc="upper right")
    doubtful = series["doubtful"][some] > 0.0
    for ax in axes:
        ax.grid(alpha=0.3)
        ax.fill_between(
            t, 0, 1, where=doubtful, transform=ax.get_xaxis_transform(), color="0.9", lw=0, zorder=0
        )
        lines = [line.get_ydata() for line in (*ax.lines, *(right.lines if ax is axes[2] else ()))]
        if not any(np.any(np.isfinite(values)) for values in lines):
            ax.set_yticks([])
            if ax is axes[2]:
                right.set_yticks([])
            ax.text(0.5, 0.5, "cannot be told", transform=ax.transAxes, ha="center", va="center")
    axes[3].annotate(
        "hatched: cannot be told from what was measured; grey: carried over a gap", (1.0, -0.28),
        xycoords="axes fraction", ha="right", fontsize=8,
    )  # fmt: skip
    figure.savefig(out, dpi=110)


def _bands(kind: str) -> str:
    return {
        "noise": "bands 5 to 95 %, the sensors' noise alone",
        "noise_and_model": "bands 5 to 95 %, sensors' noise and errors of the body model",
        "tuning": "bands of the paper's preset, too narrow to be believed",
    }.get(kind, "no bands")


def _band(ax: Any, t: Array, quantiles: Sequence[Array], colour: str, name: str) -> None:
    low, middle, high = quantiles
    ax.fill_between(t, low, high, color=colour, alpha=0.2, lw=0)
    ax.plot(t, middle, color=colour, lw=1, label=name)


def _hatch(ax: Any, t: Array, unknown: NDArray[np.bool_]) -> None:
    """Marks the stretches in which a quantity is not known."""
    if np.any(unknown):
        ax.fill_between(
            t, 0, 1, where=unknown, transform=ax.get_xaxis_transform(), facecolor="none",
            edgecolor="0.8", hatch="///", lw=0, zorder=0,
        )  # fmt: skip


def _both_legends(left: Any, right: Any) -> tuple[list[Any], list[str]]:
    found: tuple[list[Any], list[str]] = ([], [])
    for ax in (left, right):
        for kept, more in zip(found, ax.get_legend_handles_labels(), strict=True):
            kept += more
    return found
