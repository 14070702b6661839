"""Joint angles as a laboratory logged them, with accelerometers and wrenches of the same log."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from human.differentiate import motion_from_configurations
from human.errors import RecordingError
from human.kinematics import forward_kinematics
from human.model import BASE_NQ, BASE_NV, HumanModel
from human.motion import Motion, Provenance
from human.recording import ReadingReport
from human.rotations import matrix_to_quaternion, quaternion_continuous

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LoggedVector:
    """A sensor's readings in its own frame.

    Attributes:
        frame: where it sits and which axes it has, in the words of the log.
        values: ``(frames, 3)`` an accelerometer's m/s², or ``(frames, 6)`` a wrench, force (N)
            first, then moment (N m), in that frame and about its origin.
    """

    frame: str
    values: Array


@dataclass(frozen=True, slots=True)
class JointLog:
    """Joint states over time, and what else was logged with them.

    Attributes:
        source: file name, without its folder.
        format: ``csv`` or ``mat``.
        time_s: ``(frames,)`` strictly increasing.
        rate_hz: nominal.
        joint_names: of the columns, as the log's column map names them.
        position: ``(frames, joints)`` rad.
        velocity: ``(frames, joints)`` rad/s, or None where it was not logged.
        acceleration: ``(frames, joints)`` rad/s², or None.
        kept: angles (rad) that joints keep which were not logged, by name.
        base: ``(frames, 7)`` base position (m) and quaternion xyzw in z-up axes, or None.
        standing_on: segment that stays level and where its origin stays (m, z up), or None.
        accelerometers: by name.
        wrenches: by name; the sign is the log's.
        report: conversions and findings.
        digest: SHA-256 of the file.

    Raises:
        RecordingError: the arrays do not fit each other or are not finite.
    """

    source: str
    format: str
    time_s: Array
    rate_hz: float
    joint_names: tuple[str, ...]
    position: Array
    velocity: Array | None
    acceleration: Array | None
    kept: Mapping[str, float]
    base: Array | None
    standing_on: tuple[str, tuple[float, ...]] | None
    accelerometers: Mapping[str, LoggedVector]
    wrenches: Mapping[str, LoggedVector]
    report: ReadingReport
    digest: str

    def __post_init__(self) -> None:
        """Checks the shapes and that everything is finite."""
        frames, joints = len(self.time_s), len(self.joint_names)
        arrays = {name: (getattr(self, name), joints) for name in
                  ("position", "velocity", "acceleration")}  # fmt: skip
        arrays["base"] = (self.base, BASE_NQ)
        arrays |= {f"accelerometer {n}": (v.values, 3) for n, v in self.accelerometers.items()}
        arrays |= {f"wrench {n}": (v.values, 6) for n, v in self.wrenches.items()}
        for name, (array, width) in arrays.items():
            if array is None:
                continue
            if array.shape != (frames, width) or not np.all(np.isfinite(array)):
                raise RecordingError(
                    f"{self.source}, {name}: expected finite values of shape {(frames, width)}, "
                    f"got shape {array.shape} with {int(np.sum(~np.isfinite(array)))} not finite."
                )

    def to_motion(self, model: HumanModel) -> Motion:
        """Returns the model's motion; rates and accelerations that were not logged are derived.

        Degrees of freedom that the log does not have stay at zero (the T-pose). A base that it
        does not have follows from the segment that the person stands on, and then all rates are
        derived, so that this segment rests; or it stays at the origin (``base="fixed"``). All this
        is named in the provenance.

        Raises:
            RecordingError: a joint of the log is no degree of freedom of the model.
            UnknownNameError: the person stands on what is no segment of the model.
        """
        named = (*self.joint_names, *self.kept)
        unknown = [name for name in named if name not in model.dof_names]
        if unknown:
            raise RecordingError(
                f"{self.source}, joints: expected degrees of freedom of the model such as "
                f"{model.dof_names[0]}, got {', '.join(unknown)}; name them so in the column map."
            )
        q = np.tile(model.neutral(), (len(self.time_s), 1))
        at = np.array([model.dof_names.index(name) for name in self.joint_names], dtype=np.intp)
        q[:, BASE_NQ + at] = self.position
        for name, angle in self.kept.items():
            q[:, BASE_NQ + model.dof_names.index(name)] = angle
        if self.base is not None:
            q[:, :BASE_NQ] = self.base
        elif self.standing_on is not None:
            q[:, :BASE_NQ] = _base_standing(model, q, *self.standing_on)
        motion = motion_from_configurations(
            model.dof_names, self.time_s, q,
            base="fixed" if self.base is None and self.standing_on is None else "measured",
            provenance=Provenance(
                self.source, self.digest, self.report.conversions, self._assumed(model)
            ),
        )  # fmt: skip
        if self.base is None and self.standing_on is not None:
            return motion
        v, a = motion.v.copy(), motion.a.copy()
        for whole, logged in ((v, self.velocity), (a, self.acceleration)):
            if logged is not None:
                whole[:, BASE_NV + at] = logged
        return replace(motion, v=v, a=a)

    def _assumed(self, model: HumanModel) -> dict[str, str]:
        assumed = {}
        missing = [n for n in model.dof_names if n not in self.joint_names and n not in self.kept]
        if missing:
            assumed["joints"] = f"not logged, kept at zero: {', '.join(missing)}"
        if self.kept:
            assumed["kept"] = f"not logged, kept as the column map says: {', '.join(self.kept)}"
        if self.base is None:
            assumed["base"] = (
                "not logged, kept at the origin" if self.standing_on is None
                else f"not logged: {self.standing_on[0]} is taken to rest on the floor"
            )  # fmt: skip
        return assumed


def _base_standing(model: HumanModel, q: Array, segment: str, position: tuple[float, ...]) -> Array:
    """Returns the base pose ``(frames, 7)`` with which a segment is level at a place.

    Derived here: with the base at the origin the segment has rotation R and origin p; turning by
    R transposed levels it, and the base is then R transposed times -p away from it.
    """
    model.segment_index(segment)
    rotation, origin = forward_kinematics(model, q).of(segment)
    level = np.swapaxes(rotation, -1, -2)
    place = np.asarray(position) - (level @ origin[..., None])[..., 0]
    return np.concatenate([place, quaternion_continuous(matrix_to_quaternion(level))], axis=1)
