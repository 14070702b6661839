"""A person in motion with a load in the right hand, and what sensors would read of it."""

from dataclasses import dataclass, replace

import numpy as np

from estimation import (
    Accelerometer,
    EstimationTree,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
    Measurement,
    ModelCovariances,
)
from estimation.spatial import cross, times, transposed
from estimation.tree import real_tree
from estimation.tree_kinematics import base_acceleration, link_accelerations, tree_kinematics
from human import HumanModel, Wrench, inverse_dynamics
from human.rotations import quaternion_multiply, rotation_vector_to_quaternion
from human.simulate import IMU_SEGMENTS

FOOT_VARIANCE = np.array([1.0] * 3 + [0.15**2] * 3)


@dataclass(frozen=True, slots=True)
class Scene:
    """States, exact readings and true torques."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    sensors: list[Measurement]
    torque: np.ndarray
    load_kg: float


def moving_scene(
    model: HumanModel,
    frames: int,
    rng: np.random.Generator,
    load_kg: float = 5.0,
    *,
    beside: float = 0.1,
) -> Scene:
    """Makes upright postures in motion, arms out; both feet share what balance asks.

    Args:
        model: the person.
        frames: how many.
        rng: source of all randomness.
        load_kg: in the right hand.
        beside: N m, standard deviation of the load's moment about the hand's centre.
    """
    q = np.zeros((frames, model.nq))
    tilt = rotation_vector_to_quaternion(0.2 * rng.normal(size=(frames, 3)))
    yaw = np.zeros((frames, 3))
    yaw[:, 2] = rng.uniform(-np.pi, np.pi, frames)
    q[:, 3:7] = quaternion_multiply(rotation_vector_to_quaternion(yaw), tilt)
    q[:, 7:] = rng.uniform(-0.5, 0.5, (frames, model.n_dof))
    v, a = 0.7 * rng.normal(size=(frames, model.nv)), 1.5 * rng.normal(size=(frames, model.nv))
    tree = real_tree(model)
    kinematics = tree_kinematics(tree, q, v)
    base = base_acceleration(kinematics, v, a)
    accelerations = link_accelerations(tree, kinematics, base, a[:, 6:])
    hand = tree.link_names.index("RightHandCOM")
    pull = -load_kg * times(kinematics.rotation[hand], accelerations[hand, :, :3])
    twist = beside * rng.normal(size=(frames, 3))
    held = Wrench("RightHandCOM", pull, times(kinematics.rotation[hand], twist))
    needed = inverse_dynamics(model, q, v, a, [held])[:, :6]
    force = times(kinematics.rotation[0], needed[:, :3])
    moment = times(kinematics.rotation[0], needed[:, 3:])
    feet = {name: tree.link_names.index(name) for name in ("RightFoot", "LeftFoot")}
    for link in feet.values():
        lever = kinematics.position[link] - kinematics.position[0]
        moment = moment - cross(lever, 0.5 * force)
    sensors: list[Measurement] = [JointAcceleration(a[:, 6:], 0.05**2), FreeWrench("RightHandCOM")]
    wrenches = [held]
    for name, link in feet.items():
        wrenches.append(Wrench(name, 0.5 * force, 0.5 * moment))
        back = transposed(kinematics.rotation[link])
        value = np.concatenate([times(back, 0.5 * force), times(back, 0.5 * moment)], axis=1)
        sensors.append(ForceTorque(name, value, FOOT_VARIANCE))
    for name in IMU_SEGMENTS:
        link = tree.link_names.index(name)
        place = rng.uniform(-0.1, 0.1, 3)
        here, w = accelerations[link], kinematics.omega[link]
        value = here[:, :3] + cross(here[:, 3:], place) + cross(w, cross(w, place))
        sensors.append(Accelerometer(name, value, 0.033**2, place))
    torque = inverse_dynamics(model, q, v, a, wrenches)[:, 6:]
    return Scene(q, v, a, sensors, torque, load_kg)


def noisy(
    scene: Scene, rng: np.random.Generator, tree: EstimationTree | None = None
) -> list[Measurement]:
    """Returns the readings with the noise that their covariances state.

    With a tree, links that nothing touches are touched as lightly as the estimator takes them to
    be: bands of what hangs from a joint without a load hold little else.
    """
    out: list[Measurement] = []
    if tree is not None:
        stated = ModelCovariances()
        sd = np.array([stated.untouched_force_sd] * 3 + [stated.untouched_moment_sd] * 3)
        known = {getattr(sensor, "link", "") for sensor in scene.sensors if _is_wrench(sensor)}
        for link in tree.link_names:
            if link not in known:
                out.append(ForceTorque(link, sd * rng.normal(size=(len(scene.q), 6)), sd**2))
    for sensor in scene.sensors:
        if isinstance(sensor, FreeWrench):
            out.append(sensor)
            continue
        value = np.asarray(sensor.value)
        sd = np.sqrt(np.asarray(sensor.covariance))
        out.append(replace(sensor, value=value + sd * rng.normal(size=value.shape)))
    return out


def _is_wrench(sensor: Measurement) -> bool:
    return isinstance(sensor, ForceTorque | FreeWrench)
