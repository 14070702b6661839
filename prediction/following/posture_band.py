"""How a person's posture strays from the predicted one, and comes back, along the way.

Independent noise at every step averages away: a band made of it is far too narrow. People deviate
coherently: an elbow carried high stays high for a while. The deviation is an Ornstein-Uhlenbeck
process, so it does not grow without end. What it runs in is measured: the way of the hand for
people who are still when it rests, time for people who sway meanwhile, or a mix.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from prediction.laws.small_systems import solve_spd
from prediction.laws.student_t import NINETY

Array = NDArray[np.float64]

#: Correlation lengths tried, s of `travelled`.
LENGTHS = np.geomspace(0.1, 16.0, 17)
#: Shares of time tried in what the process runs in.
CLOCKS = (0.0, 0.25, 0.5, 0.75, 1.0)
#: A hand that has gone less than this counts as having gone it, s: people are never quite still.
_LEAST = 1e-3
#: Share of the diagonal in the fitted covariance: few stretches say little about correlations.
_DIAGONAL_SHARE = 0.2


@dataclass(frozen=True, slots=True)
class PostureBand:
    """Deviation of posture as a process in u, the way of the hand or time.

    ``delta(0) = 0`` and ``delta(u + du) = rho delta(u) + sqrt(1 - rho^2) L xi`` with
    ``rho = exp(-du / length)``, so ``cov delta(u) = (1 - exp(-2 u / length)) L L'``.

    Attributes:
        factor: L, ``(n, n)`` rad.
        length: Correlation length.
        rate_moment: Second moment of demonstrated joint velocities, ``(n, n)`` (rad/s)^2; the unit
            of travelled distance.
        clock: Share of time in u, 0 to 1; the rest is travelled distance.
    """

    factor: Array
    length: float
    rate_moment: Array
    clock: float = 0.0

    def travelled(self, step: Array, jacobian: Array, elapsed_s: Array | float) -> Array:
        """Returns how far u goes in a step of the hand, ``(...)`` s.

        ``(1 - clock) sqrt(dx' (J C J')^-1 dx / m) + clock dt`` with C the demonstrated velocity
        moment: the root is how long the person would take for the displacement on average.

        Args:
            step: Displacement, ``(..., m)``.
            jacobian: ``(..., m, n)``.
            elapsed_s: dt, ``(...)`` s.
        """
        speed = jacobian @ self.rate_moment @ np.swapaxes(jacobian, -1, -2)
        squared = (step * solve_spd(speed, step[..., None])[..., 0]).sum(-1)
        distance = np.sqrt(np.maximum(squared, 0.0) / step.shape[-1])
        return np.asarray((1.0 - self.clock) * distance + self.clock * elapsed_s)

    def rescaled(self, factor: float) -> "PostureBand":
        """Returns the band with deviations multiplied by ``factor``."""
        return replace(self, factor=self.factor * factor)

    def deviation(self, travelled: Array) -> Array:
        """Returns the standard deviation of each joint after a distance, ``(..., n)`` rad."""
        stationary = np.sqrt((self.factor**2).sum(axis=1))
        growth = np.sqrt(-np.expm1(-2.0 * travelled / self.length))
        return np.asarray(growth[..., None] * stationary)


def fit_band(
    error: Array, distance: Array, elapsed_s: Array, widened: Array, rate_moment: Array
) -> PostureBand:
    """Fits a band to the errors of held-out roll-outs.

    Args:
        error: Predicted minus true posture, ``(samples, n)`` rad.
        distance: Task distance since the measured start, ``(samples,)`` s.
        elapsed_s: Time since then, ``(samples,)`` s, positive.
        widened: Factor the band is widened by there, ``(samples,)``.
        rate_moment: See `PostureBand`.

    Returns:
        The band whose length and share of time make the errors most likely, each joint's marginal
        alone, with the variance that goes with it; deviations are then scaled so that the 90 %
        interval holds 90 %.

    Derived here: with ``g = widened^2 (1 - exp(-2 u / l))`` the errors are ``N(0, g s_j^2)``, so
    ``s_j^2 = mean(e_j^2 / g)`` and minus twice the log likelihood is
    ``sum_j N log s_j^2 + n sum log g`` plus constants.
    """
    best: tuple[float, float, float, Array] | None = None
    for clock in CLOCKS:
        u = np.maximum((1.0 - clock) * distance + clock * elapsed_s, _LEAST)
        for length in LENGTHS:
            growth = widened**2 * -np.expm1(-2.0 * u / length)
            scaled = error / np.sqrt(growth)[:, None]
            variance = np.maximum((scaled**2).mean(axis=0), 1e-12)
            cost = len(error) * np.log(variance).sum() + error.shape[1] * np.log(growth).sum()
            if best is None or cost < best[0]:
                best = (float(cost), float(length), clock, scaled)
    assert best is not None
    _, length, clock, scaled = best
    covariance = scaled.T @ scaled / len(scaled)
    diagonal = np.maximum(np.diagonal(covariance), 1e-12)
    covariance = (1 - _DIAGONAL_SHARE) * covariance + np.diag(
        _DIAGONAL_SHARE * diagonal + 1e-9 * diagonal.mean()
    )
    ratio = float(np.quantile(np.abs(scaled) / np.sqrt(diagonal), 0.9)) / NINETY
    factor = np.asarray(np.linalg.cholesky(covariance) * ratio, dtype=np.float64)
    return PostureBand(factor, length, rate_moment, clock)
