"""Where on its link a sensor sits, from how it feels the link turn."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimation.errors import IllConditionedError, MeasurementError
from estimation.spatial import GRAVITY_MS2, Array, skew

#: World axes, m/s^2.
_GRAVITY = np.array([0.0, 0.0, -GRAVITY_MS2])
#: Relative size of a singular value that is put down to rounding.
_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class LinkMotion:
    """How a link moves, world axes, as a motion-capture suit or a fitted motion states it.

    Attributes:
        rotation: ``(..., 3, 3)`` link axes in the world.
        angular_velocity: ``(..., 3)`` rad/s.
        angular_acceleration: ``(..., 3)`` rad/s^2.
        acceleration: ``(..., 3)`` m/s^2, of the link's origin, gravity not in it.
    """

    rotation: ArrayLike
    angular_velocity: ArrayLike
    angular_acceleration: ArrayLike
    acceleration: ArrayLike


@dataclass(frozen=True, slots=True)
class ImuPlacement:
    """Where a sensor sits, and how well that is known.

    Attributes:
        position: ``(3,)`` m, sensor from the link's origin, link axes.
        covariance: ``(3, 3)`` m^2 of it.
        bias: ``(3,)`` m/s^2 of the accelerometer, sensor axes; zero where it was not estimated.
        condition_number: best over worst determined direction, of the stacked ``A``.
        excitation_per_s2: ``(3,)`` 1/s^2, strongest first: rms acceleration that a metre of offset
            made in each principal direction.
        residual_m_s2: root mean square of what is left per axis.
        samples: frames that count, fewer than were given if old ones are forgotten.
    """

    position: Array
    covariance: Array
    bias: Array
    condition_number: float
    excitation_per_s2: Array
    residual_m_s2: float
    samples: float

    @property
    def sd(self) -> Array:
        """Standard deviation ``(3,)`` m of the position."""
        return np.sqrt(np.diagonal(self.covariance))


class PlacementEstimator:
    """Finds a sensor's place while frames come in; `place_imu` does all of a recording at once.

    Source: Latella et al. 2019, equations 3-5: with ``A = (S(omega') + S(omega)^2) R`` and ``b =
    R_S a_S - (o'' - g)``, the place is the least-squares solution of ``A p = b``. The online form,
    which the paper leaves open, is derived here: the triangular factor of all rows so far
    (square-root information) takes in new rows by one small QR, whose remainder is the growth of
    the residual; nothing is squared, so it equals the batch to rounding. With a bias its columns
    ``R_S`` stand first, and the last three rows of the factor are what is known of the place alone.

    Attributes:
        accelerometer_sd: m/s^2 per axis, None to take it from the residual.
        forgetting: weight of the past per frame; below one for sensors that may slip.
    """

    def __init__(
        self,
        *,
        accelerometer_sd: float | None = None,
        estimate_bias: bool = False,
        forgetting: float = 1.0,
        max_condition: float = 100.0,
        least_excitation_per_s2: float = 0.5,
    ) -> None:
        """Starts with nothing known.

        Args:
            accelerometer_sd: noise of one axis, m/s^2; None takes it from the residual.
            estimate_bias: whether the accelerometer has an unknown constant offset.
            forgetting: what the squared weight of a row is multiplied by at each newer frame.
            max_condition: largest condition number that is answered.
            least_excitation_per_s2: smallest excitation in the worst direction that is answered;
                noise of the angular acceleration alone makes some.

        Raises:
            MeasurementError: a setting out of its range.
        """
        if accelerometer_sd is not None and not 0.0 < accelerometer_sd < np.inf:
            raise MeasurementError(
                f"accelerometer_sd: expected a positive m/s^2, got {accelerometer_sd}"
            )
        if not 0.0 < forgetting <= 1.0:
            raise MeasurementError(f"forgetting: expected more than 0, up to 1, got {forgetting}")
        self.accelerometer_sd, self.forgetting = accelerometer_sd, forgetting
        self._max_condition, self._least = max_condition, least_excitation_per_s2
        self._unknowns = 6 if estimate_bias else 3
        self._factor = np.zeros((self._unknowns, self._unknowns + 1))
        self._rest, self._samples = 0.0, 0.0

    def add(
        self, link: LinkMotion, accelerometer: ArrayLike, sensor_rotation: ArrayLike
    ) -> "PlacementEstimator":
        """Takes in one frame or many.

        Args:
            link: how the link moves; leading dimensions ``()`` or ``(time,)``.
            accelerometer: ``(..., 3)`` m/s^2 as measured, sensor axes: upward 9.81 at rest.
            sensor_rotation: ``(..., 3, 3)`` sensor axes in the world.

        Raises:
            MeasurementError: shapes do not fit or a number is not finite.
        """
        measured = _frames(accelerometer, (3,), None, "accelerometer")
        count = len(measured)
        R_sensor = _frames(sensor_rotation, (3, 3), count, "sensor_rotation")
        R_link = _frames(link.rotation, (3, 3), count, "rotation")
        omega = skew(_frames(link.angular_velocity, (3,), count, "angular_velocity"))
        alpha = skew(_frames(link.angular_acceleration, (3,), count, "angular_acceleration"))
        origin = _frames(link.acceleration, (3,), count, "acceleration")
        A = (alpha + omega @ omega) @ R_link
        b = (R_sensor @ measured[..., None])[..., 0] - (origin - _GRAVITY)
        rows = np.concatenate([A, b[..., None]], axis=-1)
        if self._unknowns == 6:
            rows = np.concatenate([R_sensor, rows], axis=-1)
        age = np.arange(count - 1, -1, -1)
        rows = rows * np.sqrt(self.forgetting**age)[:, None, None]
        past = self.forgetting**count
        stack = np.concatenate([np.sqrt(past) * self._factor, rows.reshape(-1, self._unknowns + 1)])
        triangle: Array = np.asarray(np.linalg.qr(stack, mode="r"), dtype=np.float64)
        self._factor = np.zeros_like(self._factor)
        kept = triangle[: self._unknowns]
        self._factor[: len(kept)] = kept
        self._rest = past * self._rest + float(np.sum(triangle[self._unknowns :, -1] ** 2))
        self._samples = past * self._samples + float(np.sum(self.forgetting**age))
        return self

    def result(self) -> ImuPlacement:
        """Returns the place by all frames so far.

        Raises:
            IllConditionedError: the link has not turned enough, or about one axis alone.
        """
        factor, right = self._factor[:, :-1], self._factor[:, -1]
        _, singular, directions = np.linalg.svd(factor[-3:, -3:])
        excitation = singular / np.sqrt(max(self._samples, 1.0))
        solid = singular[2] > _ROUNDING * max(singular[0], 1.0)
        condition = float(singular[0] / singular[2]) if solid else np.inf
        if not condition <= self._max_condition or not excitation[2] >= self._least:
            raise IllConditionedError(condition, excitation, directions[2])
        solution: Array = np.asarray(np.linalg.solve(factor, right), dtype=np.float64)
        free = 3.0 * self._samples - self._unknowns
        variance = self._rest / free if free > 0.0 else 0.0
        if self.accelerometer_sd is not None:
            variance = self.accelerometer_sd**2
        elif free <= 0.0:
            raise MeasurementError(
                f"IMU placement: {self._samples:g} frames leave no residual to tell the noise from;"
                " record more, or state accelerometer_sd"
            )
        spread = directions.T / singular
        return ImuPlacement(
            position=solution[-3:],
            covariance=variance * (spread @ spread.T),
            bias=solution[:-3] if self._unknowns == 6 else np.zeros(3),
            condition_number=condition,
            excitation_per_s2=excitation,
            residual_m_s2=float(np.sqrt(self._rest / (3.0 * self._samples))),
            samples=self._samples,
        )


def place_imu(
    link: LinkMotion,
    accelerometer: ArrayLike,
    sensor_rotation: ArrayLike,
    *,
    accelerometer_sd: float | None = None,
    estimate_bias: bool = False,
    max_condition: float = 100.0,
    least_excitation_per_s2: float = 0.5,
) -> ImuPlacement:
    """Finds a sensor's place on its link from a recording; `PlacementEstimator` does it live.

    Args:
        link: how the link moves, over ``time``.
        accelerometer: ``(time, 3)`` m/s^2 as measured, sensor axes.
        sensor_rotation: ``(time, 3, 3)`` sensor axes in the world.
        accelerometer_sd: noise of one axis, m/s^2; None takes it from the residual.
        estimate_bias: whether the accelerometer has an unknown constant offset.
        max_condition: largest condition number that is answered.
        least_excitation_per_s2: smallest excitation that is answered.

    Raises:
        MeasurementError: shapes do not fit or a number is not finite.
        IllConditionedError: the link has not turned enough, or about one axis alone.

    Source: Latella et al. 2019, equations 3-5.
    """
    estimator = PlacementEstimator(
        accelerometer_sd=accelerometer_sd,
        estimate_bias=estimate_bias,
        max_condition=max_condition,
        least_excitation_per_s2=least_excitation_per_s2,
    )
    return estimator.add(link, accelerometer, sensor_rotation).result()


def _frames(value: ArrayLike, last: tuple[int, ...], count: int | None, what: str) -> Array:
    """Returns ``(time, *last)``; a single frame becomes a time of one."""
    array = np.asarray(value, dtype=np.float64)
    if array.shape == last:
        array = array[None]
    wanted = (len(array) if count is None and array.ndim else count, *last)
    if array.shape != wanted or not array.size:
        shape = ("time" if count is None else str(count), *map(str, last))
        raise MeasurementError(
            f"{what}: expected shape ({', '.join(shape)}), got {np.shape(value)}"
        )
    bad = ~np.isfinite(array).reshape(len(array), -1).all(axis=1)
    if np.any(bad):
        raise MeasurementError(f"{what}: expected finite numbers", int(np.argmax(bad)))
    return array
