"""What is taken for likely of a posture where markers say little.

Where they say enough nothing here pulls: the limits only push back outside, the sharing of a bend
between spine joints leaves its sum alone, and only turns that skin markers cannot tell from their
own error are held near zero. All spreads are chosen here.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from human.joint_limits import joint_limits
from human.model import Array, HumanModel, IntArray

Flags = NDArray[np.bool_]

#: Joints that share one bend, each in proportion to its range of motion.
_SHARING = (("jL5S1", "jL4L3", "jL1T12", "jT9T8"), ("jT1C7", "jC1Head"))
#: How far one of them may stray from its share, rad.
_SHARE_SD_RAD = 0.05
#: Turns that markers on skin hardly show, and their standard deviation about zero, rad: the
#: clavicle about its own axis, the knee sideways, the carpus about the forearm, rolling toes.
_STIFF_SD_RAD = {
    "C7Shoulder_roty": 0.05,
    "Knee_rotx": 0.1,
    "Wrist_roty": 0.1,
    "BallFoot_rotx": 0.1,
    "BallFoot_rotz": 0.1,
}
#: An elbow is a hinge: sideways component of the forearm's direction in the upper arm's axes.
_HINGE_SD = 0.1
#: How hard a limit pushes back, rad.
_LIMIT_SD_RAD = np.deg2rad(0.2)
#: Room beyond their limits (rad) for the outer angles of joints whose middle one passes 90 degrees:
#: there they swing while the limb hardly moves, and their limits no longer say what it can do.
SWING_RAD = np.deg2rad(60.0)
#: An angle that markers determine: free for all that its own size matters.
_FREE_SD_RAD = 300.0
#: One that they hardly determine: near the reference posture.
POOR_SD_RAD = 0.35


def reference_angles(model: HumanModel) -> Array:
    """Returns the posture ``(n_dof,)`` rad of what no marker shows: upright, arms hanging."""
    out = np.zeros(model.n_dof)
    for side, angle in (("Right", 0.5 * np.pi), ("Left", -0.5 * np.pi)):
        name = f"j{side}Shoulder_rotx"
        if name in model.dof_names:
            out[model.dof_names.index(name)] = angle
    return out


def movable_dofs(model: HumanModel, segment: IntArray) -> IntArray:
    """Returns the degrees of freedom that move at least one of the markers on ``segment``."""
    carrying = np.zeros(len(model.segment_names), dtype=np.bool_)
    for index in np.unique(segment).tolist():
        while index >= 0:
            carrying[index] = True
            index = model.parents[index]
    return np.flatnonzero(carrying[model.dof_joints + 1])


@dataclass(frozen=True, slots=True, eq=False)
class Pull:
    """A pull of some frames' angles towards values known otherwise; ``k`` free angles.

    Attributes:
        mean: ``(B, k)`` rad.
        precision: ``(B, k)`` 1/rad^2, zero where there is none.
    """

    mean: Array
    precision: Array

    def of(self, frames: IntArray) -> "Pull":
        """Returns the pull of some of the frames."""
        return Pull(self.mean[frames], self.precision[frames])


def no_pull(frames: int, free: int) -> Pull:
    """Returns a pull of nothing."""
    return Pull(np.zeros((frames, free)), np.zeros((frames, free)))


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """Likely postures of the ``k`` free degrees of freedom.

    Attributes:
        mean: ``(k,)`` rad.
        matrix: ``(k, k)`` 1/rad^2.
        lower: ``(k,)`` rad, with room to swing.
        upper: ``(k,)`` rad, with room to swing.
        hinges: for each elbow the three places of its angles among the free ones.
        settled: ``(k,)`` angles that are shared or stiff whatever the markers.
    """

    mean: Array
    matrix: Array
    lower: Array
    upper: Array
    hinges: tuple[IntArray, ...]
    settled: Flags

    def loosened(self, sd_rad: Array) -> "Prior":
        """Returns the same with each angle that is not settled held to its mean this loosely."""
        matrix = self.matrix.copy()
        at = np.flatnonzero(~self.settled)
        matrix[at, at] = 1.0 / sd_rad[at] ** 2
        return replace(self, matrix=matrix)

    def cost(self, angles: Array, pull: Pull) -> Array:
        """Returns half the squared improbability ``(B,)`` of angles ``(B, k)``."""
        away, beyond = angles - self.mean, self._beyond(angles)
        total = np.sum((away @ self.matrix) * away, axis=-1)
        total += np.sum((beyond / _LIMIT_SD_RAD) ** 2, axis=-1)
        total += np.sum(pull.precision * (angles - pull.mean) ** 2, axis=-1)
        for hinge in self.hinges:
            total += (_sideways(angles[:, hinge])[0] / _HINGE_SD) ** 2
        return np.asarray(0.5 * total)

    def add(self, matrix: Array, rhs: Array, angles: Array, pull: Pull) -> None:
        """Adds curvature ``(B, k, k)`` and descent ``(B, k)`` to normal equations, in place."""
        beyond = self._beyond(angles)
        matrix += self.matrix
        rhs -= (angles - self.mean) @ self.matrix + beyond / _LIMIT_SD_RAD**2
        rhs -= pull.precision * (angles - pull.mean)
        diagonal = np.einsum("bkk->bk", matrix)
        diagonal += (beyond != 0.0) / _LIMIT_SD_RAD**2 + pull.precision
        for hinge in self.hinges:
            value, slope = _sideways(angles[:, hinge])
            slope /= _HINGE_SD
            rhs[:, hinge] -= slope * (value / _HINGE_SD)[:, None]
            matrix[:, hinge[:, None], hinge] += slope[:, :, None] * slope[:, None, :]

    def _beyond(self, angles: Array) -> Array:
        return angles - np.clip(angles, self.lower, self.upper)


def posture_prior(model: HumanModel, free: IntArray, segment: IntArray) -> Prior:
    """Makes the prior of the free degrees of freedom ``(k,)``, each loosely held.

    Args:
        model: the person.
        free: ``(k,)`` degrees of freedom that move.
        segment: ``(markers,)`` index of each marker's segment.
    """
    names = [model.dof_names[dof] for dof in free]
    matrix = np.zeros((len(free), len(free)))
    settled = np.zeros(len(free), dtype=np.bool_)
    for joints in _sharing(model, segment):
        for axis in ("rotx", "roty", "rotz"):
            at = np.array([k for k, n in enumerate(names) if n in {f"{j}_{axis}" for j in joints}])
            if len(at) < 2:
                continue
            lower, upper = joint_limits(tuple(names[k] for k in at))
            share = (upper - lower) / np.sum(upper - lower)
            stray = (np.eye(len(at)) - share[:, None]) / _SHARE_SD_RAD
            matrix[np.ix_(at, at)] = stray.T @ stray + np.eye(len(at)) / _FREE_SD_RAD**2
            settled[at] = True
    for k, name in enumerate(names):
        for ending, sd in _STIFF_SD_RAD.items():
            if name.endswith(ending):
                matrix[k, k] = 1.0 / sd**2
                settled[k] = True
    hinges = []
    for side in ("Right", "Left"):
        elbow = [f"j{side}Elbow_{axis}" for axis in ("rotx", "roty", "rotz")]
        if set(elbow) <= set(names):
            hinges.append(np.array([names.index(name) for name in elbow]))
    room = np.where(settled, 0.0, _room(model)[free])
    prior = Prior(
        mean=reference_angles(model)[free],
        matrix=matrix,
        lower=model.lower[free] - room,
        upper=model.upper[free] + room,
        hinges=tuple(hinges),
        settled=settled,
    )
    return prior.loosened(np.full(len(free), _FREE_SD_RAD))


def _sharing(model: HumanModel, segment: IntArray) -> list[tuple[str, ...]]:
    """Returns the joints that share a bend: parted at segments whose own markers turn them."""
    turned = np.bincount(segment, minlength=len(model.segment_names)) >= 3
    out: list[tuple[str, ...]] = []
    for joints in _SHARING:
        part: list[str] = []
        for joint in joints:
            part.append(joint)
            if joint in model.joint_names and turned[model.joint_names.index(joint) + 1]:
                out.append(tuple(part))
                part = []
        out.append(tuple(part))
    return out


def _room(model: HumanModel) -> Array:
    """Room ``(n_dof,)`` rad beyond the limits of outer angles that may swing."""
    out = np.zeros(model.n_dof)
    for joint in range(len(model.joint_names)):
        dofs = model.joint_dofs(joint)
        if len(dofs) == 3:
            reach = max(-model.lower[dofs[1]], model.upper[dofs[1]])
            out[dofs[[0, 2]]] = SWING_RAD if reach > 0.5 * np.pi else 0.0
    return out


def trusting(prior: Prior, poor: Flags) -> Prior:
    """Returns the prior with the poorly shown angles ``(k,)`` near the reference, others free."""
    return prior.loosened(np.where(poor, POOR_SD_RAD, _FREE_SD_RAD))


def _sideways(angles: Array) -> tuple[Array, Array]:
    """Sideways component ``(B,)`` of the forearm in upper-arm axes, and its slope ``(B, 3)``.

    Derived here: bending about z and then turning about the forearm, ``R = Rz(c) Ry(p)``, keeps
    the forearm's long axis y in the plane z = 0; in the model's angles that component is
    ``sin a cos c + cos a sin b sin c``.
    """
    (sa, sb, sc), (ca, cb, cc) = np.sin(angles).T, np.cos(angles).T
    value = sa * cc + ca * sb * sc
    slope = np.stack([ca * cc - sa * sb * sc, ca * cb * sc, ca * sb * cc - sa * sc], axis=-1)
    return value, slope
