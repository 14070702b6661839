"""The multivariate t distribution, centred at zero: densities and scatter matrices."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, stdtrit

Array = NDArray[np.float64]

#: Half the width of a central 90 % interval of a Gaussian, in standard deviations.
NINETY = 1.6448536269514722
#: Degrees of freedom tried for the tails of a law.
DEGREES = (3.0, 4.0, 6.0, 10.0, 20.0)
_ROUNDS = 200
_TOLERANCE = 1e-10


def student_t_log_density(residual: Array, covariance: Array, degrees: float) -> Array:
    """Returns the log density of a t distribution of given covariance.

    Args:
        residual: ``(..., d)``.
        covariance: ``(..., d, d)``: its covariance, not its scale matrix.
        degrees: Degrees of freedom, more than 2.

    Returns:
        ``(...)`` nats.

    Source: the textbook density; the scale matrix is ``(nu - 2) / nu`` of the covariance.
    """
    size = residual.shape[-1]
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, residual[..., None])[..., 0]
    log_det = np.log(np.diagonal(factor, axis1=-2, axis2=-1)).sum(-1)
    squared = (white**2).sum(-1) / (degrees - 2.0)
    constant = gammaln(0.5 * (degrees + size)) - gammaln(0.5 * degrees)
    constant -= 0.5 * size * np.log((degrees - 2.0) * np.pi)
    return np.asarray(constant - log_det - 0.5 * (degrees + size) * np.log1p(squared))


def ninety(degrees: float) -> float:
    """Returns half the width of the central 90 % interval of a t, in its standard deviations.

    Heavy tails take most of the variance, so the interval is narrower than a Gaussian's: 1.36 for
    three degrees of freedom. Each coordinate of a multivariate t has the degrees of the whole.

    Args:
        degrees: Degrees of freedom, more than 2; infinite for a Gaussian.
    """
    if np.isinf(degrees):
        return NINETY
    return float(stdtrit(degrees, 0.95) * np.sqrt((degrees - 2.0) / degrees))


def scatter(samples: Array, degrees: float) -> Array:
    """Returns the most likely scatter matrix of a centred t, ``(d, d)``.

    Args:
        samples: ``(N, d)``, more than d of them, spanning all directions.
        degrees: Degrees of freedom.

    Source: the EM of Liu and Rubin 1995 for known degrees of freedom and mean.
    """
    size = samples.shape[1]
    out = samples.T @ samples / len(samples)
    for _ in range(_ROUNDS):
        ridge = 1e-9 * np.diagonal(out).mean() * np.eye(size)
        squared = (samples * np.linalg.solve(out + ridge, samples.T).T).sum(axis=1)
        weight = (degrees + size) / (degrees + squared)
        last, out = out, (weight[:, None] * samples).T @ samples / len(samples)
        if np.abs(out - last).max() <= _TOLERANCE * np.abs(out).max():
            break
    return np.asarray(out)


def most_likely_tails(white: Array, degrees: Sequence[float] = DEGREES) -> tuple[float, float]:
    """Returns how heavy the tails of residuals are and what their variance is.

    Args:
        white: Residuals that a Gaussian law calls independent standard normal, ``(N, d)``.
        degrees: Degrees of freedom tried.

    Returns:
        The most likely degrees of freedom, infinite if a Gaussian is as likely, and the factor on
        the covariance that goes with them.

    Derived here: for known degrees the most likely scale solves
    ``s = mean (nu + d) / (nu + |w|^2 / s) |w|^2 / d``; it is iterated. The covariance is
    ``nu / (nu - 2)`` of it.
    """
    size = white.shape[1]
    squared = (white**2).sum(axis=1)
    factor = float(squared.mean() / size)
    likelihood = -0.5 * size * (np.log(2.0 * np.pi * factor) + 1.0)
    best = (likelihood, np.inf, factor)
    for nu in degrees:
        scale = factor
        for _ in range(_ROUNDS):
            last, scale = scale, float(((nu + size) / (nu + squared / scale) * squared).mean())
            scale /= size
            if abs(scale - last) <= 1e-6 * last:
                break
        covariance = nu / (nu - 2.0) * scale
        # In units of its own deviation the covariance is the identity.
        density = student_t_log_density(white / np.sqrt(covariance), np.eye(size), nu)
        likelihood = float(density.mean()) - 0.5 * size * np.log(covariance)
        if likelihood > best[0]:
            best = (likelihood, nu, covariance)
    return best[1], best[2]
