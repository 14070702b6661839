"""What was measured: frozen records, each with the covariance of its noise in physical units.

Every covariance may be a number (the same variance along every axis), a vector (variances), a
matrix, or a matrix for each frame; so it can change while a run goes on. Values and covariances are
in the sensor's own axes. Give a sensor's real noise: the bands of the estimate follow from it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from estimation.errors import CovarianceError, MeasurementError
from estimation.spatial import Array

#: Variances outside this range leave nothing of the smaller ones in double precision.
ACCEPTED_VARIANCE = (1e-14, 1e14)
#: Beyond this ratio between the directions of one sensor, a change of axes costs the smaller ones
#: their digits.
_ACCEPTED_RATIO = 1e12
_ASYMMETRY = 1e-9


@dataclass(frozen=True, slots=True)
class Accelerometer:
    """Reads the proper acceleration of a point: zero in free fall, 9.81 m/s^2 upwards at rest.

    Attributes:
        link: the link it is fixed to.
        value: ``(frames, 3)`` m/s^2, sensor axes.
        covariance: (m/s^2)^2.
        position: ``(3,)`` m, link axes from the link's origin.
        rotation: ``(3, 3)`` sensor axes in link axes (columns).

    Source: Latella et al. 2019, eq. 3 and 19.
    """

    link: str
    value: ArrayLike
    covariance: ArrayLike
    position: ArrayLike = (0.0, 0.0, 0.0)
    rotation: ArrayLike | None = None


@dataclass(frozen=True, slots=True)
class AngularAcceleration:
    """Knows how a link's turning changes, such as a gyroscope's differentiated signal.

    Attributes:
        link: the link.
        value: ``(frames, 3)`` rad/s^2, sensor axes.
        covariance: (rad/s^2)^2.
        rotation: ``(3, 3)`` sensor axes in link axes (columns).

    Source: named as open in Latella et al. 2019, section 4.5.
    """

    link: str
    value: ArrayLike
    covariance: ArrayLike
    rotation: ArrayLike | None = None


@dataclass(frozen=True, slots=True)
class JointAcceleration:
    """Knows the accelerations of all degrees of freedom, such as differentiated joint angles.

    Attributes:
        value: ``(frames, n_dof)`` rad/s^2.
        covariance: (rad/s^2)^2: a number, ``(n_dof,)`` or ``(frames, n_dof)``.
    """

    value: ArrayLike
    covariance: ArrayLike


@dataclass(frozen=True, slots=True)
class ForceTorque:
    """Measures part of the external wrench on a link; the parts measured on one link add up.

    A link with several sensors, such as a shoe with one at the toes and one at the heel, has one
    record for each. The covariance belongs to the sensor's own axes and point.

    Attributes:
        link: the link that the wrench acts on.
        value: ``(frames, 6)`` N, N m, force first: what acts on the person, sensor axes and point.
        covariance: N^2 and (N m)^2.
        position: ``(3,)`` or ``(frames, 3)`` m, the sensor's point: from the link's origin in link
            axes, or in the world.
        rotation: ``(3, 3)`` or ``(frames, 3, 3)`` sensor axes in those of the link or the world.
        fixed_to: ``link`` for a shoe's sensor, ``world`` for a force plate.

    Source: Latella et al. 2019, eq. 20.
    """

    link: str
    value: ArrayLike
    covariance: ArrayLike
    position: ArrayLike = (0.0, 0.0, 0.0)
    rotation: ArrayLike | None = None
    fixed_to: Literal["link", "world"] = "link"


@dataclass(frozen=True, slots=True)
class FreeWrench:
    """Says that something unmeasured may push on a link, and how hard.

    A hand that may hold a load is ``FreeWrench("RightHandCOM", force_sd=100.0, moment_sd=0.1)``.
    Links with neither this nor a `ForceTorque` are taken to be untouched.

    Attributes:
        link: the link.
        force_sd: N, standard deviation expected of each component of the force.
        moment_sd: N m, the same of the moment about the link's origin.

    Raises:
        MeasurementError: a standard deviation is not a positive number.
    """

    link: str
    force_sd: float = 100.0
    moment_sd: float = 0.1

    def __post_init__(self) -> None:
        """Refuses what a square would hide."""
        for name in ("force_sd", "moment_sd"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise MeasurementError(
                    f"FreeWrench on {self.link}: expected {name} above zero, got {value!r}"
                )


Measurement = Accelerometer | AngularAcceleration | JointAcceleration | ForceTorque | FreeWrench


def describe(sensor: Measurement) -> str:
    """Returns how a message should call a measurement."""
    kind = type(sensor).__name__
    return kind if isinstance(sensor, JointAcceleration) else f"{kind} on {sensor.link}"


def values(sensor: Measurement, value: ArrayLike, frames: int, width: int) -> Array:
    """Checks what was measured: ``(frames, width)``; not whether it is finite.

    Raises:
        MeasurementError: another shape.
    """
    array = np.asarray(value, dtype=np.float64)
    if array.shape != (frames, width):
        raise MeasurementError(
            f"{describe(sensor)}: expected a value of shape ({frames}, {width}), got {array.shape}"
        )
    return array


def blocks(sensor: Measurement, covariance: ArrayLike, frames: int, width: int) -> Array:
    """Returns a covariance as blocks ``(1 or frames, width, width)``.

    Raises:
        MeasurementError: a shape that is none of number, vector, matrix, matrix a frame.
        CovarianceError: not symmetric, not positive, or beyond what double precision carries.
    """
    given = np.asarray(covariance, dtype=np.float64)
    if given.shape in ((), (width,)):
        out = (np.eye(width) * given)[None]
    elif given.shape == (width, width):
        out = given[None]
    elif given.shape == (frames, width, width):
        out = given
    else:
        raise MeasurementError(
            f"{describe(sensor)}: "
            f"expected a covariance of shape (), ({width},), ({width}, {width}) or "
            f"({frames}, {width}, {width}), got {given.shape}",
        )
    return checked_blocks(describe(sensor), out, _ACCEPTED_RATIO)


def variances(sensor: JointAcceleration, frames: int, width: int) -> Array:
    """Returns the variances of joint accelerations as ``(1 or frames, width)``.

    Raises:
        MeasurementError: a shape that is none of number, vector, vector a frame.
        CovarianceError: not positive, or beyond what double precision carries.
    """
    given = np.asarray(sensor.covariance, dtype=np.float64)
    if given.shape not in ((), (width,), (frames, width)):
        raise MeasurementError(
            f"{describe(sensor)}: "
            f"expected a covariance of shape (), ({width},) or ({frames}, {width}), "
            f"got {given.shape}",
        )
    checked_blocks(describe(sensor), given.reshape(-1, 1, 1))
    return np.broadcast_to(given, (frames, width) if given.ndim == 2 else (1, width))


def checked_blocks(place: str, out: Array, ratio: float = float("inf")) -> Array:
    """Returns the blocks ``(..., n, n)`` if they are covariances that can be worked with.

    Raises:
        CovarianceError: not finite, not symmetric, not positive definite, or out of range.
    """
    low, high = ACCEPTED_VARIANCE
    if not np.all(np.isfinite(out)):
        raise CovarianceError(place, "expected a finite covariance", float("nan"))
    scale = np.max(np.abs(out), axis=(-2, -1))
    askew = np.max(np.abs(out - out.swapaxes(-1, -2)), axis=(-2, -1))
    if np.any(askew > _ASYMMETRY * scale):
        raise CovarianceError(place, "expected a symmetric covariance, askew by", np.max(askew))
    least, most = np.linalg.eigvalsh(out)[..., (0, -1)].reshape(-1, 2).T
    if np.min(least) <= 0.0:
        raise CovarianceError(place, "expected positive variances", float(np.min(least)))
    if np.min(least) < low:
        raise CovarianceError(
            place, f"expected variances of at least {low:g} in SI units", float(np.min(least))
        )
    if np.max(most) > high:
        raise CovarianceError(
            place, f"expected variances of at most {high:g} in SI units", float(np.max(most))
        )
    apart = float(np.max(most / least))
    if apart > ratio:
        raise CovarianceError(
            place, f"expected variances at most {ratio:g} times as large as others of it", apart
        )
    return out


def turning(sensor: Measurement, rotation: ArrayLike | None, frames: int) -> Array:
    """Returns a sensor's axes as ``(1 or frames, 3, 3)``.

    Raises:
        MeasurementError: another shape, or no rotation.
    """
    given = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64)
    if given.shape not in ((3, 3), (frames, 3, 3)):
        raise MeasurementError(
            f"{describe(sensor)}: expected a rotation of shape (3, 3), got {given.shape}"
        )
    out = given.reshape(-1, 3, 3)
    product = out.swapaxes(-1, -2) @ out
    if not np.allclose(product, np.eye(3), rtol=0.0, atol=1e-6) or np.any(np.linalg.det(out) < 0.0):
        raise MeasurementError(f"{describe(sensor)}: expected a rotation matrix")
    return out


def point(sensor: Measurement, position: ArrayLike, frames: int) -> Array:
    """Returns a sensor's place as ``(1 or frames, 3)`` m.

    Raises:
        MeasurementError: another shape, or not finite.
    """
    given = np.asarray(position, dtype=np.float64)
    if given.shape not in ((3,), (frames, 3)) or not np.all(np.isfinite(given)):
        raise MeasurementError(
            f"{describe(sensor)}: expected a finite position of shape (3,), got {given.shape}"
        )
    return given.reshape(-1, 3)


def frames_at_fault(measurements: Sequence[Measurement]) -> dict[str, list[int]]:
    """Returns, by measurement, the frames whose values are not finite."""
    out: dict[str, list[int]] = {}
    for sensor in measurements:
        if isinstance(sensor, FreeWrench):
            continue
        array = np.asarray(sensor.value, dtype=np.float64)
        bad = np.flatnonzero(~np.isfinite(array.reshape(len(array), -1)).all(axis=1))
        if len(bad):
            out.setdefault(describe(sensor), []).extend(bad.tolist())
    return out
