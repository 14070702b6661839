"""Fig. 6 a: how differently the same hand way is gone, and the band that was predicted for it."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure as Picture

from benchmarks.estimation.papers.drawing import (
    ESTIMATED,
    MEASURED,
    label,
    legend_below,
    panels,
)
from benchmarks.figure import Figure
from benchmarks.prediction.paper_figures.led_person import LedPerson

#: Joints of the picture; the paper shows roll and pitch of the shoulder.
JOINTS = {f"jRightShoulder_rot{axis}": f"right shoulder about {axis}" for axis in "xyz"}


def figures(who: LedPerson) -> Iterator[Figure]:
    """Yields how much of what came the sampled 90 % band holds, and how wide it is."""
    inside, width = [], []
    for run, came in zip(who.predicted, who.came, strict=True):
        low, high = np.quantile(run.q, [0.05, 0.95], axis=0)
        inside.append(((came >= low) & (came <= high))[:, 1:].mean())
        width.append(np.degrees(high - low)[1:].mean())
    yield Figure(
        "Fig. 6a: postures of repetitions within the sampled 90 % band",
        float(np.mean(inside)),
        least=0.87,
        most=0.96,
        beside="white noise .57 on real people",
    )
    yield Figure("Fig. 6a: mean width of that band", float(np.mean(width)), "deg")


def picture(who: LedPerson, way: int = 0) -> Picture:
    """Draws three angles of the shoulder along one way."""
    drawn, axes = panels(
        1,
        len(JOINTS),
        "The same hand way gone five times, and what was predicted of it (angles from the T-pose)",
        size=(11, 3.4),
    )
    run, time_s = who.predicted[way], who.time_s[way]
    names = list(who.trained.joint_names)
    low, high = np.quantile(run.q, [0.05, 0.95], axis=0)
    for axis, (joint, words) in zip(axes[0], JOINTS.items(), strict=True):
        column = names.index(joint)
        axis.fill_between(
            time_s,
            np.degrees(low[:, column]),
            np.degrees(high[:, column]),
            color=ESTIMATED,
            alpha=0.2,
            linewidth=0.0,
            label="90 % of the samples",
        )
        for number, sample in enumerate(run.q[:10, :, column]):
            axis.plot(
                time_s,
                np.degrees(sample),
                color=ESTIMATED,
                linewidth=0.5,
                alpha=0.7,
                label="ten samples" if number == 0 else None,
            )
        for number, q in enumerate(who.came[way][:, :, column]):
            axis.plot(
                time_s,
                np.degrees(q),
                color=MEASURED,
                linewidth=1.2,
                label="the person, five times" if number == 0 else None,
            )
        label(axis, title=words, x="s", y="degrees" if axis is axes[0, 0] else "")
    legend_below(drawn, axes[0, 0], 3)
    return drawn
