"""The paper's own score of W: how likely the training set is under the process fitted to it.

It is kept to reproduce the paper and for nothing else. A process that has seen a sample predicts
it whatever W is, so the score hardly depends on W, and what it prefers is not the person's.

For each W the k processes are independent and their hyper-parameters those of the greatest marginal
likelihood, as in the paper; one kernel serves them all.

Derived here: at a training input the mean misses its target by ``rho A E`` and the variance, noise
included, is ``rho (2 - rho A_ii)`` in units of each coordinate's own ``E_j' A E_j / N``.

Source: Vianello et al. 2021, section V-B, ``S(W)``; with the logarithm, without which the mean is
that of the few samples predicted best, and up to terms that do not depend on W.
"""

import numpy as np
from numpy.typing import NDArray

from prediction.search.marginal_likelihood import FastEngine, inverse_and_log_det

Array = NDArray[np.float64]


class InSampleEngine(FastEngine):
    """Scores W by the density of the training set; the kernel is still that of `FastEngine`."""

    def scorer(self, theta: Array) -> "InSampleScorer":
        """See `LikelihoodEngine.scorer`; the noise ratio is that of theta."""
        A, _ = inverse_and_log_det(self.noisy(self.gram(theta), theta))
        return InSampleScorer(A, float(np.exp(theta[-1])), self.constant_mean)


class InSampleScorer:
    """Mean log density of training targets.

    Args:
        precision: A, ``(N, N)``.
        noise: rho.
        constant_mean: Whether the mean is at its optimum, or zero.
    """

    def __init__(self, precision: Array, noise: float, constant_mean: bool) -> None:
        """Keeps them."""
        self._precision, self._noise = precision, noise
        self._variance = noise * (2.0 - noise * np.diagonal(precision))
        self._one = precision.sum(axis=1) if constant_mean else None

    def scores(self, targets: Array) -> Array:
        """See `TargetScorer.scores`."""
        residual, solved = targets, np.matmul(self._precision, targets)
        if self._one is not None:
            mean = (np.matmul(self._one, targets) / self._one.sum())[:, None, :]
            residual, solved = targets - mean, solved - self._one[:, None] * mean
        scale = (residual * solved).mean(axis=1)
        variance = scale[:, None, :] * self._variance[:, None]
        missed = (self._noise * solved) ** 2 / variance
        return np.asarray(-0.5 * (np.log(2 * np.pi * variance) + missed).sum(axis=2).mean(axis=1))
