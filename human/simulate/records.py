"""What a simulation hands over: the motion, and the truth behind it to score estimators against."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from human.motion import Motion
from human.simulate.ground import Dynamics
from human.simulate.operators import Operator
from human.simulate.paths import PoseSamples

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Truth:
    """Everything about a simulated motion that an estimator would like to know.

    Attributes:
        operator: the person, with W and C by degree of freedom.
        dof: indices of the joints that were led by the law, ``n``, among the model's.
        noise: what was added to z for those joints, ``T x n`` [rad/s].
        hands: hand frame to the pose and twist it was led along, world axes.
        segment_id: number of the movement each sample belongs to, ``T``; -1 in pauses.
        load_kg: hand frame to the mass it carries, ``T`` [kg].
        contact_right: whether the right foot stands, ``T``.
        contact_left: whether the left foot stands, ``T``.
        dynamics: true efforts and ground wrenches.
    """

    operator: Operator
    dof: NDArray[np.intp]
    noise: Array
    hands: Mapping[str, PoseSamples]
    segment_id: NDArray[np.int64]
    load_kg: Mapping[str, Array]
    contact_right: NDArray[np.bool_]
    contact_left: NDArray[np.bool_]
    dynamics: Dynamics

    @property
    def mobility(self) -> Array:
        """True diagonal of W for the led joints, ``n``."""
        return self.operator.mobility[self.dof]

    def null_velocity(self, motion: Motion) -> Array:
        """Returns the true noise-free z of the led joints, ``T x n`` [rad/s]."""
        comfort = self.operator.comfort.of(self.dof)
        return comfort.null_velocity(motion.joint_angles[:, self.dof])


@dataclass(frozen=True, slots=True)
class SimulatedMotion:
    """A simulated recording.

    Attributes:
        motion: what a motion-capture suit without error would record.
        truth: what it would not.
    """

    motion: Motion
    truth: Truth
