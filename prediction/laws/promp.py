"""ProMP: one probabilistic movement primitive of the demonstrations, held to the hand."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from prediction.demonstrations import Demonstrations
from prediction.laws.cov_ik import SHRINKAGE
from prediction.laws.joint_gaussian import JointGaussian
from prediction.laws.moment_fit import MomentFit
from prediction.laws.null_space import NullSpaceBasis

Array = NDArray[np.float64]

#: Basis functions over the phase, and phases the primitive is written out at.
_BASIS = 10
_PHASES = 50
#: Takes are cut into pieces of about this length when there are fewer than `_TAKES` of them, s.
_PIECE_S = 4.0
_TAKES = 4
_RIDGE = 1e-3


@dataclass(frozen=True, slots=True)
class ProMp(MomentFit, JointGaussian):
    """The joint velocity of one repeated movement at a phase, given that the hand moves as led.

    The phase is that at which the primitive's posture is nearest, in its own spread: a planner
    sends a hand path and nobody says how far along a movement it is. Use it to compare with; it
    presumes that everything is one movement, and is inaccurate wherever that is not so.

    Attributes:
        postures: Mean posture by phase, ``(P, n)`` rad.
        whitening: ``(n, n)``: distance of postures is the norm of ``whitening @ (q - posture)``.
        rates: Mean joint velocity by phase, ``(P, n)`` rad/s.
        spreads: Its covariance by phase, ``(P, n, n)``.
        scale: Calibration of the variance.
        reference: Null-space axes.

    Source: Paraschos et al. 2013 (the primitive), 2017 (joint space conditioned on task space).
    Theirs conditions on a primitive of the hand; here the hand is known, which is stronger.
    """

    name: ClassVar[str] = "promp"

    postures: Array
    whitening: Array
    rates: Array
    spreads: Array
    scale: float
    reference: NullSpaceBasis

    @classmethod
    def of_moments(cls, demonstrations: Demonstrations) -> Self:
        """Takes the moments."""
        both = np.concatenate([demonstrations.q, demonstrations.qdot], axis=1)
        size = demonstrations.q.shape[1]
        weights, left = [], []
        for piece in _pieces(demonstrations):
            time_s = demonstrations.time_s[piece]
            features = _features((time_s - time_s[0]) / (time_s[-1] - time_s[0]))
            gram = features.T @ features + _RIDGE * np.eye(_BASIS)
            weights.append(np.linalg.solve(gram, features.T @ both[piece]))
            left.append(both[piece] - features @ weights[-1])
        stack = np.array(weights)
        noise = np.concatenate(left)
        along = _features(np.linspace(0.0, 1.0, _PHASES))
        mean = along @ stack.mean(axis=0)
        strayed = np.einsum("pb,kbd->kpd", along, stack - stack.mean(axis=0))
        posture = (strayed[..., :size] ** 2).mean(axis=(0, 1)) + (noise[:, :size] ** 2).mean(axis=0)
        rate = strayed[..., size:]
        spread = np.einsum("kpi,kpj->pij", rate, rate) / max(len(stack) - 1, 1)
        spread = spread + noise[:, size:].T @ noise[:, size:] / len(noise)
        diagonal = np.einsum("pii->pi", spread)
        floor = 1e-9 * demonstrations.qdot.var(axis=0).mean()
        spread = spread + (SHRINKAGE * diagonal + floor)[:, :, None] * np.eye(size)
        return cls(
            postures=mean[:, :size],
            whitening=np.diag(1.0 / np.sqrt(posture + 1e-9 * posture.mean() + 1e-18)),
            rates=mean[:, size:],
            spreads=spread,
            scale=1.0,
            reference=NullSpaceBasis.around(demonstrations.jacobian),
        )

    @property
    def weights(self) -> Array:
        """The covariance over all phases."""
        return np.asarray(self.spreads.mean(axis=0))

    def weights_at(self, q: Array) -> Array:
        """The covariance at the phase of each posture."""
        return np.asarray(self.spreads[self.phase(q)])

    def phase(self, q: Array) -> NDArray[np.int64]:
        """Returns which of the phases each posture ``(..., n)`` is nearest to."""
        moved = q @ self.whitening.T
        centres = self.postures @ self.whitening.T
        squared = (centres**2).sum(-1) - 2.0 * moved @ centres.T
        return np.asarray(np.argmin(squared, axis=-1))

    def joint_mean(self, q: Array, xdot: Array) -> Array:
        """The primitive's velocity at the phase."""
        return np.asarray(self.rates[self.phase(q)])

    def joint_variance(self, q: Array, xdot: Array) -> Array:
        """The calibration alone."""
        return np.full(q.shape[:-1], self.scale)

    def rescaled(self, factor: float) -> Self:
        """Multiplies the variance."""
        return replace(self, scale=self.scale * factor)

    def to_arrays(self) -> tuple[dict[str, Array], dict[str, Any]]:
        """Everything."""
        arrays = {
            "postures": self.postures,
            "whitening": self.whitening,
            "rates": self.rates,
            "spreads": self.spreads,
            "rows": self.reference.rows,
            "null": self.reference.null,
        }
        return arrays, {"scale": self.scale}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array], values: Mapping[str, Any]) -> Self:
        """Rebuilds."""
        return cls(
            arrays["postures"],
            arrays["whitening"],
            arrays["rates"],
            arrays["spreads"],
            float(values["scale"]),
            NullSpaceBasis(arrays["rows"], arrays["null"]),
        )


def _pieces(demonstrations: Demonstrations) -> list[NDArray[np.int64]]:
    """Returns the samples of each repetition: the takes, cut if there are few."""
    edges = np.flatnonzero(np.diff(demonstrations.trajectory_id)) + 1
    takes = np.split(np.arange(len(demonstrations)), edges)
    pieces = []
    for take in takes:
        length = float(np.ptp(demonstrations.time_s[take]))
        parts = 1 if len(takes) >= _TAKES else max(1, round(length / _PIECE_S))
        pieces += [part for part in np.array_split(take, parts) if len(part) >= 2]
    # Too short to tell a movement: they would be fitted by anything.
    return [piece for piece in pieces if len(piece) >= _BASIS] or pieces


def _features(phase: Array) -> Array:
    """Normalised radial basis functions ``(..., basis)`` of a phase in [0, 1]."""
    centres = np.linspace(0.0, 1.0, _BASIS)
    raw = np.exp(-0.5 * ((phase[..., None] - centres) * (_BASIS - 1)) ** 2)
    return np.asarray(raw / raw.sum(axis=-1, keepdims=True))
