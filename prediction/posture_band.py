"""How a person's posture strays from the predicted one, and comes back, along the way.

Independent noise at every step averages away: a band made of it is far too narrow. People deviate
coherently: an elbow carried high stays high for a while. The deviation is an Ornstein-Uhlenbeck
process in travelled task distance, so it does not grow while the hand rests and does not grow
without end while it moves.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from prediction.small_systems import solve_spd

Array = NDArray[np.float64]

#: Correlation lengths tried, in units of `travelled` (about seconds at demonstrated speed).
LENGTHS = np.geomspace(0.1, 8.0, 15)
#: Share of the diagonal in the fitted covariance: few stretches say little about correlations.
_DIAGONAL_SHARE = 0.2


@dataclass(frozen=True, slots=True)
class PostureBand:
    """Deviation of posture as a process in travelled distance u.

    ``delta(0) = 0`` and ``delta(u + du) = rho delta(u) + sqrt(1 - rho^2) L xi`` with
    ``rho = exp(-du / length)``, so ``cov delta(u) = (1 - exp(-2 u / length)) L L'``.

    Attributes:
        factor: L, ``(n, n)`` rad.
        length: Correlation length.
        rate_moment: Second moment of demonstrated joint velocities, ``(n, n)`` (rad/s)^2; the unit
            of travelled distance.
    """

    factor: Array
    length: float
    rate_moment: Array

    def travelled(self, step: Array, jacobian: Array) -> Array:
        """Returns the task distance of a hand displacement, ``(...)``, s at demonstrated speed.

        ``sqrt(dx' (J C J')^-1 dx / m)`` with C the demonstrated velocity moment: how long the
        person would take on average.

        Args:
            step: ``(..., m)``.
            jacobian: ``(..., m, n)``.
        """
        speed = jacobian @ self.rate_moment @ np.swapaxes(jacobian, -1, -2)
        squared = (step * solve_spd(speed, step[..., None])[..., 0]).sum(-1)
        return np.asarray(np.sqrt(np.maximum(squared, 0.0) / step.shape[-1]))

    def rescaled(self, factor: float) -> "PostureBand":
        """Returns the band with deviations multiplied by ``factor``."""
        return replace(self, factor=self.factor * factor)

    def deviation(self, travelled: Array) -> Array:
        """Returns the standard deviation of each joint after a distance, ``(..., n)`` rad."""
        stationary = np.sqrt((self.factor**2).sum(axis=1))
        growth = np.sqrt(-np.expm1(-2.0 * travelled / self.length))
        return np.asarray(growth[..., None] * stationary)


def fit_band(error: Array, travelled: Array, widened: Array, rate_moment: Array) -> PostureBand:
    """Fits a band to the errors of held-out roll-outs.

    Args:
        error: Predicted minus true posture, ``(samples, n)`` rad.
        travelled: Task distance since the measured start, ``(samples,)``, positive.
        widened: Factor the band is widened by there, ``(samples,)``.
        rate_moment: See `PostureBand`.

    Returns:
        The band whose length makes the errors most likely, each joint's marginal alone, with the
        variance that goes with it; deviations are then scaled so that the 90 % interval holds 90 %.

    Derived here: with ``g = widened^2 (1 - exp(-2 u / l))`` the errors are ``N(0, g s_j^2)``, so
    ``s_j^2 = mean(e_j^2 / g)`` and minus twice the log likelihood is
    ``sum_j N log s_j^2 + n sum log g`` plus constants.
    """
    best: tuple[float, float, Array] | None = None
    for length in LENGTHS:
        growth = widened**2 * -np.expm1(-2.0 * travelled / length)
        scaled = error / np.sqrt(growth)[:, None]
        variance = np.maximum((scaled**2).mean(axis=0), 1e-12)
        cost = len(error) * np.log(variance).sum() + error.shape[1] * np.log(growth).sum()
        if best is None or cost < best[0]:
            best = (float(cost), float(length), scaled)
    assert best is not None
    _, length, scaled = best
    covariance = scaled.T @ scaled / len(scaled)
    diagonal = np.maximum(np.diagonal(covariance), 1e-12)
    covariance = (1 - _DIAGONAL_SHARE) * covariance + np.diag(
        _DIAGONAL_SHARE * diagonal + 1e-9 * diagonal.mean()
    )
    ratio = float(np.quantile(np.abs(scaled) / np.sqrt(diagonal), 0.9)) / 1.6448536269514722
    factor = np.asarray(np.linalg.cholesky(covariance) * ratio, dtype=np.float64)
    return PostureBand(factor, length, rate_moment)
