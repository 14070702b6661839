"""The loop a user of gpytorch writes: for each W a process for each coordinate, trained by Adam."""

import time

import gpytorch
import numpy as np
import torch

from prediction import Demonstrations

#: Steps of Adam that are timed.
MEASURED = 3


def naive_step_seconds(demonstrations: Demonstrations, outputs: int) -> float:
    """Returns the seconds of one step of gpytorch's own loop, for all outputs of one candidate."""
    torch.set_num_threads(1)
    inputs = torch.tensor(np.concatenate([demonstrations.q, demonstrations.xdot], axis=1)).float()
    inputs = (inputs - inputs.mean(0)) / inputs.std(0)

    class Model(gpytorch.models.ExactGP):  # type: ignore[misc]
        def __init__(self, targets: object, likelihood: object) -> None:
            super().__init__(inputs, targets, likelihood)
            self.mean_module = gpytorch.means.ConstantMean()
            self.covar_module = gpytorch.kernels.ScaleKernel(gpytorch.kernels.RBFKernel())

        def forward(self, x: object) -> object:
            return gpytorch.distributions.MultivariateNormal(
                self.mean_module(x), self.covar_module(x)
            )

    targets = torch.tensor(demonstrations.qdot[:, 0]).float()
    likelihood = gpytorch.likelihoods.GaussianLikelihood()
    model = Model(targets, likelihood)
    model.train()
    likelihood.train()
    search = torch.optim.Adam(model.parameters(), lr=0.1)
    mll = gpytorch.mlls.ExactMarginalLogLikelihood(likelihood, model)

    start = time.process_time()
    for _ in range(MEASURED):
        search.zero_grad()
        (-mll(model(inputs), targets)).backward()
        search.step()
    return outputs * (time.process_time() - start) / MEASURED
