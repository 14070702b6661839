"""Fig. 5 b: ergonomic scores of predicted postures, beside those of what the person then did."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure as Picture
from numpy.typing import NDArray

from benchmarks.estimation.papers.drawing import ESTIMATED, MEASURED, label, panels
from benchmarks.figure import Figure
from benchmarks.prediction.paper_figures.led_person import LedPerson
from ergonomics import (
    back_angle,
    dose,
    posture_angles,
    reba_inputs,
    rula_inputs,
    rula_pmf,
    score_reba,
    score_rula,
    time_mean,
)
from human import forward_kinematics

Array = NDArray[np.float64]

#: Deviation of angles that smooths RULA's steps into the continuous score, degrees.
SMOOTHING_DEG = 5.0
SCORES = {
    "rula": "RULA, mean over time",
    "reba": "REBA, mean over time",
    "continuous": "RULA continuous, mean over time",
    "back": "cumulative back angle, degree seconds",
}


@dataclass(frozen=True, slots=True)
class Way:
    """Scores along one way: of every sample, and of every time the person went it."""

    predicted: Mapping[str, Array]
    came: Mapping[str, Array]


def scores_over_time(who: LedPerson, q: Array, time_s: Array) -> Mapping[str, Array]:
    """Returns the four scores of whole bodies ``(S, T, nq)``, each ``(S,)``."""
    poses = forward_kinematics(who.model, q)
    angles = posture_angles(who.model, poses, sides=("right",))
    rula, reba = rula_inputs(angles, side="right"), reba_inputs(angles, side="right")
    back = back_angle(who.model, poses).chain_sum_deg
    return {
        "rula": time_mean(score_rula(rula).final.astype(float), time_s),
        "reba": time_mean(score_reba(reba).final.astype(float), time_s),
        "continuous": time_mean(rula_pmf(rula, SMOOTHING_DEG).expected, time_s),
        "back": dose(back, time_s),
    }


def scored_ways(who: LedPerson) -> list[Way]:
    """Scores samples and repetitions of every way."""
    out = []
    for way in range(len(who.predicted)):
        time_s = who.time_s[way]
        predicted = who.whole(way, who.predicted[way].q)
        came = who.whole(way, who.came[way])
        out.append(
            Way(scores_over_time(who, predicted, time_s), scores_over_time(who, came, time_s))
        )
    return out


def figures(ways: list[Way]) -> Iterator[Figure]:
    """Yields how often what came lies within the middle 90 % of the samples."""
    for name, words in SCORES.items():
        inside = [
            (way.came[name] >= np.quantile(way.predicted[name], 0.05) - 1e-9)
            & (way.came[name] <= np.quantile(way.predicted[name], 0.95) + 1e-9)
            for way in ways
        ]
        yield Figure(
            f"Fig. 5: {words}: within 90 % of the predicted",
            float(np.mean(inside)),
            beside=f"{sum(len(one) for one in inside)} repetitions of {len(ways)} ways",
        )


def picture(ways: list[Way]) -> Picture:
    """Draws one panel a score: samples as a shape and their quartiles, repetitions as dots."""
    drawn, axes = panels(
        1,
        4,
        "Scores of sampled postures (shapes), and of the times the person went the same way (dots)",
        size=(13.0, 3.4),
    )
    for axis, (name, words) in zip(axes[0], SCORES.items(), strict=True):
        for place, way in enumerate(ways, start=1):
            values = way.predicted[name]
            if np.ptp(values) > 1e-6:
                shape = axis.violinplot([values], [place], widths=0.8, showextrema=False)
                for body in shape["bodies"]:
                    body.set_facecolor(ESTIMATED)
                    body.set_alpha(0.35)
            axis.vlines(place, *np.quantile(values, [0.05, 0.95]), color=ESTIMATED, linewidth=1.0)
            axis.hlines(np.median(values), place - 0.2, place + 0.2, color=ESTIMATED, linewidth=1.5)
            spread = place + np.linspace(-0.12, 0.12, len(way.came[name]))
            axis.plot(spread, way.came[name], "o", color=MEASURED, markersize=3.5)
        axis.set_xticks(range(1, len(ways) + 1))
        label(axis, title=words, x="way")
    return drawn
