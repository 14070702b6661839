"""Driver B, the user's path: marker files and plates in, torques out, nothing else known.

The joints' torques are put together again to the moment's vector, so that it can be projected on
any axis.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.estimation.real_motion.reference import LEGS, LOW_BACK, Array, Estimated
from estimation import RunChunk, RunSettings, estimate_run, feet_from_plates
from human import HumanModel, Subject, forward_kinematics
from human.marker_recording import MarkerRecording, PlateForces
from human.markers import body_from_static, fit_markers
from human.model import BASE_NQ


@dataclass(frozen=True, slots=True)
class UserRun:
    """The moments at the compared joints, and the run's own record of everything."""

    found: Estimated
    chunk: RunChunk


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
    settings = RunSettings(unobserved=body.unobserved())
    chunk, summary = estimate_run(fitted.model, fitted.motion, feet, settings)
    rows = np.searchsorted(fitted.motion.time_s, chunk.time_s)
    joints = (*LEGS, LOW_BACK)
    torque = _vectors(fitted.model, fitted.motion.q[rows], chunk.torque_nm, joints)
    dofs = np.array([name.rpartition("_")[0] for name in fitted.model.dof_names])
    known = {name: np.all(chunk.torque_known[:, dofs == name], axis=1) for name in joints}
    found = Estimated(
        driver="B, user path", time_s=chunk.time_s, moment=torque, known=known,
        notes=(f"{subject.mass_kg:.1f} kg, {subject.height_m:.2f} m; markers met within "
               f"{1e3 * fitted.rms_m:.1f} mm rms", *summary.findings),
    )  # fmt: skip
    return UserRun(found, chunk)


def _vectors(
    model: HumanModel, q: Array, torque: Array, joints: tuple[str, ...]
) -> dict[str, Array]:
    """Returns each joint's moment in world axes from its three torques.

    A torque is the moment's projection on its axis; the three axes span space.
    """
    turn = forward_kinematics(model, q).rotation
    out = {}
    for joint in joints:
        index = model.joint_names.index(joint)
        parent = turn[:, model.parents[index + 1]]
        angle = q[:, BASE_NQ + model.joint_dofs(index)]
        after_x = np.stack([np.zeros(len(q)), np.cos(angle[:, 0]), np.sin(angle[:, 0])], axis=1)
        child = turn[:, index + 1]
        second = np.einsum("tij,tj->ti", parent, after_x)
        axes = np.stack([parent[:, :, 0], second, child[:, :, 2]], axis=1)
        moment = np.linalg.solve(axes, torque[:, model.joint_dofs(index), None])
        out[joint] = moment[..., 0]
    return out
