"""Joint angles as a laboratory logged them, with accelerometers and wrenches of the same log."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from human.differentiate import motion_from_configurations
from human.errors import RecordingError
from human.model import BASE_NQ, BASE_NV, HumanModel
from human.motion import Motion, Provenance
from human.recording import ReadingReport

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
        base: ``(frames, 7)`` base position (m) and quaternion xyzw in z-up axes, or None.
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
    base: Array | None
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

        Degrees of freedom that the log does not have stay at zero (the T-pose), and a base that it
        does not have stays at the origin (``base="fixed"``); both are named in the provenance.

        Raises:
            RecordingError: a joint of the log is no degree of freedom of the model.
        """
        unknown = [name for name in self.joint_names if name not in model.dof_names]
        if unknown:
            raise RecordingError(
                f"{self.source}, joints: expected degrees of freedom of the model such as "
                f"{model.dof_names[0]}, got {', '.join(unknown)}; name them so in the column map."
            )
        at = np.array([model.dof_names.index(name) for name in self.joint_names], dtype=np.intp)
        q = np.tile(model.neutral(), (len(self.time_s), 1))
        q[:, BASE_NQ + at] = self.position
        if self.base is not None:
            q[:, :BASE_NQ] = self.base
        assumed = {}
        missing = [name for name in model.dof_names if name not in self.joint_names]
        if missing:
            assumed["joints"] = f"not logged, kept at zero: {', '.join(missing)}"
        if self.base is None:
            assumed["base"] = "not logged, kept at the origin"
        motion = motion_from_configurations(
            model.dof_names, self.time_s, q,
            base="fixed" if self.base is None else "measured",
            provenance=Provenance(self.source, self.digest, self.report.conversions, assumed),
        )  # fmt: skip
        v, a = motion.v.copy(), motion.a.copy()
        for whole, logged in ((v, self.velocity), (a, self.acceleration)):
            if logged is not None:
                whole[:, BASE_NV + at] = logged
        return replace(motion, v=v, a=a)
