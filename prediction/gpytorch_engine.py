"""The reference engine: the same marginal likelihood by gpytorch, exact Cholesky, float64.

Slow, and the measure the fast engine is held to. Imported only when it is asked for, so that torch
is needed neither to predict nor to train with the fast engine.
"""

from typing import Any

import gpytorch
import numpy as np
import torch
from numpy.typing import NDArray

from prediction.kernels import InputScaling
from prediction.marginal_likelihood import TargetScorer, clip_theta

Array = NDArray[np.float64]


class GpytorchEngine:
    """Exact likelihood through gpytorch; `FastEngine` computes the same number.

    Args:
        scaling: Input scaling.
        q: Training postures, ``(N, n)``.
        xdot: Training hand velocities, ``(N, m)``.
    """

    def __init__(self, scaling: InputScaling, q: Array, xdot: Array) -> None:
        """Keeps the inputs; length-scales act on them later, so that torch can differentiate."""
        plain = scaling.inputs(q, xdot, np.zeros(scaling.scales))
        self._inputs = torch.tensor(plain, dtype=torch.float64)
        self._joints, self._scales = q.shape[1], scaling.scales
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

    def optimise(self, theta: Array, Y: Array, iterations: int) -> Array:
        """See `LikelihoodEngine.optimise`; L-BFGS on torch's gradient."""
        start = clip_theta(theta)
        free = torch.tensor(start, requires_grad=True)
        targets = torch.tensor(Y)
        search = torch.optim.LBFGS([free], max_iter=iterations, line_search_fn="strong_wolfe")

        def closure() -> Any:
            search.zero_grad()
            loss = -self.score(free, targets)
            loss.backward()
            return loss

        try:
            search.step(closure)  # type: ignore[no-untyped-call]
        except torch.linalg.LinAlgError:  # type: ignore[attr-defined]
            return start  # a trial step left the kernel singular
        best = clip_theta(free.detach().numpy())
        improved = self.log_likelihood(best, Y) >= self.log_likelihood(start, Y)
        return best if improved else start

    def scorer(self, theta: Array) -> TargetScorer:
        """See `LikelihoodEngine.scorer`."""
        return GpytorchScorer(self, theta)


class GpytorchScorer:
    """Scores targets one by one at a fixed kernel and noise ratio."""

    def __init__(self, engine: GpytorchEngine, theta: Array) -> None:
        """Keeps both."""
        self._engine, self._theta = engine, torch.tensor(theta)

    def scores(self, targets: Array) -> Array:
        """See `TargetScorer.scores`; the noise ratio is not profiled here."""
        with torch.no_grad():
            values = [float(self._engine.score(self._theta, torch.tensor(Y))) for Y in targets]
        return np.array(values)

    def score_and_slope(self, target: Array) -> tuple[float, Array]:
        """See `TargetScorer.score_and_slope`, by automatic differentiation."""
        Y = torch.tensor(target, requires_grad=True)
        value = self._engine.score(self._theta, Y)
        value.backward()
        assert Y.grad is not None
        return float(value.detach()), np.array(Y.grad.numpy(), dtype=np.float64)
