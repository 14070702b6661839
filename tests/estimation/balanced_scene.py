"""A person in any motion with a load in one hand, whose feet bear what balance asks; by Pinocchio.

Nothing here uses the estimator's kinematics: readings, wrenches and true torques are Pinocchio's.
"""

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from estimation import (
    Accelerometer,
    AngularAcceleration,
    ForceTorque,
    FreeWrench,
    JointAcceleration,
)
from human.rotations import rotation_vector_to_matrix

G = np.array([0.0, 0.0, -9.81])
FOOT_SD = np.array([1.0, 1.0, 1.0, 0.15, 0.15, 0.15])


@dataclass
class Scene:
    """True motion, torques and readings of ``frames`` frames."""

    model: object
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    load: np.ndarray
    torque: np.ndarray
    sensors: list

    def load_world(self, hand="RightHandCOM"):
        """The load's pull in world axes."""
        model = self.model.pinocchio()
        data, out = model.createData(), []
        for q, load in zip(self.q, self.load, strict=True):
            pin.framesForwardKinematics(model, data, q)
            out.append(data.oMf[model.getFrameId(hand)].rotation @ load)
        return np.array(out)

    def noisy(self, rng):
        """The same readings with the noise that their covariances state."""
        out = []
        for sensor in self.sensors:
            if isinstance(sensor, FreeWrench):
                out.append(sensor)
                continue
            sd = np.sqrt(np.asarray(sensor.covariance))
            noise = sd * rng.normal(size=np.shape(sensor.value))
            out.append(replace(sensor, value=sensor.value + noise))
        return out

    def with_variances(self, **by_kind):
        """The same readings, believed differently."""
        return [
            replace(sensor, covariance=by_kind[type(sensor).__name__])
            if type(sensor).__name__ in by_kind
            else sensor
            for sensor in self.sensors
        ]


def random_motion(model, rng, frames, speed=1.0):
    """States within a person's reach, at a person's speeds and accelerations."""
    q = np.zeros((frames, model.nq))
    q[:, :3] = rng.normal(size=(frames, 3))
    q[:, 3:7] = rng.normal(size=(frames, 4))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    q[:, 7:] = rng.uniform(-0.7, 0.7, (frames, model.n_dof))
    v = speed * rng.normal(size=(frames, model.nv))
    return q, v, speed * 2.0 * rng.normal(size=(frames, model.nv))


def balanced(model, q, v, a, rng, load_kg=5.0, hand="RightHandCOM", imus=17):
    """Makes a scene: IMUs on segments, a sensor at each foot's heel and toe, a load in a hand."""
    pin_model = model.pinocchio().copy()
    places = {}
    for name in model.segment_names[:imus]:
        base = pin_model.frames[pin_model.getFrameId(name)]
        place = pin.SE3(rotation_vector_to_matrix(rng.normal(size=3)), rng.uniform(-0.1, 0.1, 3))
        pin_model.addFrame(
            pin.Frame(
                f"imu_{name}",
                base.parentJoint,
                0,
                base.placement * place,
                pin.FrameType.OP_FRAME,
            )
        )
        places[name] = place
    data = pin_model.createData()
    readings = {name: [] for name in places}
    feet = {name: [] for name in ("RightFoot", "LeftFoot")}
    load, torque = np.empty((len(q), 3)), np.empty((len(q), model.n_dof))
    for frame in range(len(q)):
        tau = pin.rnea(pin_model, data, q[frame], v[frame], a[frame])
        pin.forwardKinematics(pin_model, data, q[frame], v[frame], a[frame])
        pin.updateFramePlacements(pin_model, data)

        def proper(name):
            index = pin_model.getFrameId(name)
            motion = pin.getFrameClassicalAcceleration(pin_model, data, index, pin.LOCAL)
            turned = data.oMf[index].rotation.T
            return np.r_[motion.linear - turned @ G, motion.angular], turned

        def jacobian(name, frame=frame):
            index = pin_model.getFrameId(name)
            return pin.computeFrameJacobian(pin_model, data, q[frame], index, pin.LOCAL)

        for name in places:
            readings[name].append(proper(f"imu_{name}")[0])
        # A point mass held in the hand pulls with its weight and inertia.
        load[frame] = -load_kg * proper(hand)[0][:3]
        tau = tau - jacobian(hand).T @ np.r_[load[frame], np.zeros(3)]
        left = np.r_[0.4 * tau[:3], rng.normal(size=3)]
        tau = tau - jacobian("LeftFoot").T @ left
        J = jacobian("RightFoot").T
        right = np.linalg.solve(J[:6], tau[:6])
        tau = tau - J @ right
        feet["RightFoot"].append(right)
        feet["LeftFoot"].append(left)
        torque[frame] = tau[6:]
    sensors = [JointAcceleration(a[:, 6:], 0.05**2), FreeWrench(hand)]
    for name, place in places.items():
        value = np.array(readings[name])
        sensors.append(
            Accelerometer(name, value[:, :3], 0.033**2, place.translation, place.rotation)
        )
        if name == "Pelvis":
            sensors.append(AngularAcceleration(name, value[:, 3:], 0.5**2, place.rotation))
    for name, wrench in feet.items():
        sensors.extend(_two_parts(name, np.array(wrench), rng))
    return Scene(model, q, v, a, load, torque, sensors)


def _two_parts(name, wrench, rng):
    """Splits a foot's wrench between a heel's and a toe's sensor, each in its own frame."""
    share = rng.normal(size=wrench.shape) * np.array([50.0] * 3 + [5.0] * 3)
    for part, x in ((wrench - share, -0.05), (share, 0.12)):
        R, p = rotation_vector_to_matrix(rng.normal(size=3)), np.array([x, 0.01, -0.06])
        moment = part[:, 3:] - np.cross(p, part[:, :3])
        value = np.concatenate([part[:, :3] @ R, moment @ R], axis=1)
        yield ForceTorque(name, value, FOOT_SD**2 / 2.0, p, R)
