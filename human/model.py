"""The human model: segments, joints, degrees of freedom, masses; and the person it stands for.

A model is data. It is made by `human.generate.generate_model` from height, mass and sex, by
`human.generate.scale_model` from measured joint offsets, or by `human.urdf_reader.from_urdf`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Literal, get_args

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from human.errors import SubjectError, UnknownNameError
from human.shapes import Shape

Array = NDArray[np.float64]
IntArray = NDArray[np.intp]
Sex = Literal["female", "male", "unknown"]

#: Height (m), mass (kg) and body mass index (kg/m^2) the anthropometric tables are stretched to at
#: most.
ACCEPTED_HEIGHT_M = (1.2, 2.3)
ACCEPTED_MASS_KG = (30.0, 250.0)
ACCEPTED_BODY_MASS_INDEX = (11.0, 80.0)

#: Configurations start with the base: position (3) and quaternion xyzw (4); velocities with its
#: twist (6).
BASE_NQ = 7
BASE_NV = 6


@dataclass(frozen=True, slots=True)
class Subject:
    """The person: height in metres, mass in kilograms, sex ``female``, ``male`` or ``unknown``.

    For ``unknown`` the tables of both sexes are averaged, and the model says so in its provenance.

    Raises:
        SubjectError: a value is not finite or outside the accepted range.
    """

    height_m: float
    mass_kg: float
    sex: Sex = "unknown"

    def __post_init__(self) -> None:
        """Refuses what no adult is."""
        _within("height in m", self.height_m, ACCEPTED_HEIGHT_M)
        _within("mass in kg", self.mass_kg, ACCEPTED_MASS_KG)
        _within("body mass index in kg/m^2", self.body_mass_index, ACCEPTED_BODY_MASS_INDEX)
        if self.sex not in get_args(Sex):
            raise SubjectError("sex", self.sex, " or ".join(get_args(Sex)))

    @property
    def body_mass_index(self) -> float:
        """Mass over height squared, kg/m^2."""
        return self.mass_kg / self.height_m**2


def _within(quantity: str, value: object, accepted: tuple[float, float]) -> None:
    low, high = accepted
    real = isinstance(value, int | float | np.floating | np.integer) and not isinstance(value, bool)
    if not real or not math.isfinite(value) or not low <= value <= high:  # type: ignore[arg-type, operator]
        raise SubjectError(quantity, value, f"a number from {low:g} to {high:g}")


@dataclass(frozen=True, slots=True)
class Frame:
    """A named point fixed to a segment, its axes those of the segment.

    Attributes:
        segment: the segment's name.
        position: ``(3,)`` metres, in segment axes from the segment's proximal joint.
    """

    segment: str
    position: Array


@dataclass(frozen=True, eq=False)
class HumanModel:
    """A person as a tree of rigid segments; frozen, its arrays read-only.

    Each segment's frame sits at its proximal joint, aligned with the world at zero configuration
    (the T-pose: x forward, y left, z up). Each joint is one to three revolutes about segment axes,
    or none.

    Attributes:
        name: what the model is called in files.
        segment_names: ``n_segments`` names, parents before children; the first is the base.
        parents: index of each segment's parent; -1 for the base.
        joint_names: the proximal joint of each segment but the base: joint ``j`` moves segment ``j
            + 1``.
        offsets: ``(n_joints, 3)`` m, joint centre in the parent segment's axes from the parent's
            joint.
        dof_names: ``n_dof`` names such as ``jRightShoulder_rotx``.
        dof_joints: ``(n_dof,)`` joint that each degree of freedom belongs to, in order.
        dof_axes: ``(n_dof,)`` 0, 1 or 2: the axis it turns about, in the axes left by those before
            it.
        lower: ``(n_dof,)`` rad.
        upper: ``(n_dof,)`` rad.
        masses: ``(n_segments,)`` kg.
        centers_of_mass: ``(n_segments, 3)`` m, segment axes, from the segment's proximal joint.
        inertias: ``(n_segments, 3, 3)`` kg m^2 about the centre of mass, segment axes.
        frames: named points; ``RightHandCOM`` and ``LeftHandCOM`` are where a held load acts.
        shapes: the solid of each segment, for showing it; empty where none is known.
        subject: the person, if known.
        provenance: where each kind of number came from, in words.

    Source: Latella et al. 2019, section 2.3.
    """

    name: str
    segment_names: tuple[str, ...]
    parents: tuple[int, ...]
    joint_names: tuple[str, ...]
    offsets: Array
    dof_names: tuple[str, ...]
    dof_joints: IntArray
    dof_axes: IntArray
    lower: Array
    upper: Array
    masses: Array
    centers_of_mass: Array
    inertias: Array
    frames: Mapping[str, Frame]
    shapes: Mapping[str, Shape] = field(default_factory=dict)
    subject: Subject | None = None
    provenance: Mapping[str, str] = field(default_factory=dict)
    _cache: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        """Makes every array and mapping read-only."""
        for (
            name
        ) in "offsets dof_joints dof_axes lower upper masses centers_of_mass inertias".split():
            array = np.array(getattr(self, name))
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        for name in ("frames", "shapes", "provenance"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def __getstate__(self) -> dict[str, Any]:
        """Leaves out what is computed on demand, so that a model can be sent to another process."""
        state = dict(self.__dict__)
        for name in ("frames", "shapes", "provenance"):
            state[name] = dict(state[name])
        return state | {"_cache": {}}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Takes the fields back and makes them read-only again."""
        self.__dict__.update(state)
        self.__post_init__()

    @property
    def n_dof(self) -> int:
        """Number of joint degrees of freedom, without the base."""
        return len(self.dof_names)

    @property
    def nq(self) -> int:
        """Length of a configuration: base position, base quaternion xyzw, joint angles."""
        return BASE_NQ + self.n_dof

    @property
    def nv(self) -> int:
        """Length of a velocity: base twist (body axes, linear first), joint rates."""
        return BASE_NV + self.n_dof

    @property
    def total_mass_kg(self) -> float:
        """Sum of the segment masses, kg."""
        return math.fsum(self.masses)

    def segment_index(self, name: str) -> int:
        """Returns the index of a segment.

        Raises:
            UnknownNameError: the model has no such segment.
        """
        if name not in self.segment_names:
            raise UnknownNameError("segment", name, self.segment_names)
        return self.segment_names.index(name)

    def point(self, name: str) -> tuple[int, Array]:
        """Returns the segment index and position ``(3,)`` of a frame, or of a segment's own origin.

        Raises:
            UnknownNameError: neither a frame nor a segment has that name.
        """
        if name in self.frames:
            frame = self.frames[name]
            return self.segment_index(frame.segment), frame.position
        if name in self.segment_names:
            return self.segment_index(name), np.zeros(3)
        raise UnknownNameError("frame or segment", name, (*self.frames, *self.segment_names))

    def joint_dofs(self, joint: int) -> IntArray:
        """Returns the indices of a joint's degrees of freedom, in the order in which they turn."""
        return np.flatnonzero(self.dof_joints == joint)

    def neutral(self) -> Array:
        """Returns the T-pose configuration ``(nq,)``: base at the world origin, all angles zero."""
        q = np.zeros(self.nq)
        q[6] = 1.0
        return q

    def pinocchio(self) -> pin.Model:
        """Returns the model for Pinocchio: free-flyer, then the revolutes in ``dof_names`` order.

        Built once; do not change it. Frames carry the segments' and named points' names.
        """
        if "pinocchio" not in self._cache:
            self._cache["pinocchio"] = _to_pinocchio(self)
        return self._cache["pinocchio"]


def _to_pinocchio(model: HumanModel) -> pin.Model:
    out = pin.Model()
    out.name = model.name
    revolute = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)
    # Pinocchio joint, and placement in its axes, that each segment's frame is fixed to.
    holder: list[int] = []
    shift: list[Array] = []
    for index, parent in enumerate(model.parents):
        if parent < 0:
            joint = out.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root_joint")
            place = np.zeros(3)
        else:
            joint, place = holder[parent], shift[parent] + model.offsets[index - 1]
            for dof in model.joint_dofs(index - 1):
                joint = out.addJoint(
                    joint,
                    revolute[int(model.dof_axes[dof])](),
                    pin.SE3(np.eye(3), place),
                    model.dof_names[dof],
                )
                place = np.zeros(3)
        holder.append(joint)
        shift.append(place)
        inertia = pin.Inertia(
            float(model.masses[index]), model.centers_of_mass[index], model.inertias[index]
        )
        out.appendBodyToJoint(joint, inertia, pin.SE3(np.eye(3), place))
        name = model.segment_names[index]
        out.addFrame(pin.Frame(name, joint, 0, pin.SE3(np.eye(3), place), pin.FrameType.BODY))
    for name, frame in model.frames.items():
        index = model.segment_index(frame.segment)
        place = pin.SE3(np.eye(3), shift[index] + frame.position)
        out.addFrame(pin.Frame(name, holder[index], 0, place, pin.FrameType.OP_FRAME))
    out.lowerPositionLimit = np.r_[np.full(7, -np.inf), model.lower]
    out.upperPositionLimit = np.r_[np.full(7, np.inf), model.upper]
    return out
