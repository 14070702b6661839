"""How the comparison on real recordings is shown: a row a split and method, tables, a picture."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from prediction import MethodScore, PairedRow, SplitScores

_HORIZONS = ("0.25", "0.5", "1", "2")
_ORDER = ("auto", "mi-nsgp", "locov-ik", "cc-gp", "cov-ik", "minimum-norm", "paper's way")
#: Told apart also by those who see no red or green.
_COLOURS = dict(
    zip(
        _ORDER,
        ("#000000", "#0072b2", "#e69f00", "#009e73", "#999999", "#cc79a7", "#d55e00"),
        strict=True,
    )
)


def split_table(scores: Sequence[SplitScores]) -> str:
    """Returns a line for each split and method."""
    lines = [
        f"  {'':34}{'nats':>7}{'rad/s':>8}{'joint error, deg, at .25 .5 1 2 s':>36}"
        f"{'hand mm':>9}{'90 %':>6}{'width':>7}"
    ]
    for split in scores:
        lines.append(f"  {split.split[0]}: {split.split[1]}")
        if split.problem:
            lines.append(f"    left out: {split.problem}")
        lines += [_line(split.scores[name]) for name in _ORDER if name in split.scores]
    return "\n".join(lines)


def _line(score: MethodScore) -> str:
    at = "".join(
        f"{score.rollout_rmse_deg_at[h]:8.2f}" if h in score.rollout_rmse_deg_at else f"{'-':>8}"
        for h in _HORIZONS
    )
    hand = "-" if score.rollout_hand_mean_m is None else f"{1e3 * score.rollout_hand_mean_m:.3f}"
    return (
        f"    {score.method:32}{score.log_likelihood:7.1f}{score.rmse_rad_s:8.3f}{at:>36}"
        f"{hand:>9}{_number(score.coverage90_rollout, '.2f'):>6}"
        f"{_number(score.band_width_deg, '.1f'):>7}"
    )


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def pooled_tables(tables: Mapping[str, Sequence[PairedRow]]) -> str:
    """Returns a table of each design over all people, and where a method loses to Cov-IK."""
    lines = []
    for design, rows in tables.items():
        lines.append(
            f"\n{design}: ratio to Cov-IK [95 % of the mean over splits] (splits won), "
            f"{rows[0].splits} splits"
        )
        heads = (*(f"{h} s" for h in _HORIZONS), "one step", "nats more", "90 %", "width")
        lines.append(f"  {'':14}" + "".join(f"{head:>24}" for head in heads[:6]))
        for row in sorted(rows, key=lambda row: _ORDER.index(row.method)):
            cells = [_ratio(row, h) for h in _HORIZONS]
            one = f"x{row.rmse_ratio:.2f} {_between(row.rmse_interval)} ({row.rmse_wins})"
            nats = f"{row.nats_more:+.1f} ({row.nats_wins})"
            ends = f"  90 %: {_number(row.coverage90, '.2f')}, {_number(row.width_deg, '.1f')} deg"
            lines.append(
                f"  {row.method:14}" + "".join(f"{cell:>24}" for cell in (*cells, one, nats)) + ends
            )
        lines.append(f"  {_lost(rows)}")
    return "\n".join(lines)


def _ratio(row: PairedRow, horizon: str) -> str:
    if horizon not in row.rollout_ratio:
        return "-"
    wins, count = row.rollout_wins[horizon]
    between = _between(row.rollout_interval[horizon])
    return f"x{row.rollout_ratio[horizon]:.2f} {between} ({wins}/{count})"


def _between(interval: tuple[float, float] | None) -> str:
    return "" if interval is None else f"[{interval[0]:.2f} {interval[1]:.2f}]"


def _lost(rows: Sequence[PairedRow]) -> str:
    """Says at which horizons MI-NsGP errs more than Cov-IK, and whether the interval shows it."""
    row = next(row for row in rows if row.method == "mi-nsgp")
    said = []
    for horizon, ratio in row.rollout_ratio.items():
        interval = row.rollout_interval[horizon]
        if ratio > 1.0:
            clear = interval is not None and interval[0] > 1.0
            said.append(f"{horizon} s (x{ratio:.2f}{', beyond its interval' if clear else ''})")
    if not said:
        return "MI-NsGP errs less than Cov-IK at every horizon"
    return f"MI-NsGP loses to Cov-IK at {', '.join(said)}"


def draw(
    scores: Mapping[str, Sequence[SplitScores]],
    tables: Mapping[str, Sequence[PairedRow]],
    path: Path,
) -> None:
    """Draws joint error over Cov-IK's: against horizon, and split by split at half a second.

    Args:
        scores: By data set.
        tables: By design, over all data sets.
        path: The picture.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.2 * len(tables), 7.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, len(tables), squeeze=False, sharey="row")
    markers = dict(zip(scores, "osv^D", strict=False))
    for column, (design, rows) in enumerate(tables.items()):
        above, below = axes[0, column], axes[1, column]
        shown = [name for name in _ORDER if name != "cov-ik"]
        for row in sorted(rows, key=lambda row: _ORDER.index(row.method)):
            seconds = [float(h) for h in row.rollout_ratio]
            above.plot(
                seconds, list(row.rollout_ratio.values()), marker="o", ms=4,
                color=_COLOURS[row.method], label=row.method,
                lw=2.5 if row.method == "auto" else 1.3,
            )  # fmt: skip
        above.set_title(f"{design} ({rows[0].splits} splits)")
        above.set_xlabel("horizon [s]")
        for place, name in enumerate(shown):
            for data, some in scores.items():
                at = [_at_half(one, name) for one in some if one.split[0] == design]
                there = [ratio for ratio in at if ratio is not None]
                beside = place + 0.4 * ((np.arange(len(there)) + 0.5) / max(len(there), 1) - 0.5)
                below.plot(beside, there, markers[data], ms=5, alpha=0.8, color=_COLOURS[name])
        below.set_xticks(range(len(shown)), shown, rotation=40, ha="right")
        for axis in (above, below):
            axis.axhline(1.0, color=_COLOURS["cov-ik"], lw=1)
            axis.set_yscale("log", base=2)
            axis.yaxis.set_major_formatter("x{x:g}")
            axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("joint error over Cov-IK's, mean")
    axes[1, 0].set_ylabel("the same at 0.5 s, split by split")
    axes[0, 0].legend(fontsize=8)
    for data, marker in markers.items():
        if scores[data]:
            axes[1, 0].plot([], [], marker, color="0.4", label=data)
    axes[1, 0].legend(fontsize=8)
    figure.savefig(path, dpi=110)


def _at_half(split: SplitScores, name: str) -> float | None:
    ours, cov = split.scores.get(name), split.scores.get("cov-ik")
    if ours is None or cov is None or "0.5" not in ours.rollout_rmse_deg_at:
        return None
    return ours.rollout_rmse_deg_at["0.5"] / cov.rollout_rmse_deg_at["0.5"]
