"""The motion that markers show, and how well a person's model meets them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from human.model import Array, HumanModel, IntArray
from human.motion import UNSEEN, Motion

Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class FittedMarkers:
    """A person's motion fitted to markers; what `human.markers.fit_markers` returns.

    Attributes:
        model: the person.
        motion: configurations and derivatives of the frames that could be fitted, the others left
            out. Its flags: ``limit_active`` (some joint rests on its limit), ``near_singular``
            (a middle axis within 5 degrees of 90: the joint turns as it should, how its outer two
            angles share that is uncertain), ``bridged`` (some
            angle or the whole frame was carried over a short gap), ``unseen`` (some angle that the
            recording shows elsewhere was not shown for longer), ``unseen <segment>`` (the same of
            one segment, or it is never shown although the body has markers on it), ``outlier``
            (some marker was not believed), ``gap`` and ``weak_derivative`` of
            `human.differentiate`.
        frame: ``(frames,)`` place of each of the motion's frames in the recording.
        marker_names: ``markers`` names in the order of the residuals.
        residual_m: ``(frames, markers)`` m, from the marker to where the model has it; zero where
            the marker is unseen.
        outlier: ``(frames, markers)`` seen but not believed: exchanged with another, or jumped.
        held: ``(frames, n_dof)`` angles that no marker determined on that frame: interpolated,
            or kept near a reference.
        angle_sd_rad: ``(n_dof,)`` rad, typical standard deviation of each angle, from the trust in
            the markers and what was assumed where they say little.
        unobserved_dofs: degrees of freedom that no marker determines on any frame.
        notes: what was assumed or noticed, in words.
    """

    model: HumanModel
    motion: Motion
    frame: IntArray
    marker_names: tuple[str, ...]
    residual_m: Array
    outlier: Flags
    held: Flags
    angle_sd_rad: Array
    unobserved_dofs: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def rms_m(self) -> float:
        """Root mean square of the residuals of the markers that were believed, m."""
        squares = self.residual_m[(self.residual_m > 0.0) & ~self.outlier] ** 2
        return float(np.sqrt(np.mean(squares))) if squares.size else 0.0

    def marker_rms_m(self) -> dict[str, float]:
        """Returns the root mean square residual of each marker where it was seen and believed."""
        counted = (self.residual_m > 0.0) & ~self.outlier
        square = np.sum(np.where(counted, self.residual_m, 0.0) ** 2, axis=0)
        return {
            name: float(np.sqrt(s / max(n, 1)))
            for name, s, n in zip(self.marker_names, square, np.sum(counted, axis=0), strict=True)
        }

    def summary(self) -> dict[str, Any]:
        """Returns the figures a reader wants first, ready for JSON."""
        per_marker = self.marker_rms_m()
        worst = sorted(per_marker, key=per_marker.__getitem__, reverse=True)[:5]
        return {
            "frames": len(self.motion),
            "marker_rms_m": self.rms_m,
            "worst_markers_rms_m": {name: per_marker[name] for name in worst},
            "frames_by_flag": {
                name: int(np.count_nonzero(flag))
                for name, flag in self.motion.flags.items()
                if np.any(flag) or not name.startswith(UNSEEN)
            },
            "outliers": {
                name: int(n)
                for name, n in zip(self.marker_names, np.sum(self.outlier, axis=0), strict=True)
                if n
            },
            "unobserved_dofs": list(self.unobserved_dofs),
            "notes": list(self.notes),
        }
