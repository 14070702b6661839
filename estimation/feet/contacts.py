"""Which foot is on the ground: by force, by how the foot moves, or by both.

`classify_by_force` is the paper's offline rule put right; `ContactDetector` has memory, works frame
by frame, and needs no force at all. Feet always stand in the order right, left.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from estimation.errors import MeasurementError

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

#: What ``Contacts.support`` counts in.
SUPPORTS = ("none", "right", "left", "double")


@dataclass(frozen=True, slots=True)
class Contacts:
    """Which feet are on the ground.

    Attributes:
        feet: ``(..., 2)`` whether the right and the left foot is.
    """

    feet: Mask

    @property
    def right(self) -> Mask:
        """``(...)`` whether the right foot is on the ground."""
        return self.feet[..., 0]

    @property
    def left(self) -> Mask:
        """``(...)`` whether the left foot is on the ground."""
        return self.feet[..., 1]

    @property
    def support(self) -> NDArray[np.int64]:
        """``(...)`` place in ``SUPPORTS``: none, right, left, double."""
        return self.right.astype(np.int64) + 2 * self.left.astype(np.int64)


def classify_by_force(
    vertical_n: ArrayLike, *, least_share: float = 0.02, flight_share: float = 0.1
) -> Contacts:
    """Classifies all frames of a recording at once by the vertical forces under the feet.

    A foot counts as down while it bears at least ``least_share`` of what both bear at that moment,
    and neither does while both bear less than ``flight_share`` of their usual sum. Use
    `ContactDetector` for live data, where feet slip in and out of contact, or without forces.

    Args:
        vertical_n: ``(time, 2)`` N, ground on foot, up, right and left.
        least_share: smallest share of the sum that makes a contact; between the noise and a half.
        flight_share: share of the median sum below which the person is in the air.

    Raises:
        MeasurementError: shape, a number that is not finite, shares out of order, or forces that
            do not push up.

    Source: Latella et al. 2019, Algorithm 1, with another threshold. As printed, ``|f_R - f_L|`` is
    held against the mean of ``f_R + f_L``, which is body weight, and so is the difference in single
    support: noise decides. Any fixed part of the mean fails too, because walking changes the sum by
    half. Here the threshold is ``1 - 2 least_share`` of each frame's own sum.
    """
    force = _pair(vertical_n, "vertical_n")
    if force.ndim != 2 or not len(force):
        raise MeasurementError(f"vertical_n: expected shape (time, 2), got {force.shape}")
    if not 0.0 < least_share < 0.5 or not 0.0 <= flight_share < 1.0:
        raise MeasurementError(
            "expected 0 < least_share < 0.5 and 0 <= flight_share < 1, got "
            f"{least_share} and {flight_share}"
        )
    total = force.sum(axis=-1)
    usual = float(np.median(total))
    if not usual > 0.0:
        raise MeasurementError(
            f"vertical_n: expected forces that push the feet up, got a median sum of {usual:.4g} N;"
            " if this is what the feet do to the ground, change its sign"
        )
    difference = force[:, 0] - force[:, 1]
    double = np.abs(difference) <= (1.0 - 2.0 * least_share) * total
    down = np.stack([double | (difference > 0.0), double | (difference <= 0.0)], axis=-1)
    return Contacts(down & (total >= flight_share * usual)[:, None])


@dataclass(frozen=True, slots=True)
class FootMotion:
    """How points of the soles move; `sole_motion` makes one of a motion.

    Attributes:
        height_m: ``(..., 2)`` or ``(..., 2, points)`` over the floor, right and left.
        speed_m_s: the same shape, against the floor or the belt.
        acceleration_m_s2: the same shape, norm without gravity; None if unknown. It shows a switch
            some 20 ms before the speed does: a foot starts and stops gently.
    """

    height_m: ArrayLike
    speed_m_s: ArrayLike
    acceleration_m_s2: ArrayLike | None = None


@dataclass(frozen=True, slots=True)
class ContactThresholds:
    """When a foot is taken to touch down (enter) and to lift off (leave).

    The defaults are those of a foot at rest; `ROLLING_GAIT` of one that rolls over heel and toe.

    Attributes:
        enter_share: of body weight, by force.
        leave_share: of body weight, by force.
        enter_speed_m_s: all three of speed, acceleration and height must be below to enter.
        leave_speed_m_s: any of the three above to leave.
        enter_acceleration_m_s2: see above.
        leave_acceleration_m_s2: see above.
        enter_height_m: see above.
        leave_height_m: see above.

    Raises:
        MeasurementError: a pair that leaves no gap between entering and leaving.
    """

    enter_share: float = 0.02
    leave_share: float = 0.01
    enter_speed_m_s: float = 0.15
    leave_speed_m_s: float = 0.25
    enter_acceleration_m_s2: float = 1.0
    leave_acceleration_m_s2: float = 2.0
    enter_height_m: float = 0.03
    leave_height_m: float = 0.05

    def __post_init__(self) -> None:
        """Checks that each pair leaves a gap, on the right side."""
        for field in fields(self):
            if field.name.startswith("enter"):
                enter = getattr(self, field.name)
                leave = getattr(self, "leave" + field.name.removeprefix("enter"))
                low, high = (leave, enter) if field.name == "enter_share" else (enter, leave)
                if not 0.0 < low < high < np.inf:
                    raise MeasurementError(
                        f"{field.name} {enter} and its leave {leave}: expected a gap between them, "
                        "the one for leaving a lesser force or a larger movement"
                    )


#: For real gait where a foot counts as down while it bears load: shoes, skin and markers move at up
#: to a metre a second over the standing heel or toe. Too wide for the zero velocity of
#: `estimation.base_velocity`, which the defaults are for. Chosen on one person's walk
#: (tests/recordings/test_contacts.py says what it reaches).
ROLLING_GAIT = ContactThresholds(
    enter_speed_m_s=0.6,
    leave_speed_m_s=0.8,
    enter_acceleration_m_s2=20.0,
    leave_acceleration_m_s2=30.0,
    enter_height_m=0.05,
    leave_height_m=0.08,
)


class ContactDetector:
    """Follows the feet through time, live or in batches, with hysteresis.

    A foot is down while it is loaded or rests on the floor, by whatever is known at that frame:
    force, movement, or both. Where nothing is known it stays as it was. It holds the state of one
    person; make another one for another recording.

    Derived here: each cue orders "enter", "leave" or nothing at each frame, and the last order
    holds, so a batch is a search for the last order and equals frame by frame exactly.
    """

    def __init__(
        self, weight_n: float | None = None, thresholds: ContactThresholds | None = None
    ) -> None:
        """Starts with both feet in the air and nothing known.

        Args:
            weight_n: weight of the body and all it carries, N; needed for forces.
            thresholds: when a foot touches down and lifts off.

        Raises:
            MeasurementError: a weight that is not positive.
        """
        if weight_n is not None and not 0.0 < weight_n < np.inf:
            raise MeasurementError(f"weight_n: expected a positive weight in N, got {weight_n}")
        self.weight_n, self.thresholds = weight_n, thresholds or ContactThresholds()
        self._loaded, self._still, self._down = (np.zeros(2, dtype=np.bool_) for _ in range(3))

    def step(
        self, *, vertical_n: ArrayLike | None = None, feet: FootMotion | None = None
    ) -> Contacts:
        """Takes one frame, ``(2,)`` or ``(2, points)`` each, and says which feet are down."""
        if feet is not None:
            rate = feet.acceleration_m_s2
            feet = FootMotion(
                np.asarray(feet.height_m)[None],
                np.asarray(feet.speed_m_s)[None],
                None if rate is None else np.asarray(rate)[None],
            )
        force = None if vertical_n is None else np.asarray(vertical_n)[None]
        return Contacts(self.classify(vertical_n=force, feet=feet).feet[0])

    def classify(
        self,
        *,
        vertical_n: ArrayLike | None = None,
        feet: FootMotion | None = None,
        force_valid: ArrayLike = True,
        feet_valid: ArrayLike = True,
    ) -> Contacts:
        """Takes the next frames and says which feet are down.

        Args:
            vertical_n: ``(time, 2)`` N, ground on foot, up.
            feet: how the feet move, over ``time``.
            force_valid: ``(time,)`` or ``(time, 2)``, where the force may be used.
            feet_valid: the same for the movement.

        Raises:
            MeasurementError: neither force nor movement, force without a weight, shapes that do not
                fit, or a valid number that is not finite.
        """
        if vertical_n is None and feet is None:
            raise MeasurementError("contacts: expected vertical_n, feet or both, got neither")
        states, known = [], []
        if vertical_n is not None:
            orders, valid = self._force_orders(vertical_n, force_valid)
            states.append(_last_order(orders, self._loaded))
            self._loaded = states[-1][-1]
            known.append(valid)
        if feet is not None:
            orders, valid = self._movement_orders(feet, feet_valid)
            states.append(_last_order(orders, self._still))
            self._still = states[-1][-1]
            known.append(valid)
        if len({state.shape for state in states}) > 1:
            raise MeasurementError(
                "contacts: expected as many frames of force as of movement, got "
                f"{' and '.join(str(len(state)) for state in states)}"
            )
        down = np.any([state & valid for state, valid in zip(states, known, strict=True)], axis=0)
        told = np.any(known, axis=0)
        orders = np.where(told, np.where(down, 1, -1), 0)
        feet_down = _last_order(orders, self._down)
        self._down = feet_down[-1]
        return Contacts(feet_down)

    def _force_orders(self, vertical_n: ArrayLike, valid: ArrayLike) -> tuple[Array, Mask]:
        if self.weight_n is None:
            raise MeasurementError(
                "contacts by force: expected weight_n, the body's weight with all it carries, in N"
            )
        force, mask = _screened(vertical_n, valid, "vertical_n")
        if force.ndim != 2 or not len(force):
            raise MeasurementError(f"vertical_n: expected shape (time, 2), got {force.shape}")
        enter = force >= self.thresholds.enter_share * self.weight_n
        leave = force < self.thresholds.leave_share * self.weight_n
        return np.where(mask, enter.astype(float) - leave, 0.0), mask

    def _movement_orders(self, feet: FootMotion, valid: ArrayLike) -> tuple[Array, Mask]:
        limits = self.thresholds
        cues = [
            (feet.height_m, limits.enter_height_m, limits.leave_height_m, "height_m"),
            (feet.speed_m_s, limits.enter_speed_m_s, limits.leave_speed_m_s, "speed_m_s"),
        ]
        if feet.acceleration_m_s2 is not None:
            low, high = limits.enter_acceleration_m_s2, limits.leave_acceleration_m_s2
            cues.append((feet.acceleration_m_s2, low, high, "acceleration_m_s2"))
        shape = np.shape(feet.height_m)
        if len(shape) not in (2, 3) or shape[1] != 2 or 0 in shape:
            raise MeasurementError(
                f"height_m: expected shape (time, 2) or (time, 2, points), got {shape}"
            )
        enter: Mask = np.ones(shape, dtype=np.bool_)
        leave: Mask = np.zeros(shape, dtype=np.bool_)
        for values, low, high, name in cues:
            value, mask = _screened(values, valid, name)
            if value.shape != shape:
                raise MeasurementError(f"{name}: expected shape {shape}, got {value.shape}")
            enter &= value < low
            leave |= value > high
        if len(shape) == 3:
            # One resting point of the sole is enough: the heel, or the toes after it has lifted.
            enter, leave = np.asarray(enter.any(axis=-1)), np.asarray(leave.all(axis=-1))
        return np.where(mask, enter.astype(float) - leave, 0.0), mask


def _last_order(orders: Array, before: Mask) -> Mask:
    """Returns the state at each frame after orders ``(time, 2)`` of +1 (on), -1 (off) and 0."""
    place = np.where(orders != 0.0, np.arange(len(orders))[:, None], -1)
    last = np.maximum.accumulate(place, axis=0)
    ordered = np.take_along_axis(orders, np.maximum(last, 0), axis=0) > 0.0
    return np.where(last >= 0, ordered, before)


def _screened(value: ArrayLike, valid: ArrayLike, what: str) -> tuple[Array, Mask]:
    """Returns values with the invalid ones at zero, and the mask ``(time, 2)``."""
    array = np.asarray(value, dtype=np.float64)
    given = np.asarray(valid, dtype=np.bool_)
    by_foot = given if given.ndim != 1 else np.stack([given, given], axis=-1)
    try:
        mask = np.broadcast_to(by_foot, array.shape[:2])
    except ValueError:
        raise MeasurementError(
            f"validity of {what}: expected shape ({len(array)},) or ({len(array)}, 2), got "
            f"{np.shape(valid)}"
        ) from None
    spread = mask.reshape(mask.shape + (1,) * (array.ndim - 2))
    return _pair(np.where(spread, array, 0.0), what), mask


def _pair(value: ArrayLike, what: str) -> Array:
    array = np.asarray(value, dtype=np.float64)
    if array.ndim < 2 or array.shape[1] != 2:
        raise MeasurementError(f"{what}: expected shape (time, 2, ...), got {array.shape}")
    bad = ~np.isfinite(array).reshape(len(array), -1).all(axis=1)
    if np.any(bad):
        raise MeasurementError(f"{what}: expected finite numbers", int(np.argmax(bad)))
    return array
