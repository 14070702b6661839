"""Driver B, the user's path: marker files and plates in, torques out, nothing else known.

The joints' torques are put together again to the moment's vector, so that it can be projected on
any axis.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.estimation.real_motion.reference import LEGS, LOW_BACK, Array, Banded, Estimated
from estimation import ModelErrors, RunChunk, RunSettings, estimate_run, feet_from_plates
from human import HumanModel, Subject, forward_kinematics
from human.marker_recording import MarkerRecording, PlateForces
from human.markers import body_from_static, fit_markers
from human.model import BASE_NQ, IntArray


@dataclass(frozen=True, slots=True)
class UserRun:
    """The moments at the compared joints, the run's own record, flexion torques with bands."""

    found: Estimated
    chunk: RunChunk
    flexion: dict[str, Banded]


def user_path(
    static: MarkerRecording, recording: MarkerRecording, plates: PlateForces, subject: Subject
) -> UserRun:
    """Estimates a recording with the settings that a user gets who sets nothing.

    Args:
        static: the standing trial, or the recording itself where there is none.
        recording: markers.
        plates: force plates of the same trial.
        subject: the person.
    """
    body = body_from_static(static, subject)
    fitted = fit_markers(body, recording)
    feet = feet_from_plates(fitted.model, fitted.motion, plates)
    settings = RunSettings(unobserved=body.unobserved(), model_errors=ModelErrors(feet_seen=True))
    chunk, summary = estimate_run(fitted.model, fitted.motion, feet, settings)
    rows = np.searchsorted(fitted.motion.time_s, chunk.time_s)
    joints = (*LEGS, LOW_BACK)
    axes = {name: _axes(fitted.model, fitted.motion.q[rows], name) for name in joints}
    torque = {name: chunk.torque_nm[:, _dofs(fitted.model, name)] for name in joints}
    moment = {name: np.linalg.solve(axes[name], torque[name][..., None])[..., 0] for name in joints}
    flexion = {}
    if chunk.torque_sd_nm is not None:
        sd = {name: chunk.torque_sd_nm[:, _dofs(fitted.model, name)] for name in joints}
        # The second axis is that of flexion in all these joints.
        flexion = {
            name: Banded(axes[name][:, 1], torque[name][:, 1], sd[name][:, 1]) for name in joints
        }
    known = {
        name: np.all(chunk.torque_known[:, _dofs(fitted.model, name)], axis=1) for name in joints
    }
    found = Estimated(
        driver="B, user path", time_s=chunk.time_s, moment=moment, known=known,
        notes=(f"{subject.mass_kg:.1f} kg, {subject.height_m:.2f} m; markers met within "
               f"{1e3 * fitted.rms_m:.1f} mm rms", *summary.findings),
    )  # fmt: skip
    return UserRun(found, chunk, flexion)


def _dofs(model: HumanModel, joint: str) -> IntArray:
    return model.joint_dofs(model.joint_names.index(joint))


def _axes(model: HumanModel, q: Array, joint: str) -> Array:
    """Returns the axes ``(frames, 3, 3)`` of a joint's torques in the world, one a row."""
    turn = forward_kinematics(model, q).rotation
    index = model.joint_names.index(joint)
    parent, child = turn[:, model.parents[index + 1]], turn[:, index + 1]
    first = q[:, BASE_NQ + model.joint_dofs(index)[0]]
    after_first = np.stack([np.zeros(len(q)), np.cos(first), np.sin(first)], axis=1)
    second = np.einsum("tij,tj->ti", parent, after_first)
    return np.stack([parent[:, :, 0], second, child[:, :, 2]], axis=1)
