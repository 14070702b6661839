"""A Gaussian process over posture and hand velocity, conditioned on demonstrations."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from prediction.errors import UnsupportedMethodError
from prediction.laws.compression import Posterior, compressed_posterior
from prediction.laws.kernels import KERNELS, InputScaling

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Process:
    """Several outputs that share one kernel: ``Y ~ N(1 m', S (x) (K + rho I))``.

    Attributes:
        scaling: Input scaling.
        theta: Log length-scales and log noise ratio.
        prior_mean: Constant mean m, ``(k,)``.
        output_covariance: S, ``(k, k)``.
        posterior: The unit process on its centres.
    """

    scaling: InputScaling
    theta: Array
    prior_mean: Array
    output_covariance: Array
    posterior: Posterior

    @classmethod
    def conditioned(
        cls,
        scaling: InputScaling,
        theta: Array,
        q: Array,
        xdot: Array,
        y: Array,
        *,
        constant_mean: bool,
    ) -> Self:
        """Conditions on samples; mean and S are the most likely ones.

        Args:
            scaling: Input scaling.
            theta: Kernel.
            q: ``(N, n)``.
            xdot: ``(N, m)``.
            y: ``(N, k)``.
            constant_mean: Whether there is a constant mean, or none.
        """
        inputs = scaling.inputs(q, xdot, theta[:-1])
        noise = float(np.exp(theta[-1]))
        both = np.concatenate([y, np.ones((len(y), 1))], axis=1)
        plain = compressed_posterior(inputs, both, noise)
        # A z = (z - K A z) / rho, with K A z the posterior mean at the training inputs
        whitened = (both - plain.mean(inputs)) / noise
        mean = np.zeros(y.shape[1])
        if constant_mean:
            mean = whitened[:, -1] @ y / whitened[:, -1].sum()
        S = (y - mean).T @ (whitened[:, :-1] - whitened[:, -1:] * mean) / len(y)
        weights = plain.mean_weights[:, :-1] - plain.mean_weights[:, -1:] * mean
        posterior = replace(plain, mean_weights=weights)
        return cls(scaling, theta, mean, 0.5 * (S + S.T), posterior)

    def mean(self, q: Array, xdot: Array) -> Array:
        """Returns the mean of the outputs, ``(..., k)``."""
        return np.asarray(self.prior_mean + self.posterior.mean(self._inputs(q, xdot)))

    def variance(self, q: Array, xdot: Array) -> Array:
        """Returns noise and what the demonstrations leave open, in units of S, ``(...)``."""
        return np.asarray(self.posterior.variance(self._inputs(q, xdot)) + np.exp(self.theta[-1]))

    def to_arrays(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Returns everything but the training data."""
        arrays = {
            "theta": self.theta,
            "mean": self.prior_mean,
            "output_covariance": self.output_covariance,
            "input_divisor": self.scaling.divisor,
            "centres": self.posterior.centres,
            "mean_weights": self.posterior.mean_weights,
            "variance_root": self.posterior.variance_root,
        }
        return arrays, {"kernel": self.scaling.kind, "joints": self.scaling.joints}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array], values: Mapping[str, Any]) -> Self:
        """Rebuilds."""
        if values["kernel"] not in KERNELS:
            raise UnsupportedMethodError("kernel", str(values["kernel"]), KERNELS)
        return cls(
            InputScaling(values["kernel"], arrays["input_divisor"], int(values["joints"])),
            arrays["theta"],
            arrays["mean"],
            arrays["output_covariance"],
            Posterior(arrays["centres"], arrays["mean_weights"], arrays["variance_root"]),
        )

    def _inputs(self, q: Array, xdot: Array) -> Array:
        return self.scaling.inputs(q, xdot, self.theta[:-1])
