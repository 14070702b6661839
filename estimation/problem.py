"""Gathers measurements, priors and model covariances into what the elimination works on."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from estimation.covariances import INFINITE, ModelCovariances
from estimation.errors import MissingMeasurementError, UnknownLinkError
from estimation.sensors import (
    Accelerometer,
    AngularAcceleration,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
    blocks,
    checked_blocks,
    describe,
    point,
    turning,
    values,
    variances,
)
from estimation.spatial import (
    Array,
    cross,
    inverse,
    motion_transform,
    skew,
    symmetric,
    times,
    transposed,
)
from estimation.tree import EstimationTree
from estimation.tree_kinematics import TreeKinematics


@dataclass(frozen=True, slots=True)
class Problem:
    """One Gaussian problem a frame; blocks lead with ``frames`` or with one for all frames.

    Attributes:
        tree: the links.
        kinematics: transforms and velocity terms.
        J: for each link, ``(frames or 1, 6, 6)`` information on its acceleration.
        j: ``(n_links, frames, 6)`` information times mean.
        Px: for each link, ``(frames or 1, 6, 6)`` covariance of its external wrench before the
            equations of motion.
        fbar: ``(n_links, frames, 6)`` its mean.
        dynamics: for each link, ``(6, 6)`` covariance of its row of Newton and Euler.
        kinematic: for each link, ``(6, 6)`` covariance of its row of the propagation.
        Gs: for each link, ``(frames or 1, k)`` variances of its joint's accelerations.
        s_hat: ``(frames, n_dof)`` their means.
        Sf: ``(6, 6)`` covariance of every joint wrench about ``mu``; None where there is no prior.
        mu: centre of the priors.
        hinge: for each link, ``(6, 6)`` noise of one massless link of the papers' tree; zero
            unless carried over.
    """

    tree: EstimationTree
    kinematics: TreeKinematics
    J: list[Array]
    j: Array
    Px: list[Array]
    fbar: Array
    dynamics: list[Array]
    kinematic: list[Array]
    Gs: list[Array]
    s_hat: Array
    Sf: Array | None
    mu: float
    hinge: list[Array]


def assemble(
    tree: EstimationTree,
    kinematics: TreeKinematics,
    measurements: Sequence[Measurement],
    covariances: ModelCovariances,
    frames: int,
) -> Problem:
    """Folds everything that concerns one link alone into that link.

    Args:
        tree: the links.
        kinematics: of these frames.
        measurements: of these frames, all finite.
        covariances: of the model.
        frames: how many.

    Raises:
        UnknownLinkError: a sensor is on a link that the tree has not.
        MeasurementError: a value or covariance has the wrong shape.
        CovarianceError: a covariance is not one.
        MissingMeasurementError: nobody knows the joint accelerations.

    Source: the information form of Latella et al. 2019, eq. 25, link by link; the net wrench's
    measurement and prior are combined first. Derived here.
    """
    for sensor in measurements:
        if not isinstance(sensor, JointAcceleration) and sensor.link not in tree.link_names:
            raise UnknownLinkError(sensor.link, tree.link_names)
    J, j = _accelerations(tree, kinematics, measurements, covariances, frames)
    Px, fbar = net_wrenches(tree, kinematics, measurements, covariances, frames)
    variance, s_hat = joint_information(tree, measurements, covariances, frames)
    Gs = [variance[:, dofs] for dofs in tree.dofs]
    dynamics, kinematic, hinge = model_noise(tree, covariances)
    prior = covariances.joint_wrench_prior
    return Problem(
        tree=tree,
        kinematics=kinematics,
        J=J,
        j=j,
        Px=Px,
        fbar=fbar,
        dynamics=dynamics,
        kinematic=kinematic,
        Gs=Gs,
        s_hat=s_hat,
        Sf=None if prior == INFINITE else prior * np.eye(6),
        mu=covariances.prior_mean,
        hinge=hinge,
    )


def model_noise(
    tree: EstimationTree, covariances: ModelCovariances
) -> tuple[list[Array], list[Array], list[Array]]:
    """Returns covariances of each link's equations, and of one massless link's if carried over."""
    dynamics, kinematic, hinge = [], [], []
    between_links = _with_prior(untouched(covariances), np.zeros(6), covariances)[0]
    for axes in tree.axes:
        between = max(0, len(axes) - 1) if covariances.carried_from_hinges else 0
        massless = covariances.dynamics * np.eye(6) + between_links
        dynamics.append(covariances.dynamics * np.eye(6) + between * massless)
        kinematic.append((1 + between) * covariances.kinematics * np.eye(6))
        hinge.append(massless if between else np.zeros((6, 6)))
    return dynamics, kinematic, hinge


def _accelerations(
    tree: EstimationTree,
    kinematics: TreeKinematics,
    measurements: Sequence[Measurement],
    covariances: ModelCovariances,
    frames: int,
) -> tuple[list[Array], Array]:
    prior = 1.0 / covariances.acceleration_prior
    J = [prior * np.eye(6)[None] for _ in tree.link_names]
    j = np.full((tree.n_links, frames, 6), prior * covariances.prior_mean)
    for sensor in measurements:
        if not isinstance(sensor, Accelerometer | AngularAcceleration):
            continue
        link = tree.link_names.index(sensor.link)
        axes, r, C, weighted = observation(sensor, frames)
        y = values(sensor, sensor.value, frames, 3)
        if r is not None:
            w = kinematics.omega[link]
            y = y - times(transposed(axes), cross(w, cross(w, r)))
        J[link] = J[link] + symmetric(weighted @ C)
        j[link] += times(weighted, y)
    return J, j


def observation(
    sensor: Accelerometer | AngularAcceleration, frames: int
) -> tuple[Array, Array | None, Array, Array]:
    """Returns how an acceleration's sensor sees its link.

    Args:
        sensor: the sensor.
        frames: how many there are.

    Returns:
        Its axes ``(1 or frames, 3, 3)``; its place ``(1 or frames, 3)``, or None where that does
        not matter; ``C``, ``(1 or frames, 3, 6)``: what it reads of the link's acceleration; and
        ``C'`` times the inverse of its covariance.
    """
    axes = turning(sensor, sensor.rotation, frames)
    place, C = None, np.zeros((len(axes), 3, 6))
    if isinstance(sensor, Accelerometer):
        place = point(sensor, sensor.position, frames)
        turned = -transposed(axes) @ skew(place)
        C = np.concatenate([np.broadcast_to(transposed(axes), turned.shape), turned], axis=-1)
    else:
        C[..., 3:] = transposed(axes)
    covariance = blocks(sensor, sensor.covariance, frames, 3)
    return axes, place, C, transposed(C) @ symmetric(inverse(covariance))


@lru_cache(maxsize=8)
def untouched(covariances: ModelCovariances) -> Array:
    """Returns the covariance ``(6, 6)`` of the wrench on a link that nothing is known to touch."""
    force, moment = covariances.untouched_force_sd**2, covariances.untouched_moment_sd**2
    return checked_blocks("untouched links", np.diag([force] * 3 + [moment] * 3))


def _with_prior(block: Array, y: Array, covariances: ModelCovariances) -> tuple[Array, Array]:
    """Combines a wrench's measurement with the prior of external wrenches."""
    if covariances.wrench_prior == INFINITE:
        return block, y
    weight = symmetric(inverse(block))
    out = symmetric(inverse(weight + np.eye(6) / covariances.wrench_prior))
    pull = covariances.prior_mean / covariances.wrench_prior
    return out, times(out, times(weight, y) + pull)


def net_wrenches(
    tree: EstimationTree,
    kinematics: TreeKinematics,
    measurements: Sequence[Measurement],
    covariances: ModelCovariances,
    frames: int,
) -> tuple[list[Array], Array]:
    """Returns covariance and mean of each link's external wrench before the equations of motion.

    A link's sensors and what may push on it besides add up; a link without either is untouched.

    Raises:
        MeasurementError: a value or covariance has the wrong shape.
        CovarianceError: a covariance is not one.
    """
    known: dict[int, tuple[Array, Array]] = {}
    for sensor in measurements:
        if isinstance(sensor, ForceTorque):
            link = tree.link_names.index(sensor.link)
            carry = wrench_carrier(sensor, frames, kinematics, link)
            y = values(sensor, sensor.value, frames, 6)
            block = blocks(sensor, sensor.covariance, frames, 6)
            if carry is not None:
                y, block = times(carry, y), symmetric(carry @ block @ transposed(carry))
        elif isinstance(sensor, FreeWrench):
            link = tree.link_names.index(sensor.link)
            y = np.zeros((frames, 6))
            variances = [sensor.force_sd**2] * 3 + [sensor.moment_sd**2] * 3
            block = checked_blocks(describe(sensor), np.diag(variances))[None]
        else:
            continue
        before = known.get(link, (np.zeros((1, 6, 6)), np.zeros((frames, 6))))
        known[link] = (before[0] + block, before[1] + y)
    default = (untouched(covariances)[None], np.zeros((frames, 6)))
    Px, fbar = [], np.empty((tree.n_links, frames, 6))
    for link in range(tree.n_links):
        block, fbar[link] = _with_prior(*known.get(link, default), covariances)
        Px.append(block)
    return Px, fbar


def wrench_carrier(
    sensor: ForceTorque,
    frames: int,
    kinematics: TreeKinematics | None = None,
    link: int = 0,
) -> Array | None:
    """Returns ``(1 or frames, 6, 6)``: from the sensor's axes and point to its link's.

    Args:
        sensor: the sensor.
        frames: how many there are.
        kinematics: needed for a sensor that is fixed to the world.
        link: its link's index, needed with ``kinematics``.

    Returns:
        The matrix, or None where the sensor's axes and point are the link's.
    """
    axes = turning(sensor, sensor.rotation, frames)
    place = point(sensor, sensor.position, frames)
    if sensor.fixed_to == "world":
        assert kinematics is not None
        back = transposed(kinematics.rotation[link])
        place = times(back, place - kinematics.position[link])
        axes = back @ axes
    elif sensor.rotation is None and not np.any(place):
        return None
    return transposed(motion_transform(axes, place))


def joint_information(
    tree: EstimationTree,
    measurements: Sequence[Measurement],
    covariances: ModelCovariances,
    frames: int,
) -> tuple[Array, Array]:
    """Returns variances ``(1 or frames, n_dof)`` and means ``(frames, n_dof)`` of the joints.

    Raises:
        MeasurementError: a value or covariance has the wrong shape.
        CovarianceError: a covariance is not one.
        MissingMeasurementError: nobody knows the joint accelerations.
    """
    prior = 1.0 / covariances.joint_acceleration_prior
    information = np.full((1, tree.n_dof), prior)
    vector = np.full((frames, tree.n_dof), prior * covariances.prior_mean)
    for sensor in measurements:
        if isinstance(sensor, JointAcceleration):
            y = values(sensor, sensor.value, frames, tree.n_dof)
            weight = 1.0 / variances(sensor, frames, tree.n_dof)
            information = information + weight
            vector += weight * y
    if tree.n_dof and np.min(information) <= 0.0:
        raise MissingMeasurementError(
            "joint accelerations: expected a JointAcceleration, the motion's accelerations `a`, or "
            "a finite joint_acceleration_prior; got none, and they are never taken to be zero"
        )
    variance = 1.0 / information
    return variance, variance * vector
