"""How the comparison on real recordings is shown: a row a split and method, and tables."""

from collections.abc import Mapping, Sequence

from prediction import MethodScore, PairedRow, SplitScores

_HORIZONS = ("0.25", "0.5", "1", "2")
_ORDER = ("auto", "mi-nsgp", "locov-ik", "cc-gp", "cov-ik", "minimum-norm", "paper")


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
        heads = (*(f"{h} s" for h in _HORIZONS), "one step", "nats more")
        lines.append(f"  {'':14}" + "".join(f"{head:>24}" for head in heads) + "   90 %  width")
        for row in sorted(rows, key=lambda row: _ORDER.index(row.method)):
            one_step = _cell(row.rmse_ratio, row.rmse_interval, row.rmse_wins, row.splits)
            nats = f"{row.nats_more:+.1f} {row.nats_wins}/{row.splits}"
            cells = (*(_at(row, horizon) for horizon in _HORIZONS), one_step, nats)
            lines.append(
                f"  {row.method:14}"
                + "".join(f"{cell:>24}" for cell in cells)
                + f"{_number(row.coverage90, '.2f'):>7}{_number(row.width_deg, '.1f'):>7}"
            )
        lines.append(f"  {_lost(rows)}")
    return "\n".join(lines)


def _at(row: PairedRow, horizon: str) -> str:
    if horizon not in row.rollout_ratio:
        return "-"
    wins, count = row.rollout_wins[horizon]
    return _cell(row.rollout_ratio[horizon], row.rollout_interval[horizon], wins, count)


def _cell(ratio: float, interval: tuple[float, float] | None, wins: int, count: int) -> str:
    between = "" if interval is None else f" [{interval[0]:.2f} {interval[1]:.2f}]"
    return f"x{ratio:.2f}{between} {wins}/{count}"


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
