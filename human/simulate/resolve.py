"""Leads a person by the hand: integrates the law of an operator along given hand poses.

The kinematics here are Pinocchio's own, so that what is tested against a simulated person is not
tested against itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from human.model import HumanModel
from human.simulate.errors import SimulationError
from human.simulate.operators import Comfort
from human.simulate.paths import PoseSamples

Array = NDArray[np.float64]

#: A hand further than this from its path after correction was not reachable [m and rad].
_REACHED = 1e-10
#: Half step of the differences that give the acceleration [s]; their error is below 1e-5 of it.
_EPSILON_S = 1e-4
#: Longest step of the integrator [s]; the push away from a joint limit is stiff.
_LONGEST_STEP_S = 0.02


class LimbChain:
    """The joints that move some frames when the pelvis stands still, and the frames' Jacobian.

    Attributes:
        tips: frame names.
        dof: index of each joint of the chain among the model's, ``n``.
        names: their names.
        rows: numbers per task, six for each tip (or three, if the orientation is left free).
    """

    def __init__(
        self, model: HumanModel, tips: tuple[str, ...], *, with_rotation: bool = True
    ) -> None:
        """Finds the joints between the pelvis and the tips.

        Args:
            model: the person.
            tips: frame names, such as ``RightHandCOM``.
            with_rotation: whether the task is the pose or the position alone.
        """
        self.tips = tips
        self._person = model
        self._model = model.pinocchio()
        self._data = self._model.createData()
        self._frames = [self._model.getFrameId(tip) for tip in tips]
        self._rows = 6 if with_rotation else 3
        self.rows = self._rows * len(tips)
        supports = {
            joint
            for frame in self._frames
            for joint in self._model.supports[self._model.frames[frame].parentJoint]
        }
        self.dof = np.array(
            sorted(self._model.joints[j].idx_v - 6 for j in supports if j > 1), dtype=np.intp
        )
        self.names = tuple(model.dof_names[i] for i in self.dof)
        self._configuration = pin.neutral(self._model)

    def position_only(self) -> "LimbChain":
        """Returns the chain whose task is the position of the tips alone."""
        return LimbChain(self._person, self.tips, with_rotation=False)

    def pose_and_jacobian(self, q: Array) -> tuple[Array, Array, Array]:
        """Returns the tips in pelvis axes.

        Args:
            q: angles of the chain, ``n`` [rad].

        Returns:
            Positions ``k x 3`` [m], rotations ``k x 3 x 3``, and the Jacobian of the stacked twists
            (linear first for each tip), ``rows x n``.
        """
        configuration = self._configuration
        configuration[7 + self.dof] = q
        pin.computeJointJacobians(self._model, self._data, configuration)
        position, rotation, jacobian = [], [], []
        for frame in self._frames:
            pin.updateFramePlacement(self._model, self._data, frame)
            J = pin.getFrameJacobian(self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED)
            jacobian.append(J[: self._rows, 6 + self.dof])
            position.append(self._data.oMf[frame].translation.copy())
            rotation.append(self._data.oMf[frame].rotation.copy())
        return np.array(position), np.array(rotation), np.concatenate(jacobian)


#: Gives for times ``T`` what is added to z, ``T x n`` [rad/s].
NoiseCourse = Callable[[Array], Array]

#: Gives for times ``T`` what each tip is to do, in pelvis axes.
TipPaths = Callable[[Array], list[PoseSamples]]


@dataclass(frozen=True, slots=True)
class Resolved:
    """What the chain does along a path.

    Attributes:
        q: ``T x n`` [rad].
        v: the law's joint velocity at each sample, ``T x n`` [rad/s].
        a: its derivative along the motion, ``T x n`` [rad/s^2].
        noise: the noise that was part of z, ``T x n`` [rad/s].
    """

    q: Array
    v: Array
    a: Array
    noise: Array

    @staticmethod
    def joined(pieces: "Sequence[Resolved]") -> "Resolved":
        """Returns pieces one after another as one."""
        return Resolved(
            np.concatenate([p.q for p in pieces]),
            np.concatenate([p.v for p in pieces]),
            np.concatenate([p.a for p in pieces]),
            np.concatenate([p.noise for p in pieces]),
        )

    def __getitem__(self, samples: slice) -> "Resolved":
        """Returns some of the samples."""
        return Resolved(
            self.q[samples],
            self.v[samples],
            self.a[samples],
            self.noise[samples],
        )


@dataclass(frozen=True, slots=True)
class Law:
    """The law of one operator for one chain.

    Attributes:
        chain: what moves.
        mobility: diagonal of W for the chain's joints, ``n``.
        comfort: C for the chain's joints.
    """

    chain: LimbChain
    mobility: Array
    comfort: Comfort

    def velocity(self, q: Array, twist: Array, noise: Array) -> Array:
        """Returns ``J_W^+ xdot + (I - J_W^+ J) z``, ``n`` [rad/s], with ``z = -grad C + noise``.

        Written as ``z + J_W^+ (xdot - J z)``, which needs one small solve and no projector.
        """
        J = self.chain.pose_and_jacobian(q)[2]
        z = self.comfort.null_velocity(q) + noise
        return z + self._least(J, twist - J @ z)

    def _least(self, J: Array, task: Array) -> Array:
        JW = J * self.mobility
        return np.asarray(JW.T @ np.linalg.solve(JW @ J.T, task))

    def corrected(self, q: Array, position: Array, rotation: Array) -> Array:
        """Returns the posture moved onto the tip poses ``k x 3``, ``k x 3 x 3``, by Newton steps.

        Raises:
            SimulationError: the poses are not reached.
        """
        distance = np.inf
        for _ in range(30):
            at, R, J = self.chain.pose_and_jacobian(q)
            error = self._error(at, R, position, rotation)
            distance = float(np.abs(error).max())
            if distance < _REACHED:
                return q
            step = self._least(J, error)
            q = q + step * min(1.0, 0.5 / float(np.abs(step).max()))
        raise SimulationError(
            f"{', '.join(self.chain.tips)} at {np.round(position, 3).tolist()} (pelvis axes): not "
            f"reached, {distance:.3g} m or rad remain; move the path nearer to the pelvis"
        )

    def _error(self, at: Array, R: Array, position: Array, rotation: Array) -> Array:
        linear = position - at
        if self.chain.rows == 3 * len(self.chain.tips):
            return linear.reshape(-1)
        angular = [pin.log3(goal @ now.T) for goal, now in zip(rotation, R, strict=True)]
        return np.concatenate([np.r_[x, w] for x, w in zip(linear, angular, strict=True)])


def follow(
    law: Law,
    paths: TipPaths,
    time_s: Array,
    q_start: Array,
    noise: NoiseCourse,
    *,
    within_limits: bool = True,
) -> Resolved:
    """Integrates the law along the tip paths.

    Args:
        law: who moves, and how.
        paths: the tips' poses in pelvis axes at given times.
        time_s: ``T`` [s], evenly spaced.
        q_start: posture of the chain at the first time, ``n`` [rad]; moved onto the path if need
            be.
        noise: what is added to z, for the chain's joints.
        within_limits: whether to refuse a joint beyond its limit.

    Returns:
        Posture, velocity and acceleration at each time. The tips are on their paths to 1e-10 m; the
        velocity obeys the law to rounding, and is the derivative of the posture up to the
        integrator's error (fourth order in the step).

    Raises:
        SimulationError: the path cannot be reached, or leads a joint beyond its limit.
    """
    step = float(time_s[1] - time_s[0])
    finer = int(np.ceil(step / _LONGEST_STEP_S - 1e-9))
    if finer > 1:
        between = time_s[0] + np.arange((time_s.size - 1) * finer + 1) * (step / finer)
        return follow(law, paths, between, q_start, noise, within_limits=within_limits)[::finer]
    middle = time_s + 0.5 * step
    at, at_middle = paths(time_s), paths(middle)
    before, after = paths(time_s - _EPSILON_S), paths(time_s + _EPSILON_S)
    n = law.mobility.size
    T = time_s.size

    def twists(samples: list[PoseSamples]) -> Array:
        k = law.chain.rows // len(samples)
        return np.concatenate([s.twist[:, :k] for s in samples], axis=-1)

    def drift(shift: float) -> Array:
        return noise(time_s + shift)

    xd, xd_middle, xd_before, xd_after = map(twists, (at, at_middle, before, after))
    e, e_middle, e_before, e_after = map(drift, (0.0, 0.5 * step, -_EPSILON_S, _EPSILON_S))
    position = np.stack([s.position for s in at], axis=1)
    rotation = np.stack([s.rotation for s in at], axis=1)

    q_all, v_all, a_all = (np.empty((T, n)) for _ in range(3))
    q = law.corrected(np.array(q_start, dtype=np.float64), position[0], rotation[0])
    for i in range(T):
        if i:
            k1 = v_all[i - 1]
            k2 = law.velocity(q + 0.5 * step * k1, xd_middle[i - 1], e_middle[i - 1])
            k3 = law.velocity(q + 0.5 * step * k2, xd_middle[i - 1], e_middle[i - 1])
            k4 = law.velocity(q + step * k3, xd[i], e[i])
            q = q + step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
            q = law.corrected(q, position[i], rotation[i])
        if within_limits:
            _check_limits(law, q, float(time_s[i]))
        v = law.velocity(q, xd[i], e[i])
        ahead = law.velocity(q + _EPSILON_S * v, xd_after[i], e_after[i])
        behind = law.velocity(q - _EPSILON_S * v, xd_before[i], e_before[i])
        q_all[i], v_all[i], a_all[i] = q, v, (ahead - behind) / (2.0 * _EPSILON_S)
    return Resolved(q_all, v_all, a_all, e)


def _check_limits(law: Law, q: Array, time_s: float) -> None:
    beyond = np.maximum(law.comfort.lower - q, q - law.comfort.upper)
    worst = int(np.argmax(beyond))
    if beyond[worst] > 0.0:
        raise SimulationError(
            f"at {time_s:.2f} s {law.chain.names[worst]} is led "
            f"{np.rad2deg(beyond[worst]):.1f} degrees beyond its limit; choose another path"
        )
