"""What stays where it is while a person is led, and how the pelvis moves over feet that stand."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from app.assessments.poses import Array, Pose
from human import Chain, HumanModel, forward_kinematics, frame_poses
from human.names import BASE_SEGMENT
from human.rotations import matrix_to_quaternion


@dataclass(frozen=True, slots=True)
class Footing:
    """The segment that stays in place, and what it carries.

    Attributes:
        pose: ``T_world_base``: of the segment that the predicted chain starts from.
        carried: From that segment to the pelvis; None where the pelvis itself stays.
    """

    pose: Pose
    carried: Chain | None

    @classmethod
    def of(cls, model: HumanModel, q: Array, base: str) -> Self:
        """Takes the place of segment ``base`` in configuration ``q`` ``(nq,)``."""
        rotation, position = frame_poses(model, forward_kinematics(model, q), base)
        carried = None if base == BASE_SEGMENT else Chain(model, BASE_SEGMENT, base)
        return cls(Pose(rotation, position), carried)

    def stand(self, q: Array) -> None:
        """Puts the pelvis where joint angles and the standing foot have it, in place.

        Args:
            q: ``(..., nq)``; joint angles as they are to be.
        """
        if self.carried is None:
            return
        position, rotation = self.carried.forward(q[..., 7:][..., self.carried.dof_indices])
        pelvis = self.pose @ Pose(rotation, position)
        q[..., :3], q[..., 3:7] = pelvis.position, matrix_to_quaternion(pelvis.rotation)

    def twist(self, angles: Array, rates: Array) -> Array:
        """Returns the velocity of the pelvis in its own axes, ``(..., 6)``, linear (m/s) first.

        Args:
            angles: ``(..., n_dof)`` rad.
            rates: ``(..., n_dof)`` rad/s.
        """
        if self.carried is None:
            return np.zeros((*angles.shape[:-1], 6))
        legs = self.carried.dof_indices
        _, rotation, jacobian = self.carried.forward_and_jacobian(angles[..., legs])
        moved = (jacobian @ rates[..., legs, None])[..., 0]
        back = np.swapaxes(rotation, -1, -2)
        own = [(back @ moved[..., k : k + 3, None])[..., 0] for k in (0, 3)]
        return np.concatenate(own, axis=-1)
