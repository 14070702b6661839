"""People who are not quite as their model says: each frame is another one, in another posture."""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from estimation import (
    ForceTorque,
    FreeWrench,
    Measurement,
    ModelCovariances,
    ModelErrors,
    real_tree,
)
from estimation.model_uncertainty import ModelDraw, draw_models
from human import Frame, HumanModel, Wrench, forward_kinematics, inverse_dynamics
from human.rotations import quaternion_multiply, rotation_vector_to_quaternion

FEET = ("RightFoot", "LeftFoot")
FOOT_SD = np.array([1.0] * 3 + [0.15] * 3)


@dataclass(frozen=True, slots=True)
class Strangers:
    """What is believed of each person and frame, what plates read, and the truth.

    Attributes:
        q: ``(n, nq)`` postures as believed.
        v: ``(n, nv)`` velocities.
        a: ``(n, nv)`` accelerations, with the errors that derived ones are said to have.
        sensors: plates with their stated noise, and a free right hand.
        torque: ``(n, n_dof)`` N m, true.
        load_kg: what the hand truly holds.
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    sensors: list[Measurement]
    torque: np.ndarray
    load_kg: float


def strangers(
    model: HumanModel,
    count: int,
    errors: ModelErrors,
    rng: np.random.Generator,
    *,
    load_kg: float = 5.0,
    weighed: bool = False,
) -> Strangers:
    """Draws people around a model and lets each hold a load while moving.

    Args:
        model: as believed.
        count: how many.
        errors: how far they are from it.
        rng: source of all randomness.
        load_kg: in the right hand.
        weighed: whether the model has their whole mass right.
    """
    tree = real_tree(model)
    draws = draw_models(
        tree,
        replace(errors, pairs=max(count, 2)),
        rng,
        plates=FEET,
        body_mass_sd_kg=0.0 if weighed else None,
    )[:count]
    q = np.zeros((count, model.nq))
    tilt = rotation_vector_to_quaternion(0.2 * rng.normal(size=(count, 3)))
    yaw = np.zeros((count, 3))
    yaw[:, 2] = rng.uniform(-np.pi, np.pi, count)
    q[:, 3:7] = quaternion_multiply(rotation_vector_to_quaternion(yaw), tilt)
    q[:, 7:] = rng.uniform(-0.5, 0.5, (count, model.n_dof))
    v, a = 0.3 * rng.normal(size=(count, model.nv)), 0.7 * rng.normal(size=(count, model.nv))
    torque = np.empty((count, model.n_dof))
    reading, point = np.empty((2, count, 6)), np.empty((2, count, 3))
    for row, draw in enumerate(draws):
        other, posture = other_body(model, draw), draw.configuration(q[[row]])[0]
        pull = -load_kg * proper_acceleration(other, posture, v[row], a[row], "RightHandCOM")
        held = Wrench("RightHandCOM", pull)
        needed = inverse_dynamics(other, posture, v[row], a[row], [held])[:6]
        poses, believed = forward_kinematics(other, posture), forward_kinematics(model, q[row])
        base, _ = poses.of("Pelvis")
        force, moment = base @ needed[:3], base @ needed[3:]
        wrenches = [held]
        places = [poses.of(name)[1] for name in FEET]
        for place in places:
            moment = moment - np.cross(place, 0.5 * force)
        for side, (name, place) in enumerate(zip(FEET, places, strict=True)):
            wrenches.append(Wrench(name, 0.5 * force, 0.5 * moment))
            reading[side, row] = np.concatenate([0.5 * force, 0.5 * moment])
            # The plate believes itself elsewhere, and so does the force.
            seen = believed.of(name)[1] if errors.feet_seen else place
            point[side, row] = seen - draw.plate_m[name]
        torque[row] = inverse_dynamics(other, posture, v[row], a[row], wrenches)[6:]
    reading += FOOT_SD * rng.normal(size=reading.shape)
    stated = ModelCovariances()
    sd = [stated.derived_acceleration_sd] * 3 + [stated.derived_angular_sd] * 3
    sd += [stated.derived_joint_sd] * model.n_dof
    a = a + np.array(sd) * rng.normal(size=a.shape)
    sensors: list[Measurement] = [
        ForceTorque(name, reading[side], FOOT_SD**2, point[side], fixed_to="world")
        for side, name in enumerate(FEET)
    ]
    return Strangers(q, v, a, [*sensors, FreeWrench("RightHandCOM", 300.0)], torque, load_kg)


def other_body(model: HumanModel, draw: ModelDraw) -> HumanModel:
    """Returns the person of a draw, made from the model's tables and not from the estimator's."""
    count = len(model.masses)
    longer, heavier = 1.0 + draw.length[:count], 1.0 + draw.mass[:count]
    frames = {
        name: Frame(frame.segment, frame.position * longer[model.segment_index(frame.segment)])
        for name, frame in model.frames.items()
    }
    return replace(
        model,
        offsets=model.offsets * longer[list(model.parents[1:]), None],
        masses=model.masses * heavier,
        centers_of_mass=model.centers_of_mass * longer[:, None],
        inertias=model.inertias * (heavier * longer**2)[:, None, None],
        frames=frames,
    )


def proper_acceleration(
    model: HumanModel, q: np.ndarray, v: np.ndarray, a: np.ndarray, name: str
) -> np.ndarray:
    """Acceleration of a frame less gravity ``(3,)`` m/s^2, world axes, by Pinocchio."""
    body = model.pinocchio()
    data = body.createData()
    pin.forwardKinematics(body, data, q, v, a)
    index = body.getFrameId(name)
    pin.updateFramePlacement(body, data, index)
    axes = pin.LOCAL_WORLD_ALIGNED
    moved = pin.getFrameClassicalAcceleration(body, data, index, axes).linear
    return np.asarray(moved - body.gravity.linear)
