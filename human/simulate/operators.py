"""Operators: people who resolve their redundancy by a law that is known to the last number.

``qdot = J_W^+ xdot + (I - J_W^+ J) z`` with ``z = -grad C(q) + noise``: W says which joints a
person likes to move, C where they are comfortable, and the noise makes two repetitions differ.

Source: Vianello et al. 2021, eq. 3 and 9 (with the sign that seeks comfort). The numbers of each
kind of person are chosen here to make people who differ in a plain way; they are not measured.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from human.joint_limits import joint_limits
from human.model import HumanModel
from human.names import DOF_NAMES
from human.simulate.errors import SimulationError

Array = NDArray[np.float64]


def _frozen(values: object) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


@dataclass(frozen=True, slots=True)
class Comfort:
    """The discomfort C(q) of a posture, and with it the null-space velocity ``z = -grad C``.

    ``C = sum_j rate_j d_j^2 / 2 + sum_j edge_rate margin relu(1 - room_j / margin)^3 / 3`` with d
    the deviation from neutral and room the distance to the nearer joint limit: within the margins
    next to the limits a second term pushes back.

    Attributes:
        neutral: most comfortable angles, ``n`` [rad].
        rate: how fast each joint seeks them, ``n`` [1/s].
        lower: joint limits, ``n`` [rad].
        upper: joint limits, ``n`` [rad].
        margin: width of the margin next to a limit [rad].
        edge_rate: how fast a joint leaves a limit it stands at [rad/s].
    """

    neutral: Array
    rate: Array
    lower: Array
    upper: Array
    margin: float = 0.2
    edge_rate: float = 8.0

    def _edge(self, q: Array) -> tuple[Array, Array]:
        # A range narrower than two margins would push from both sides at its middle.
        margin = np.minimum(self.margin, 0.4 * (self.upper - self.lower))
        low = np.maximum(1.0 - (q - self.lower) / margin, 0.0)
        high = np.maximum(1.0 - (self.upper - q) / margin, 0.0)
        return low, high

    def cost(self, q: Array) -> Array:
        """Returns C, ``...`` [rad^2/s], of joint angles ``... x n`` [rad]."""
        low, high = self._edge(q)
        margin = np.minimum(self.margin, 0.4 * (self.upper - self.lower))
        pull = 0.5 * self.rate * (q - self.neutral) ** 2
        return np.asarray(np.sum(pull + self.edge_rate * margin * (low**3 + high**3) / 3.0, -1))

    def null_velocity(self, q: Array) -> Array:
        """Returns ``z = -grad C``, ``... x n`` [rad/s], of joint angles ``... x n`` [rad]."""
        low, high = self._edge(q)
        return np.asarray(
            self.rate * (self.neutral - q) + self.edge_rate * (low * low - high * high)
        )

    def of(self, dof: NDArray[np.intp]) -> "Comfort":
        """Returns the same comfort for some of the joints; they do not mix, so nothing is lost."""
        return Comfort(
            self.neutral[dof],
            self.rate[dof],
            self.lower[dof],
            self.upper[dof],
            self.margin,
            self.edge_rate,
        )


@dataclass(frozen=True, slots=True)
class Operator:
    """A person: W, C, noise and manners. Arrays go by ``human.DOF_NAMES`` (66).

    Attributes:
        kind: one of ``OPERATOR_KINDS``.
        mobility: diagonal of W, ``66``; only ratios matter.
        comfort: C and the joint limits.
        null_noise: sd of the coherent noise added to z, ``66`` [rad/s].
        noise_time_s: time over which that noise forgets itself [s].
        leg_share: share of the way down to a low object that the legs make; the trunk makes the
            rest.
        pace_m_s: mean speed of the person's own hand movements [m/s].
        reaction_s: pause before a movement that the person, not the robot, begins [s].
    """

    kind: str
    mobility: Array
    comfort: Comfort
    null_noise: Array
    noise_time_s: float
    leg_share: float
    pace_m_s: float
    reaction_s: float


@dataclass(frozen=True, slots=True)
class _Habit:
    """Factors on the mobilities of an average person, and the share of the legs."""

    spine_bend: float = 1.0
    spine_turn: float = 1.0
    girdle: float = 1.0
    arm: float = 1.0
    leg_share: float = 0.5


_HABITS: Mapping[str, _Habit] = MappingProxyType(
    {
        "average": _Habit(),
        "stooper": _Habit(spine_bend=5.0, spine_turn=1.5, arm=0.7, leg_share=0.1),
        "squatter": _Habit(spine_bend=0.5, spine_turn=0.7, leg_share=0.9),
        "arm-reacher": _Habit(spine_bend=0.3, spine_turn=0.3, girdle=2.5, arm=1.4, leg_share=0.5),
        "twister": _Habit(spine_bend=0.8, spine_turn=7.0, arm=0.7, leg_share=0.4),
    }
)

#: The kinds of people ``operator`` knows.
OPERATOR_KINDS: tuple[str, ...] = tuple(_HABITS)

#: Per joint: mobility about x, y, z; rate of comfort [1/s]; neutral x, y, z [degrees].
#: Right side and midline; the left side is mirrored. Zero is the T-pose, the arm along -y.
_AVERAGE: Mapping[str, tuple[tuple[float, ...], float, tuple[float, ...]]] = MappingProxyType(
    {
        "jL5S1": ((0.08, 0.16, 0.06), 0.9, (0, 1, 0)),
        "jL4L3": ((0.08, 0.14, 0.06), 0.9, (0, 1, 0)),
        "jL1T12": ((0.06, 0.10, 0.08), 0.9, (0, 1, 0)),
        "jT9T8": ((0.06, 0.08, 0.12), 0.9, (0, 1, 0)),
        "jT1C7": ((0.20, 0.30, 0.30), 1.0, (0, 2, 0)),
        "jC1Head": ((0.20, 0.30, 0.40), 1.0, (0, 2, 0)),
        "jRightC7Shoulder": ((0.30, 0.05, 0.35), 0.8, (0, 0, 0)),
        "jRightShoulder": ((1.60, 1.20, 1.80), 0.35, (70, 0, 20)),
        "jRightElbow": ((0.02, 0.80, 1.60), 0.35, (0, 0, 70)),
        "jRightWrist": ((0.50, 0.06, 0.40), 0.6, (0, 0, 0)),
        "jRightHip": ((0.60, 1.00, 0.40), 0.5, (0, 0, 0)),
        "jRightKnee": ((0.02, 1.00, 0.05), 0.5, (0, 0, 0)),
        "jRightAnkle": ((0.30, 0.80, 0.10), 0.5, (0, 0, 0)),
        "jRightBallFoot": ((0.02, 0.30, 0.02), 1.0, (0, 0, 0)),
    }
)
_MIRROR = (-1.0, 1.0, -1.0)


def _average(name: str) -> tuple[float, float, float]:
    """Returns mobility, comfort rate and neutral angle [rad] of one degree of freedom."""
    joint, axis = name.rsplit("_rot", 1)
    k = "xyz".index(axis)
    mobility, rate, neutral = _AVERAGE[joint.replace("Left", "Right")]
    sign = _MIRROR[k] if "Left" in joint else 1.0
    return mobility[k], rate, sign * float(np.deg2rad(neutral[k]))


def _factor(name: str, habit: _Habit) -> float:
    if name.startswith(("jL5S1", "jL4L3", "jL1T12", "jT9T8")):
        return habit.spine_turn if name.endswith("rotz") else habit.spine_bend
    if "C7Shoulder" in name:
        return habit.girdle
    if any(part in name for part in ("Shoulder", "Elbow", "Wrist")):
        return habit.arm
    return 1.0


def operator(
    kind: str,
    rng: np.random.Generator,
    model: HumanModel | None = None,
    *,
    noise: float = 0.06,
    spread: float = 0.2,
) -> Operator:
    """Draws a person of a kind.

    Args:
        kind: one of ``OPERATOR_KINDS``.
        rng: source of what makes this person differ from others of the kind.
        model: whose joint limits bind this person; the published ranges of motion if not given.
        noise: sd of the null-space noise of a joint of mobility one [rad/s]; it goes with the root
            of the mobility, since W is the covariance of what a person does when nothing binds
            them.
        spread: sd of the logarithm of the factors that make the person.

    Raises:
        SimulationError: an unknown kind, or a model of other degrees of freedom.
    """
    if kind not in _HABITS:
        raise SimulationError(f"unknown kind {kind!r}; use one of {', '.join(OPERATOR_KINDS)}")
    n = len(DOF_NAMES)
    if model is not None and model.dof_names != DOF_NAMES:
        raise SimulationError(
            f"expected the {n} degrees of freedom of human.DOF_NAMES, model {model.name!r} has "
            f"{model.n_dof}; generate one with human.generate_model"
        )
    lower, upper = joint_limits(DOF_NAMES) if model is None else (model.lower, model.upper)
    habit = _HABITS[kind]
    mobility, rate, neutral = (np.array(x) for x in zip(*map(_average, DOF_NAMES), strict=True))
    mobility = mobility * [_factor(name, habit) for name in DOF_NAMES]
    mobility = mobility * np.exp(spread * rng.standard_normal(n))
    rate = rate * np.exp(spread * rng.standard_normal(n))
    inside = np.minimum(0.2, 0.4 * (upper - lower))
    neutral = neutral + 0.05 * np.sqrt(mobility) * rng.standard_normal(n)
    neutral = np.clip(neutral, lower + inside, upper - inside)
    return Operator(
        kind=kind,
        mobility=_frozen(mobility),
        comfort=Comfort(_frozen(neutral), _frozen(rate), _frozen(lower), _frozen(upper)),
        null_noise=_frozen(noise * np.sqrt(mobility)),
        noise_time_s=0.3,
        leg_share=float(np.clip(habit.leg_share + 0.05 * rng.standard_normal(), 0.0, 1.0)),
        pace_m_s=float(0.25 * np.exp(spread * rng.standard_normal())),
        reaction_s=float(0.25 * np.exp(spread * rng.standard_normal())),
    )


@dataclass(frozen=True, slots=True)
class CoherentNoise:
    """A drawn course of null-space noise: smooth in time, Ornstein-Uhlenbeck at its knots.

    White noise in velocity would have endless accelerations; between the knots a cubic spline runs,
    so that velocity and acceleration exist and inverse dynamics mean something.
    """

    _course: CubicSpline

    def __call__(self, time_s: Array) -> Array:
        """Returns the noise at times ``T`` [s], ``T x n`` [rad/s]."""
        return np.asarray(self._course(time_s))


def coherent_noise(
    rng: np.random.Generator,
    sd: Array,
    *,
    start_s: float,
    end_s: float,
    memory_s: float,
    knot_s: float = 0.04,
) -> CoherentNoise:
    """Draws an Ornstein-Uhlenbeck course in its stationary state.

    Args:
        rng: source of randomness.
        sd: stationary standard deviation, ``n`` [rad/s].
        start_s: first time [s].
        end_s: last time [s].
        memory_s: the correlation falls to 1/e within this time [s].
        knot_s: distance of the knots, where the statistics are exact [s].
    """
    knots = start_s + knot_s * np.arange(-2, int(np.ceil((end_s - start_s) / knot_s)) + 3)
    kept = np.exp(-knot_s / memory_s)
    kicks = rng.standard_normal((knots.size, np.size(sd)))
    values = np.empty_like(kicks)
    values[0] = kicks[0]
    for i in range(1, knots.size):
        values[i] = kept * values[i - 1] + np.sqrt(1.0 - kept * kept) * kicks[i]
    return CoherentNoise(CubicSpline(knots, values * sd))
