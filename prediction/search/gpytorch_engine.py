"""The reference engine: the same marginal likelihood by gpytorch, exact Cholesky, float64.

Slow, and the measure the fast engine is held to. Imported only when it is asked for, so that torch
is needed neither to predict nor to train with the fast engine.
"""

from typing import Any

import gpytorch
import numpy as np
import torch
from numpy.typing import NDArray

from prediction.laws.kernels import InputScaling
from prediction.search.marginal_likelihood import LOG_NOISE_BOUNDS, TargetScorer

Array = NDArray[np.float64]


class GpytorchEngine:
    """Exact likelihood through gpytorch; `FastEngine` computes the same number.

    Args:
        scaling: Input scaling.
        q: Training postures, ``(N, n)``.
        xdot: Training hand velocities, ``(N, m)``.
    """

    noise_bounds: tuple[float, float] = LOG_NOISE_BOUNDS

    def __init__(self, scaling: InputScaling, q: Array, xdot: Array) -> None:
        """Keeps the inputs; length-scales act on them later, so that torch can differentiate."""
        plain = scaling.inputs(q, xdot, np.zeros(scaling.scales))
        self._inputs = torch.tensor(plain, dtype=torch.float64)
        self._joints, self._scales = q.shape[1], scaling.scales
        self._constant_mean = scaling.constant_mean
        self._kernel = gpytorch.kernels.RBFKernel().double()
        self._kernel.lengthscale = torch.tensor(1.0, dtype=torch.float64)
        self._kernel.requires_grad_(False)

    def score(self, theta: Any, Y: Any) -> Any:
        """Returns the log likelihood a sample, differentiable in ``theta`` and ``Y``.

        Mean and output covariance are set to their optimum and held, which leaves both derivatives
        as they are: at an optimum they add nothing.
        """
        count, outputs = Y.shape
        joints = theta[0].expand(self._joints)
        velocity = theta[self._scales - 1].expand(self._inputs.shape[1] - self._joints)
        inputs = self._inputs / torch.cat([joints, velocity]).exp()
        K = self._kernel(inputs).to_dense() + theta[-1].exp() * torch.eye(count).double()
        with torch.no_grad():
            one = torch.ones(count, 1, dtype=torch.float64)
            solved = torch.cholesky_solve(torch.cat([Y, one], dim=1), torch.linalg.cholesky(K))
            mean = (one.T @ solved[:, :-1]) / (one.T @ solved[:, -1:])
            mean = mean if self._constant_mean else torch.zeros_like(mean)
            S = (Y - mean).T @ (solved[:, :-1] - solved[:, -1:] @ mean) / count
            root = torch.linalg.cholesky(0.5 * (S + S.T))
        white = torch.linalg.solve_triangular(root, (Y - mean).T, upper=False)
        process = gpytorch.distributions.MultivariateNormal(
            torch.zeros(outputs, count, dtype=torch.float64), K.expand(outputs, count, count)
        )
        with (
            gpytorch.settings.fast_computations(False, False, False),
            gpytorch.settings.cholesky_jitter(double_value=0.0),
        ):
            total = process.log_prob(white).sum()
        return total / count - torch.log(torch.diagonal(root)).sum()

    def log_likelihood(self, theta: Array, Y: Array) -> float:
        """See `LikelihoodEngine.log_likelihood`."""
        with torch.no_grad():
            return float(self.score(torch.tensor(theta), torch.tensor(Y)))

    def slopes(self, theta: Array, Y: Array) -> tuple[float, Array, Array]:
        """See `LikelihoodEngine.slopes`, by automatic differentiation."""
        free = torch.tensor(theta, requires_grad=True)
        targets = torch.tensor(Y, requires_grad=True)
        try:
            value = self.score(free, targets)
        except torch.linalg.LinAlgError as error:  # type: ignore[attr-defined]
            raise np.linalg.LinAlgError("the kernel matrix is singular") from error
        value.backward()
        assert free.grad is not None and targets.grad is not None
        return float(value.detach()), _array(free.grad), _array(targets.grad)

    def scorer(self, theta: Array) -> TargetScorer:
        """See `LikelihoodEngine.scorer`."""
        return GpytorchScorer(self, theta)


class GpytorchScorer:
    """Scores targets one by one at a fixed kernel and noise ratio."""

    def __init__(self, engine: GpytorchEngine, theta: Array) -> None:
        """Keeps both."""
        self._engine, self._theta = engine, theta

    def scores(self, targets: Array) -> Array:
        """See `TargetScorer.scores`; the noise ratio is not profiled here."""
        return np.array([self._engine.log_likelihood(self._theta, Y) for Y in targets])


def _array(tensor: torch.Tensor) -> Array:
    return np.array(tensor.numpy(), dtype=np.float64)
