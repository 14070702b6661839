"""LoCov-IK: Cov-IK whose covariance is that of the demonstrations near the posture."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from prediction.demonstrations import Demonstrations
from prediction.laws.cov_ik import SHRINKAGE, shrunk_moment
from prediction.laws.null_space import NullSpaceBasis, NullSpaceFrame, weighted_pseudo_inverse
from prediction.laws.predictor import Predictor, Progress, ShouldStop, check_stop
from prediction.laws.small_systems import solve_spd
from prediction.laws.student_t import ninety, scatter, student_t_log_density

Array = NDArray[np.float64]

#: Most demonstrated samples kept as centres; every prediction visits all of them.
MAX_CENTRES = 900
#: Degrees of freedom tried for the noise.
DEGREES = (2.0, 4.0, 10.0)
#: Where the search of log width and log fallback weight starts; medians on human arm motion.
_START = (-0.75, 3.0)
_BLOCKS = 4
_EVALUATIONS = 40


@dataclass(frozen=True, slots=True)
class LoCovIk(Predictor):
    """How the joints move together depends on the posture; far from what was seen it is `CovIk`.

    ``S(q) = (c sum_i k_i dq_i dq_i' + n0 C) / (sum_i k_i + n0)`` with
    ``k_i = exp(-|q - q_i|^2 / (2 width))`` over the demonstrations, C their shrunk second moment
    and ``c = tr C / tr(mean dq dq')``; S takes the place of W. What the hand leaves
    open scatters as a multivariate t: people are exact most of the time and far off now and then.

    Attributes:
        centres: Demonstrated postures, ``(N, n)`` rad.
        rates: Their joint velocities, ``(N, n)`` rad/s.
        fallback: C, ``(n, n)``.
        width: Squared kernel width, rad^2.
        prior_count: n0, in samples: how many near ones outweigh C.
        scatter: Scatter matrix of joint velocities, ``(n, n)``.
        degrees: Degrees of freedom of the t.
        scale: Calibration of the variance.
        reference: Null-space axes.

    Source: `docs/theory/prediction.md`. Derived from Gaussian conditioning (eq. 3 of Vianello et
    al. 2021 with W = S(q)) and the conditional of a multivariate t.
    """

    name: ClassVar[str] = "locov-ik"

    centres: Array
    rates: Array
    fallback: Array
    width: float
    prior_count: float
    scatter: Array
    degrees: float
    scale: float
    reference: NullSpaceBasis

    @classmethod
    def fit(
        cls,
        demonstrations: Demonstrations,
        rng: np.random.Generator,
        *,
        progress: Progress | None = None,
        should_stop: ShouldStop | None = None,
    ) -> Self:
        """Finds width, fallback weight and degrees of freedom on blocks left out in turn.

        Contiguous blocks, not single samples: neighbours in time repeat each other. ``rng`` is not
        used.

        Raises:
            DemonstrationError: Too few samples.
            TrainingCancelledError: ``should_stop`` said so.
        """
        check_stop(should_stop)
        demonstrations.check_enough()
        kept = demonstrations.thinned(MAX_CENTRES)
        spread = max(float(kept.q.var(axis=0).mean()), 1e-12)
        search = _HeldOut(kept)
        best: tuple[float, float, float, float] | None = None
        done = 0

        def cost(parameters: Array) -> float:
            nonlocal best, done
            check_stop(should_stop)
            width, count = spread * np.exp(parameters[0]), float(np.exp(parameters[1]))
            scores = search.scores(width, count)
            index = int(np.argmax(scores))
            if best is None or scores[index] > best[0]:
                best = (scores[index], width, count, DEGREES[index])
            done += 1
            if progress is not None:
                progress("fitting the local covariance", min(done / _EVALUATIONS, 1.0), best[0])
            return -scores[index]

        minimize(
            cost,
            np.array(_START),
            method="Nelder-Mead",
            options={"maxfev": _EVALUATIONS, "xatol": 0.1, "fatol": 1e-3},
        )
        assert best is not None
        return cls._of(kept, best[1], best[2], best[3])

    @classmethod
    def _of(cls, kept: Demonstrations, width: float, count: float, degrees: float) -> Self:
        return cls(
            centres=kept.q,
            rates=kept.qdot,
            fallback=shrunk_moment(kept.qdot),
            width=width,
            prior_count=count,
            scatter=_shrunk(scatter(kept.qdot, degrees)),
            degrees=degrees,
            scale=1.0,
            reference=NullSpaceBasis.around(kept.jacobian),
        )

    @property
    def ninety(self) -> float:
        """That of the t that the hand leaves."""
        return ninety(self.degrees + len(self.reference.rows))

    @property
    def basis(self) -> NullSpaceBasis:
        """The null-space axes."""
        return self.reference

    @property
    def weights(self) -> Array:
        """W where nothing was demonstrated: `CovIk`'s."""
        return self.fallback

    def weights_at(self, q: Array) -> Array:
        """S(q), ``(..., n, n)``."""
        flat = q.reshape(-1, q.shape[-1])
        kernel = np.exp(-0.5 * _squared(flat, self.centres) / self.width)
        local = _local(kernel, _packed(self.rates), self.fallback, self.prior_count)
        return local.reshape(*q.shape, q.shape[-1])

    def null_mean(self, q: Array, xdot: Array, frame: NullSpaceFrame) -> Array:
        """Zero: the whole mean is in the weights."""
        return np.zeros((*q.shape[:-1], self.reference.redundancy))

    def null_covariance(
        self, q: Array, xdot: Array, frame: NullSpaceFrame, jacobian: Array
    ) -> Array:
        """What the hand leaves open; the faster the hand, the more: its speed tells the scale.

        Derived here: given the hand's part u of a ``t_nu(0, Q)`` velocity, ``V' (I - K J) dq`` is a
        t with ``nu + m`` degrees of freedom and scale ``(nu + d) / (nu + m) V' (I - K J) Q (I - K
        J)' V``, ``d = u' (J Q J')^-1 u``; this is its covariance.
        """
        spread = _spread(self.weights_at(q), self.scatter, frame.matrix(), jacobian)
        distance = _distance(self.scatter, jacobian, xdot)
        task = jacobian.shape[-2]
        factor = (self.degrees + distance) / (self.degrees + task - 2.0)
        return np.asarray(self.scale * factor[..., None, None] * spread)

    def null_log_density(self, residual: Array, covariance: Array) -> Array:
        """The t's, with the covariance of `null_covariance`."""
        task = self.reference.rows.shape[0]
        return student_t_log_density(residual, covariance, self.degrees + task)

    def null_velocity(self, q: Array, xdot: Array, jacobian: Array) -> Array:
        """Zero, without working out the basis."""
        return np.zeros_like(q)

    def rescaled(self, factor: float) -> Self:
        """Multiplies the variance; S and so the mean stay."""
        return replace(self, scale=self.scale * factor)

    def refitted(self, demonstrations: Demonstrations) -> Self:
        """Takes the local covariance of other demonstrations, however few."""
        kept = demonstrations.thinned(MAX_CENTRES)
        return self._of(kept, self.width, self.prior_count, self.degrees)

    def to_arrays(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Everything."""
        arrays = {
            "centres": self.centres,
            "rates": self.rates,
            "fallback": self.fallback,
            "scatter": self.scatter,
            "rows": self.reference.rows,
            "null": self.reference.null,
        }
        values = {
            "width": self.width,
            "prior_count": self.prior_count,
            "degrees": self.degrees,
            "scale": self.scale,
        }
        return arrays, values

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array], values: Mapping[str, Any]) -> Self:
        """Rebuilds."""
        return cls(
            centres=arrays["centres"],
            rates=arrays["rates"],
            fallback=arrays["fallback"],
            width=float(values["width"]),
            prior_count=float(values["prior_count"]),
            scatter=arrays["scatter"],
            degrees=float(values["degrees"]),
            scale=float(values["scale"]),
            reference=NullSpaceBasis(arrays["rows"], arrays["null"]),
        )


class _HeldOut:
    """Density of contiguous blocks under the local covariance of the others."""

    def __init__(self, demonstrations: Demonstrations) -> None:
        self.demonstrations = demonstrations
        frame = NullSpaceBasis.around(demonstrations.jacobian).frame(demonstrations.jacobian)
        self.axes = frame.matrix()
        self.packed = _packed(demonstrations.qdot)
        self.fallback = shrunk_moment(demonstrations.qdot)
        self.squared = _squared(demonstrations.q, demonstrations.q)
        self.apart = np.ones(self.squared.shape, dtype=np.bool_)
        for block in demonstrations.blocks(_BLOCKS):
            self.apart[np.ix_(block, block)] = False
        self.scatters = [_shrunk(scatter(demonstrations.qdot, nu)) for nu in DEGREES]
        self.distances = [
            _distance(Q, demonstrations.jacobian, demonstrations.xdot) for Q in self.scatters
        ]

    def scores(self, width: float, prior_count: float) -> list[float]:
        """Returns the mean log density of the null-space coordinates, for each of `DEGREES`."""
        data = self.demonstrations
        kernel = np.exp(-0.5 * self.squared / width) * self.apart
        weights = _local(kernel, self.packed, self.fallback, prior_count)
        gain = weighted_pseudo_inverse(weights, data.jacobian)
        free = data.qdot - np.einsum("tnm,tm->tn", gain, data.xdot)
        y = np.einsum("tnk,tn->tk", self.axes, free)
        out = []
        task = data.jacobian.shape[1]
        for degrees, Q, distance in zip(DEGREES, self.scatters, self.distances, strict=True):
            spread = _spread(weights, Q, self.axes, data.jacobian)
            factor = (degrees + distance) / (degrees + task - 2.0)
            covariance = factor[:, None, None] * spread
            out.append(float(student_t_log_density(y, covariance, degrees + task).mean()))
        return out


def _shrunk(moment: Array) -> Array:
    return np.asarray(moment + SHRINKAGE * np.diag(np.diagonal(moment)))


def _squared(a: Array, b: Array) -> Array:
    """Squared distances ``(A, B)`` of rows."""
    return np.asarray(np.maximum((a**2).sum(-1)[:, None] + (b**2).sum(-1) - 2.0 * a @ b.T, 0.0))


def _packed(rates: Array) -> Array:
    """Upper triangles of ``dq dq'``, ``(N, n (n + 1) / 2)``: half the work of whole ones."""
    rows, columns = np.triu_indices(rates.shape[1])
    return np.asarray(rates[:, rows] * rates[:, columns])


def _local(kernel: Array, packed: Array, fallback: Array, prior_count: float) -> Array:
    """Returns S at postures with these kernel weights ``(B, N)``, ``(B, n, n)``."""
    size = len(fallback)
    rows, columns = np.triu_indices(size)
    # As much velocity in all as the shrunk moment has, whose diagonal is raised.
    mixed = (1.0 + SHRINKAGE) * (kernel @ packed) + prior_count * fallback[rows, columns]
    mixed /= (kernel.sum(axis=1) + prior_count)[:, None]
    place = np.empty((size, size), dtype=np.int64)
    place[rows, columns] = place[columns, rows] = np.arange(len(rows))
    return np.take(mixed, place.ravel(), axis=1).reshape(-1, size, size)


def _spread(weights: Array, scatter_matrix: Array, axes: Array, jacobian: Array) -> Array:
    """Returns ``V' (I - K J) Q (I - K J)' V``, ``(..., k, k)``."""
    gain = weighted_pseudo_inverse(weights, jacobian)
    turned = np.swapaxes(axes, -1, -2)
    left = turned - (turned @ gain) @ jacobian
    spread = left @ scatter_matrix @ np.swapaxes(left, -1, -2)
    return np.asarray(0.5 * (spread + np.swapaxes(spread, -1, -2)))


def _distance(scatter_matrix: Array, jacobian: Array, xdot: Array) -> Array:
    """Returns ``u' (J Q J')^-1 u``, ``(...)``."""
    gram = jacobian @ scatter_matrix @ np.swapaxes(jacobian, -1, -2)
    return np.asarray((xdot * solve_spd(gram, xdot[..., None])[..., 0]).sum(-1))
