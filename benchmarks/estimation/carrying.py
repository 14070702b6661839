"""Simulated people who carry a box on plates that feel everything, as a run takes them."""

from dataclasses import dataclass, replace

import numpy as np

from estimation import (
    Accelerometer,
    FootForce,
    FootForces,
    FootState,
    JointAcceleration,
    Measurement,
    PayloadHold,
    RunSettings,
    RunSummary,
    estimate_run,
)
from human import HumanModel, Motion
from human.rotations import (
    quaternion_multiply,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)
from human.simulate import (
    ImuNoise,
    SensorNoise,
    SimulatedMotion,
    imu_mounts,
    operator,
    simulate_box_handling,
    simulate_imus,
)

FOOT_SD = np.array([1.0] * 3 + [0.15] * 3)
ACCELEROMETER_SD, JOINT_SD = 0.033, 0.05


@dataclass(frozen=True, slots=True)
class Carrying:
    """A person, a box and who holds it."""

    model: HumanModel
    simulated: SimulatedMotion

    @classmethod
    def of(cls, model: HumanModel, box_kg: float, hands: str) -> "Carrying":
        """Simulates it once."""
        rng = np.random.default_rng(0)
        person = operator("average", rng, model)
        return cls(
            model,
            simulate_box_handling(model, person, rng, box_kg=box_kg, hands=hands, rate_hz=50.0),
        )

    def feet(self, rng: np.random.Generator) -> FootForces:
        """What is under each foot, with noise where its force enters."""
        motion, frames, feet = self.simulated.motion, len(self.simulated.motion), []
        assert self.simulated.truth.dynamics.feet is not None
        for true in self.simulated.truth.dynamics.feet:
            stands = true[:, 2] > 1.0
            down = np.where(stands, true[:, 2], 1.0)
            point = np.stack([-true[:, 4] / down, true[:, 3] / down, np.zeros(frames)], axis=1)
            point[~stands] = motion.q[~stands, :3]
            error = FOOT_SD * rng.normal(size=(frames, 6))
            wrench = true + error
            wrench[:, 3:] += np.cross(point, error[:, :3])
            state = np.full(frames, int(FootState.MEASURED))
            feet.append(FootForce(wrench, state, point, np.tile(FOOT_SD**2, (frames, 1))))
        return FootForces(
            time_s=motion.time_s,
            right=feet[0],
            left=feet[1],
            missing_n=np.zeros(frames),
            stances=(),
            clock_offset_s=0.0,
            assumed=(),
            findings=(),
        )

    def turned(self, feet: FootForces, angle: float) -> tuple[Motion, FootForces]:
        """The whole scene turned about the world's vertical axis, and put elsewhere."""
        turn = rotation_vector_to_quaternion(np.array([0.0, 0.0, angle]))
        R, shift = quaternion_to_matrix(turn), np.array([3.0, -1.0, 0.0])
        motion = self.simulated.motion
        q = motion.q.copy()
        q[:, :3] = q[:, :3] @ R.T + shift
        q[:, 3:7] = quaternion_multiply(np.broadcast_to(turn, (len(q), 4)), q[:, 3:7])

        def foot(old: FootForce) -> FootForce:
            force, moment = old.wrench[:, :3] @ R.T, old.wrench[:, 3:] @ R.T
            wrench = np.concatenate([force, moment + np.cross(shift, force)], axis=1)
            return replace(old, wrench=wrench, point=old.point @ R.T + shift)

        moved = replace(motion, q=q)
        return moved, replace(feet, right=foot(feet.right), left=foot(feet.left))

    def suit(self, rng: np.random.Generator) -> list[Measurement]:
        """Accelerometers on 17 segments, and joint accelerations."""
        motion = self.simulated.motion
        noise = ImuNoise(accelerometer=SensorNoise(sd=ACCELEROMETER_SD))
        mounts = imu_mounts(self.model, rng)
        out: list[Measurement] = [
            Accelerometer(
                each.mount.segment,
                each.acceleration,
                ACCELEROMETER_SD**2,
                each.mount.position,
                each.mount.rotation,
            )
            for each in simulate_imus(self.model, motion, mounts, rng, noise=noise)
        ]
        joints = motion.a[:, 6:] + JOINT_SD * rng.normal(size=(len(motion), self.model.n_dof))
        return [*out, JointAcceleration(joints, JOINT_SD**2)]

    def weighed(
        self, settings: RunSettings, rng: np.random.Generator, *, suit: bool
    ) -> tuple[PayloadHold, RunSummary]:
        """Estimates the run; returns its heaviest hold and its summary."""
        sensors = self.suit(rng) if suit else []
        motion = self.simulated.motion
        _, summary = estimate_run(self.model, motion, self.feet(rng), settings, sensors)
        return max(summary.holds, key=lambda hold: hold.mass().mass_kg), summary
