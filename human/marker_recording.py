"""Marker trajectories and force plates as read: house units, z up, gaps as masks, never NaN.

Markers and plates keep their own clocks: plates are sampled faster than cameras, and files of
separate devices need not start together.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from human.errors import RecordingError
from human.mapped_arrays import forget_pages
from human.recording import ReadingReport

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_GRAVITY = 9.81
_CHECKED_AT_ONCE = 4096
#: Forces and moments beyond this are no measurement, in whatever unit; their squares overflow.
_MOST = 1e9
#: Below this vertical force the point of application is noise divided by noise.
_LEAST_LOAD_N = 20.0


@dataclass(frozen=True, slots=True)
class MarkerEvent:
    """An instant that the file names, such as a foot strike on one side (``context``)."""

    time_s: float
    label: str
    context: str = ""


@dataclass(frozen=True, slots=True)
class ForcePlate:
    """One plate.

    Attributes:
        name: as in the file, or its number from 1.
        origin: ``(3,)`` point the moments are taken about, world, m.
        surface_height_m: height of the surface, where the force enters.
        corners: ``(4, 3)`` world, m, or None where the file does not say.
    """

    name: str
    origin: Array
    surface_height_m: float
    corners: Array | None = None


@dataclass(frozen=True, slots=True)
class PlateForces:
    """What plates exert on what stands on them, in world axes.

    Attributes:
        time_s: ``(samples,)`` strictly increasing.
        plates: the plates.
        force: ``(samples, plates, 3)`` N.
        moment: ``(samples, plates, 3)`` about each plate's origin, N m.
        report: conversions and findings.

    Raises:
        RecordingError: arrays do not fit each other, are not finite or beyond any unit's reading of
            what a person does, or times do not increase.
    """

    time_s: Array
    plates: tuple[ForcePlate, ...]
    force: Array
    moment: Array
    report: ReadingReport

    def __post_init__(self) -> None:
        """Checks the shapes and that everything is finite."""
        _check_times(self.time_s, "plates")
        expected = (len(self.time_s), len(self.plates), 3)
        for name in ("force", "moment"):
            array = getattr(self, name)
            if array.shape != expected or not np.all(np.isfinite(array)):
                raise RecordingError(
                    f"plates, {name}: expected finite values of shape {expected}, got shape "
                    f"{array.shape} with {int(np.sum(~np.isfinite(array)))} not finite."
                )
            if np.any(np.abs(array) > _MOST):
                k, plate = np.argwhere(np.abs(array) > _MOST)[0, :2].tolist()
                raise RecordingError(
                    f"plate {self.plates[plate].name}, {name} at {self.time_s[k]:.2f} s: expected "
                    f"values of up to {_MOST:g}, got {np.max(np.abs(array[k, plate])):g}. Mend the "
                    "file, or cut the recording there."
                )

    def centres_of_pressure(self, least_n: float = _LEAST_LOAD_N) -> tuple[Array, Array, Mask]:
        """Returns where each force enters and what turns about the vertical there.

        Derived here: about the point at offset d from the origin the moment is M - d x F; d with
        the surface's height and no horizontal moment left is the centre of pressure.

        Args:
            least_n: vertical force (N) below which there is no such point.

        Returns:
            Points ``(samples, plates, 3)`` m, free moments ``(samples, plates)`` N m, and where
            the two mean anything ``(samples, plates)``; both are zero elsewhere.
        """
        valid = np.abs(self.force[..., 2]) >= least_n
        fx, fy, fz = np.moveaxis(self.force, -1, 0)
        fz = np.where(valid, fz, 1.0)
        origin = np.array([plate.origin for plate in self.plates]).reshape(-1, 3)
        height = np.array([plate.surface_height_m for plate in self.plates]) - origin[:, 2]
        dx = (height * fx - self.moment[..., 1]) / fz
        dy = (height * fy + self.moment[..., 0]) / fz
        offset = np.stack([dx, dy, np.broadcast_to(height, dx.shape)], axis=-1)
        free = self.moment[..., 2] - dx * fy + dy * fx
        return np.where(valid[..., None], origin + offset, 0.0), np.where(valid, free, 0.0), valid

    def supported_mass_kg(self) -> float | None:
        """Returns the median mass that the plates carry together while someone stands on them.

        A hint, not a measurement of the person: it includes what they carry, misses what stands
        beside the plates, and a moving body presses more or less than its weight. Samples with
        less than half of the usual greatest load do not count. None when nothing was carried.
        """
        total = np.sum(self.force[..., 2], axis=-1)
        usual = float(np.percentile(total, 95)) if total.size else 0.0
        if usual < _LEAST_LOAD_N:
            return None
        return float(np.median(total[total > usual / 2.0])) / _GRAVITY


@dataclass(frozen=True, slots=True)
class MarkerRecording:
    """Markers over time, with the plates of the same file if it has any.

    Attributes:
        source: file name, without its folder.
        format: ``c3d`` or ``trc``.
        version: of the format, as stated.
        time_s: ``(frames,)`` strictly increasing.
        rate_hz: nominal frame rate.
        marker_names: as in the file, each once.
        position: ``(frames, markers, 3)`` world, m; zero where not seen.
        valid: ``(frames, markers)`` where the marker was seen.
        events: instants named in the file.
        plates: force plates, or None.
        report: conversions, gaps in time, findings.
        digest: SHA-256 of the file.

    Raises:
        RecordingError: arrays do not fit each other or are not finite, or times do not increase.
    """

    source: str
    format: str
    version: str
    time_s: Array
    rate_hz: float
    marker_names: tuple[str, ...]
    position: Array
    valid: Mask
    events: tuple[MarkerEvent, ...]
    plates: PlateForces | None
    report: ReadingReport
    digest: str

    def __post_init__(self) -> None:
        """Checks the shapes and that no position is NaN."""
        _check_times(self.time_s, f"{self.source}, markers")
        expected = (len(self.time_s), len(self.marker_names))
        if self.position.shape != (*expected, 3) or self.valid.shape != expected:
            raise RecordingError(
                f"{self.source}, markers: expected positions of shape {(*expected, 3)} and a mask "
                f"of {expected}, got {self.position.shape} and {self.valid.shape}."
            )
        strange = 0
        # Part by part: positions of a long recording lie in a file.
        for start in range(0, len(self.position), _CHECKED_AT_ONCE):
            part = self.position[start : start + _CHECKED_AT_ONCE]
            strange += int(np.count_nonzero(~np.isfinite(part)))
            forget_pages(part)
        if strange:
            raise RecordingError(
                f"{self.source}, markers: expected finite positions, got {strange} values that are "
                "not."
            )

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.time_s)

    def missing(self) -> dict[str, int]:
        """Returns the number of unseen frames of each marker that has any."""
        counts = np.sum(~self.valid, axis=0)
        return {n: int(c) for n, c in zip(self.marker_names, counts, strict=True) if c}


def _check_times(time_s: Array, place: str) -> None:
    bad = np.flatnonzero(~(np.diff(time_s) > 0.0))
    if len(bad):
        k = int(bad[0]) + 1
        raise RecordingError(
            f"{place}, sample {k}: expected times that increase, got {time_s[k]:g} s after "
            f"{time_s[k - 1]:g} s."
        )
