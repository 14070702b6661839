"""Two courses of joint moments against each other, projected on one axis, with bars."""

from dataclasses import dataclass

import numpy as np

from benchmarks.estimation.real_motion.reference import Array, Estimated, Mask, Reference
from benchmarks.estimation.real_motion.user_driver import UserRun

#: An estimator that returns zero must be beaten by this.
OF_ZERO = 0.7


@dataclass(frozen=True, slots=True)
class Bar:
    """What a joint must reach: RMSE in N m/kg and correlation."""

    rmse: float
    r: float


#: By driver and kind of motion, then by part of the joint's name.
BARS: dict[tuple[str, str], dict[str, Bar]] = {
    ("A", "squats"): {"Ankle": Bar(0.05, 0.98), "Knee": Bar(0.12, 0.98), "Hip": Bar(0.10, 0.98),
                      "L5S1": Bar(0.25, 0.98)},
    ("A", "gait"): {"Ankle": Bar(0.08, 0.85), "Knee": Bar(0.15, 0.85), "Hip": Bar(0.25, 0.85)},
    ("B", "squats"): {"Ankle": Bar(0.10, 0.9), "Knee": Bar(0.24, 0.9), "Hip": Bar(0.20, 0.9),
                      "L5S1": Bar(0.50, 0.9)},
    ("B", "gait"): {"Ankle": Bar(0.16, 0.85), "Knee": Bar(0.20, 0.85), "Hip": Bar(0.30, 0.85)},
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Row:
    """One joint of one trial.

    Attributes:
        joint: name.
        time_s: ``(n,)`` frames that both know.
        ours: ``(n,)`` N m/kg.
        theirs: ``(n,)`` N m/kg.
        frames_of: how many frames the reference has.
        bar: to reach, or None: for information.
    """

    joint: str
    time_s: Array
    ours: Array
    theirs: Array
    frames_of: int
    bar: Bar | None

    @property
    def rmse(self) -> float:
        """N m/kg."""
        return float(np.sqrt(np.mean((self.ours - self.theirs) ** 2)))

    @property
    def zero(self) -> float:
        """RMSE of an estimator that returns zero, N m/kg."""
        return float(np.sqrt(np.mean(self.theirs**2)))

    @property
    def r(self) -> float:
        """Correlation."""
        return float(np.corrcoef(self.ours, self.theirs)[0, 1])

    @property
    def bias(self) -> float:
        """Mean of ours minus theirs, N m/kg."""
        return float(np.mean(self.ours - self.theirs))

    @property
    def peak_ratio(self) -> float:
        """Ours over theirs where theirs is greatest in size."""
        at = int(np.argmax(np.abs(self.theirs)))
        return float(self.ours[at] / self.theirs[at])

    @property
    def passed(self) -> bool | None:
        """Whether the bar is reached, the zero estimator beaten; None without a bar."""
        if self.bar is None:
            return None
        return self.rmse <= min(self.bar.rmse, OF_ZERO * self.zero) and self.r >= self.bar.r


def compare(ours: Estimated, theirs: Reference, kind: str) -> list[Row]:
    """Returns a row for each joint that both have, on the frames that both know.

    Args:
        ours: at its own times.
        theirs: at its own times.
        kind: ``squats``, ``gait`` or another, which has no bars.
    """
    bars = BARS.get((ours.driver[0], kind), {})
    rows = []
    for joint, moment in theirs.moment.items():
        if joint not in ours.moment:
            continue
        there = theirs.time_s
        inside = (there >= ours.time_s[0]) & (there <= ours.time_s[-1])
        vector = np.stack(
            [np.interp(there, ours.time_s, column) for column in ours.moment[joint].T], axis=1
        )
        used = inside & theirs.valid[joint] & _known(there, ours.time_s, ours.known[joint])
        if np.count_nonzero(used) < 10:
            continue
        axis, mass = theirs.axis[joint][used], theirs.mass_kg
        bar = next((bar for part, bar in bars.items() if part in joint), None)
        rows.append(
            Row(
                joint, there[used], np.sum(vector[used] * axis, axis=1) / mass,
                np.sum(moment[used] * axis, axis=1) / mass, len(there), bar,
            )
        )  # fmt: skip
    return rows


def covered(run: UserRun, theirs: Reference) -> dict[str, float]:
    """Returns by joint the share of frames in which their moment lies in our 95 % band.

    The band holds our errors; theirs add to the difference, so that less than 95 % is no proof.
    """
    ours, out = run.found, {}
    for joint, band in run.flexion.items():
        if joint not in theirs.moment:
            continue
        near = np.clip(np.searchsorted(theirs.time_s, ours.time_s), 0, len(theirs.time_s) - 1)
        used = ours.known[joint] & theirs.valid[joint][near]
        used &= np.abs(theirs.time_s[near] - ours.time_s) < 1e-3
        value = np.sum(theirs.moment[joint][near] * band.axis, axis=1)
        inside = np.abs(value - band.torque) <= 1.96 * band.sd
        if np.any(used):
            out[joint] = float(np.mean(inside[used]))
    return out


def _known(there: Array, time_s: Array, known: Mask) -> Mask:
    """Whether the neighbours in time of each instant are known."""
    after = np.clip(np.searchsorted(time_s, there - 1e-9), 0, len(time_s) - 1)
    before = np.clip(after - 1, 0, len(time_s) - 1)
    return known[after] & known[before]


def table(rows: list[Row]) -> str:
    """Returns the rows as text, one line each."""
    head = (f"  {'joint':<14}{'RMSE':>8}{'bar':>7}{'zero':>8}{'x zero':>8}{'r':>8}{'bar':>6}"
            f"{'peak':>7}{'bias':>8}{'frames':>12}")  # fmt: skip
    lines = [head]
    for row in rows:
        bar = f"{row.bar.rmse:7.2f}" if row.bar else f"{'':7}"
        least = f"{row.bar.r:6.2f}" if row.bar else f"{'':6}"
        verdict = {True: "  PASS", False: "  FAIL", None: ""}[row.passed]
        lines.append(
            f"  {row.joint:<14}{row.rmse:8.3f}{bar}{row.zero:8.3f}{row.rmse / row.zero:8.2f}"
            f"{row.r:8.3f}{least}{row.peak_ratio:7.2f}{row.bias:8.3f}"
            f"{len(row.time_s):7d}/{row.frames_of}{verdict}"
        )
    return "\n".join(lines)
