"""One picture a trial: our moments over another program's, joint by joint."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.estimation.real_motion.comparison import Row
from benchmarks.estimation.real_motion.reference import Reference

#: Told apart by colour-blind people, too (Okabe and Ito 2008).
_COLOURS = {"A": "#E69F00", "B": "#0072B2"}


def draw_trial(folder: Path, theirs: Reference, rows_of: dict[str, list[Row]]) -> Path:
    """Draws a trial and returns the PNG's path.

    Args:
        folder: for the picture; made if it is not there.
        theirs: the reference.
        rows_of: rows by driver.
    """
    joints = list(dict.fromkeys(row.joint for rows in rows_of.values() for row in rows))
    columns = 3
    lines = -(-len(joints) // columns)
    figure = Figure(figsize=(4.0 * columns, 2.2 * lines + 1.0), layout="constrained")
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True).flat
    for axis, joint in zip(axes, joints, strict=False):
        for driver, rows in rows_of.items():
            row = next((row for row in rows if row.joint == joint), None)
            if row is None:
                continue
            # A line is not drawn over frames that one of the two does not know.
            breaks = np.flatnonzero(np.diff(row.time_s) > 1.5 * np.median(np.diff(row.time_s))) + 1
            time_s, ours, reference = (
                np.insert(values, breaks, np.nan) for values in (row.time_s, row.ours, row.theirs)
            )
            axis.plot(time_s, reference, color="#000000", linewidth=1.6, label=theirs.program)
            axis.plot(
                time_s, ours, color=_COLOURS[driver[0]], linewidth=1.2, linestyle="--",
                label=f"{driver}: {row.rmse:.3f} N m/kg, r {row.r:.3f}",
            )  # fmt: skip
        handles, labels = axis.get_legend_handles_labels()
        once = dict(zip(labels, handles, strict=True))
        axis.legend(once.values(), once.keys(), fontsize=6, frameon=False)
        axis.set_title(joint, fontsize=9)
        axis.set_ylabel("flexion moment, N m/kg", fontsize=7)
        axis.set_xlabel("time, s", fontsize=7)
        axis.tick_params(labelsize=7)
        axis.grid(True, color="#dddddd", linewidth=0.6)
    for axis in list(figure.axes)[len(joints) :]:
        axis.set_visible(False)
    figure.suptitle(f"{theirs.trial}: our joint moments and {theirs.program}'s", fontsize=11)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{theirs.program.lower()}_{theirs.trial}.png"
    figure.savefig(path, dpi=130)
    return path
