"""Which method to use, decided on motion held out of the demonstrations."""

from collections.abc import Mapping
from dataclasses import dataclass

#: Closed-loop errors up to this ratio of the least count as equal.
AS_GOOD = 1.03


@dataclass(frozen=True, slots=True)
class Choice:
    """A method, and in words why it."""

    method: str
    reason: str


def choose_method(held_out: Mapping[str, Mapping[str, float | None]]) -> Choice:
    """Takes the method with the least closed-loop error, among equals the greatest density.

    Args:
        held_out: For each method the metrics of its calibration, on parts of the demonstrations
            left out in turn.

    Returns:
        The choice. Without roll-outs (demonstrations too short) density alone decides.

    Closed-loop error comes first because rank one step ahead does not predict it; errors within
    `AS_GOOD` of the least are taken for equal, since a few parts cannot tell them apart.
    """
    density = {
        name: float(m["null_log_likelihood_held_out"] or 0.0) for name, m in held_out.items()
    }
    error = {
        name: float(value)
        for name, m in held_out.items()
        if (value := m["rollout_rmse_deg_held_out"]) is not None
    }
    if len(error) < len(held_out):
        best = max(density, key=lambda name: density[name])
        shown = ", ".join(
            f"{n} {density[n]:.1f}" for n in sorted(density, key=lambda n: -density[n])
        )
        return Choice(
            best, f"greatest held-out density (too little motion for roll-outs), nats: {shown}"
        )
    least = min(error.values())
    equal = [name for name, value in error.items() if value <= AS_GOOD * least]
    best = max(equal, key=lambda name: density[name])
    shown = ", ".join(
        f"{name} {error[name]:.2f} deg / {density[name]:.1f} nats"
        for name in sorted(error, key=lambda n: error[n])
    )
    others = [name for name in (equal if len(equal) > 1 else error) if name != best]
    margin = ""
    if len(equal) > 1:
        denser = density[best] - max(density[name] for name in others)
        margin = f"; densest of {len(equal)} within {AS_GOOD - 1.0:.0%} of it, by {denser:.1f} nats"
    elif others:
        margin = f", {1.0 - least / max(min(error[n] for n in others), 1e-9):.0%} below the next"
    return Choice(best, f"least joint error in roll-outs on held-out parts{margin}: {shown}")
