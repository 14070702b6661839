"""A planar five-revolute arm whose null-space law is known: the smallest person there is.

Every constant is fixed here, so that figures measured on this generator can be compared between
methods and between days.

Source: Vianello et al. 2021, section VI-A (the law, the bounds of the mobilities, the restart);
what the paper leaves open (lengths, cost, noise levels, time step) is chosen here and stated on
each field.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from human.simulate.errors import SimulationError

Array = NDArray[np.float64]

#: Bounds of the joint mobilities; the paper's [0 + eps, 2 - eps] with eps = .05.
MOBILITY_RANGE: tuple[float, float] = (0.05, 1.95)


def _frozen(values: object) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


@dataclass(frozen=True, slots=True)
class PlanarArm:
    """Kinematics of a planar chain of revolute joints; the task is the position of its tip.

    Use it for the toy problem only; people are ``human.Chain``, which has the same two methods.

    Attributes:
        lengths_m: link lengths, ``n``.
    """

    lengths_m: Array = field(default_factory=lambda: _frozen((0.30, 0.30, 0.30, 0.25, 0.20)))

    def forward(self, q: Array) -> Array:
        """Returns the tip position in base axes, ``... x 2`` [m], at angles ``... x n`` [rad]."""
        heading = np.cumsum(np.asarray(q, dtype=np.float64), axis=-1)
        return np.stack(
            (np.cos(heading) @ self.lengths_m, np.sin(heading) @ self.lengths_m), axis=-1
        )

    def jacobian(self, q: Array) -> Array:
        """Returns the derivative of the tip position by the joint angles, ``... x 2 x n`` [m/rad].

        Derived here: joint j turns every link from j on, so its column is the tip's lever arm from
        joint j, turned by 90 degrees; the lever arms are sums of links taken from the tip back.
        """
        heading = np.cumsum(np.asarray(q, dtype=np.float64), axis=-1)
        lever_x = np.cumsum((np.cos(heading) * self.lengths_m)[..., ::-1], axis=-1)[..., ::-1]
        lever_y = np.cumsum((np.sin(heading) * self.lengths_m)[..., ::-1], axis=-1)[..., ::-1]
        return np.stack((-lever_y, lever_x), axis=-2)

    def manipulability(self, q: Array) -> Array:
        """Returns ``sqrt(det(J J'))``, ``...`` [m^2]; it vanishes where the arm is straight."""
        J = self.jacobian(q)
        return np.asarray(np.sqrt(np.maximum(np.linalg.det(J @ np.swapaxes(J, -1, -2)), 0.0)))


@dataclass(frozen=True, slots=True)
class PlanarComfort:
    """A smooth RULA-like discomfort of the arm: steps between bands, plus a weak pull to neutral.

    Attributes:
        neutral: the posture that costs least, ``n`` [rad].
        weight: share of each joint, ``n``.
        edges: the two band edges of each joint, ``n x 2`` [rad].
        step_width: width of the logistic that stands for each step [rad].
        softening: deviation below which ``|d|`` is rounded [rad].
        pull: factor of the quadratic term [1/rad^2].
    """

    neutral: Array = field(
        default_factory=lambda: _frozen(np.deg2rad((90.0, -25.0, -25.0, -60.0, -20.0)))
    )
    weight: Array = field(default_factory=lambda: _frozen((1.0, 1.0, 1.0, 0.7, 0.7)))
    edges: Array = field(
        default_factory=lambda: _frozen(
            np.deg2rad(((20, 60), (20, 45), (20, 45), (20, 60), (15, 40)))
        )
    )
    step_width: float = float(np.deg2rad(8.0))
    softening: float = float(np.deg2rad(3.0))
    pull: float = 1.0 / 8.0

    def _soft_deviation(self, q: Array) -> tuple[Array, Array, Array]:
        d = np.asarray(q, dtype=np.float64) - self.neutral
        size = np.sqrt(d * d + self.softening**2)
        step = 0.5 * (1.0 + np.tanh(0.5 * (size[..., None] - self.edges) / self.step_width))
        return d, size, step

    def cost(self, q: Array) -> Array:
        """Returns the discomfort ``C(q)``, ``...``, of joint angles ``... x n`` [rad]."""
        d, _, step = self._soft_deviation(q)
        return np.asarray((1.0 + step.sum(axis=-1) + self.pull * d * d) @ self.weight)

    def gradient(self, q: Array) -> Array:
        """Returns ``grad C(q)``, ``... x n`` [1/rad]."""
        d, size, step = self._soft_deviation(q)
        slope = (step * (1.0 - step)).sum(axis=-1) / self.step_width
        return np.asarray(self.weight * (slope * d / size + 2.0 * self.pull * d))


@dataclass(frozen=True, slots=True)
class PlanarLaw:
    """The law of one planar operator: ``qdot = J_W^+ xdot + (I - J_W^+ J) z``, ``z = -grad C``.

    The paper prints ``+grad C``; an operator who seeks comfort goes down the gradient.

    Attributes:
        mobility: diagonal of W, ``n``; a joint of low mobility is used little.
        arm: its kinematics.
        comfort: its cost.
        null_noise: sd of the white noise added to z [rad/s].
    """

    mobility: Array
    arm: PlanarArm = field(default_factory=PlanarArm)
    comfort: PlanarComfort = field(default_factory=PlanarComfort)
    null_noise: float = 0.02

    def weighted_inverse(self, jacobian: Array) -> Array:
        """Returns ``J_W^+ = W J' (J W J')^-1``, ``... x n x 2``."""
        JW = jacobian * self.mobility
        gram = JW @ np.swapaxes(jacobian, -1, -2)
        return np.swapaxes(np.linalg.solve(gram, JW), -1, -2)

    def null_projector(self, jacobian: Array) -> Array:
        """Returns ``P_W = I - J_W^+ J``, ``... x n x n``."""
        return np.asarray(np.eye(self.mobility.size) - self.weighted_inverse(jacobian) @ jacobian)

    def null_velocity(self, q: Array) -> Array:
        """Returns the noise-free z of postures ``... x n``, ``... x n`` [rad/s]."""
        return -self.comfort.gradient(q)

    def mean(self, q: Array, xdot: Array) -> Array:
        """Returns the expected qdot, ``... x n`` [rad/s], at a tip velocity ``... x 2`` [m/s]."""
        J = self.arm.jacobian(q)
        task = self.weighted_inverse(J) @ np.asarray(xdot, dtype=np.float64)[..., None]
        free = self.null_projector(J) @ self.null_velocity(q)[..., None]
        return np.asarray((task + free)[..., 0])

    def covariance(self, q: Array, sigma_x: float) -> Array:
        """Returns the covariance of qdot, ``... x n x n``, at a tip velocity of sd ``sigma_x``."""
        J = self.arm.jacobian(q)
        inverse, P = self.weighted_inverse(J), self.null_projector(J)
        return np.asarray(
            sigma_x**2 * inverse @ np.swapaxes(inverse, -1, -2)
            + self.null_noise**2 * P @ np.swapaxes(P, -1, -2)
        )


@dataclass(frozen=True, slots=True)
class PlanarDemonstrations:
    """Samples of a planar operator, with the law that made them.

    Attributes:
        q: postures, ``N x 5`` [rad].
        qdot: joint velocities, ``N x 5`` [rad/s].
        xdot: tip velocities as measured (with noise), ``N x 2`` [m/s].
        xdot_true: tip velocities, exactly ``J qdot``, ``N x 2`` [m/s].
        jacobian: ``N x 2 x 5`` [m/rad].
        trajectory_id: number of the run each sample belongs to, ``N``; a new run starts where
            the last one met a singular posture.
        time_s: time since the start of the run, ``N`` [s].
        sigma_x: sd of the noise on ``xdot`` [m/s].
        law: the truth.
    """

    q: Array
    qdot: Array
    xdot: Array
    xdot_true: Array
    jacobian: Array
    trajectory_id: NDArray[np.int64]
    time_s: Array
    sigma_x: float
    law: PlanarLaw


def planar_law(rng: np.random.Generator) -> PlanarLaw:
    """Draws an operator: every mobility uniform within ``MOBILITY_RANGE``."""
    return PlanarLaw(mobility=_frozen(rng.uniform(*MOBILITY_RANGE, size=5)))


def simulate_planar(
    rng: np.random.Generator,
    law: PlanarLaw | None = None,
    *,
    samples: int = 1000,
    step_s: float = 0.05,
    speed_limit: float = 0.5,
    sigma_x: float = 0.002,
    sigma_acceleration: float = 1.0,
) -> PlanarDemonstrations:
    """Drives a planar operator by random tip velocities and records it.

    Args:
        rng: source of all randomness.
        law: the operator; drawn by ``planar_law`` if not given.
        samples: number of samples N.
        step_s: time step [s].
        speed_limit: each component of the tip velocity is uniform within +- this [m/s].
        sigma_x: sd of the measurement noise on the recorded tip velocity [m/s]. With none at all
            the density of qdot does not exist.
        sigma_acceleration: sd of the joint acceleration noise between samples [rad/s^2].

    Returns:
        The samples, in order of time within each run.

    Raises:
        SimulationError: if ``samples`` or ``step_s`` is not positive.

    Source: Vianello et al. 2021, section VI-A: ``q_t = q_{t-1} + qdot dt + omega_a dt^2``, restart
    from the same posture q0 when the arm is singular.
    """
    if samples < 1 or not step_s > 0.0:
        raise SimulationError(
            f"samples and step_s must be positive, got samples={samples} and step_s={step_s}"
        )
    law = planar_law(rng) if law is None else law
    arm, comfort = law.arm, law.comfort
    n = law.mobility.size

    def outside(posture: Array) -> bool:
        singular = bool(arm.manipulability(posture) < 0.02)
        return singular or bool(np.any(np.abs(posture - comfort.neutral) > 2.6))

    start = comfort.neutral + rng.uniform(-0.5, 0.5, size=n)
    while outside(start):  # a start that is singular itself would be restarted for ever
        start = comfort.neutral + rng.uniform(-0.5, 0.5, size=n)
    q_all = np.empty((samples, n))
    qdot_all = np.empty((samples, n))
    run_all = np.zeros(samples, dtype=np.int64)
    time_all = np.empty(samples)
    q, run, first = start, 0, 0
    for i in range(samples):
        if i and outside(q):
            q, run, first = start, run + 1, i
        J = arm.jacobian(q)
        command = rng.uniform(-speed_limit, speed_limit, size=2)
        z = law.null_velocity(q) + law.null_noise * rng.standard_normal(n)
        qdot = law.weighted_inverse(J) @ command + law.null_projector(J) @ z
        q_all[i], qdot_all[i], run_all[i], time_all[i] = q, qdot, run, (i - first) * step_s
        q = q + qdot * step_s + sigma_acceleration * rng.standard_normal(n) * step_s**2
    J_all = arm.jacobian(q_all)
    xdot_true = np.einsum("tij,tj->ti", J_all, qdot_all)
    xdot = xdot_true + sigma_x * rng.standard_normal(xdot_true.shape)
    return PlanarDemonstrations(
        q=q_all,
        qdot=qdot_all,
        xdot=xdot,
        xdot_true=xdot_true,
        jacobian=J_all,
        trajectory_id=run_all,
        time_s=time_all,
        sigma_x=sigma_x,
        law=law,
    )
