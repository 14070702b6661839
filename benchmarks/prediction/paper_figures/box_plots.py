"""Fig. 4 a-d: every method one step ahead, one box a method over seeds or people."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from matplotlib.ticker import LogLocator, NullFormatter

from benchmarks.estimation.papers.drawing import label, panels
from benchmarks.prediction.paper_figures import experiments
from benchmarks.prediction.paper_figures.experiments import experiment, followers, one_step
from benchmarks.prediction.planar_operator import (
    BIPOP,
    IN_SAMPLE,
    LAW,
    ROWS,
    one_seed,
)

#: The panels of the figure: attribute of the scores, words, whether on a log scale.
PANELS = (
    ("nats", "(a) log density of the\njoint velocity, nats", False),
    ("rmse", "(b) RMSE of the joint\nvelocity, rad/s", True),
    ("hand_nats", "(c) log density of the\nhand velocity, nats", False),
    ("hand_rmse", "(d) RMSE of the hand\nvelocity, m/s", True),
)
#: Methods of the picture, ours on top; the rest of the planar rows are in its table.
PLANAR = (LAW, *(row for row in ROWS if row not in (BIPOP, IN_SAMPLE)))
#: Errors below this are rounding.
ROUNDING = 1e-9

Values = Mapping[str, Sequence[float]]


def planar_values(kind: str, seeds: range, what: str) -> Values:
    """Returns a score of every row over seeds."""
    rows = [one_seed(kind, seed) for seed in seeds]
    return {name: [getattr(row[name], what) for row in rows] for name in PLANAR}


def led_values(design: experiments.Design, people: Sequence[tuple[str, int]], what: str) -> Values:
    """Returns a score of every row over people."""
    values: dict[str, list[float]] = {name: [] for name in experiments.ROWS}
    for kind, seed in people:
        data = experiment(design, kind, seed)
        for name, follower in followers(design, kind, seed).items():
            values[name].append(getattr(one_step(data, follower), what))
    return values


def _boxes(axis: Axes, values: Values, log: bool, first: bool) -> None:
    names = list(values)[::-1]
    numbers = [np.asarray(values[name]) for name in names]
    if log:
        numbers = [np.maximum(number, ROUNDING) for number in numbers]
        axis.set_xscale("log")
        span = max(n.max() for n in numbers) / min(n.min() for n in numbers)
        subs = (1.0, 2.0, 5.0) if span < 1e3 else (1.0,)
        axis.xaxis.set_major_locator(LogLocator(subs=subs, numticks=6))
        axis.xaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_minor_formatter(NullFormatter())
    axis.boxplot(
        numbers,
        orientation="horizontal",
        widths=0.6,
        whis=(0, 100),
        medianprops={"color": "#D55E00", "linewidth": 1.6},
        boxprops={"linewidth": 0.8},
        whiskerprops={"linewidth": 0.8},
        capprops={"linewidth": 0.8},
    )
    if not log:
        # One method far off must not flatten the others: the axis ends below the middle of them.
        medians = np.array([np.median(number) for number in numbers])
        top = max(number.max() for number in numbers)
        low = max(
            min(number.min() for number in numbers),
            top - 3.0 * (top - np.quantile(medians, 0.25)) - 5.0,
        )
        axis.set_xlim(low - 0.05 * (top - low), top + 0.05 * (top - low))
        for row, number in enumerate(numbers, start=1):
            if np.median(number) < low:
                axis.annotate(
                    f"← {np.median(number):.0f}",
                    (low, row),
                    fontsize=7,
                    va="center",
                    color="#D55E00",
                )
    axis.set_yticks(range(1, len(names) + 1), names if first else [""] * len(names), fontsize=7)


def _picture(title: str, rows: Sequence[tuple[str, Callable[[str], Values]]]) -> Picture:
    drawn, axes = panels(
        len(rows),
        4,
        f"{title} Box: quartiles; whiskers: all. Errors of rounding stand at {ROUNDING:g}.",
        size=(13.0, 3.0 * len(rows) + 0.6),
    )
    for row, (words, values) in zip(axes, rows, strict=True):
        for axis, (what, name, log) in zip(row, PANELS, strict=True):
            _boxes(axis, values(what), log, axis is row[0])
            label(axis, title=name, y=words if axis is row[0] else "")
    return drawn


def planar_picture(seeds: range) -> Picture:
    """Draws 5R, with samples held out at random and with the end held out."""
    return _picture(
        f"5R, one step ahead (paper's Fig. 4), {len(seeds)} operators.",
        (
            ("held out at random", lambda what: planar_values("random", seeds, what)),
            ("last 30 % of the time", lambda what: planar_values("block", seeds, what)),
        ),
    )


def led_picture(people: Sequence[tuple[str, int]]) -> Picture:
    """Draws EXP1 and EXP2."""
    return _picture(
        f"24 joints, one step ahead (paper's Fig. 4), {len(people)} simulated people.",
        (
            ("EXP1: later repetitions", lambda what: led_values("EXP1", people, what)),
            ("EXP2: trained on other motion", lambda what: led_values("EXP2", people, what)),
        ),
    )
