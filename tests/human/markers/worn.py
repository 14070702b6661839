"""A person with markers on and a motion that is known, for the tests of fitting."""

import numpy as np

from human import HumanModel, forward_kinematics
from human.marker_recording import MarkerRecording
from human.markers import MarkerBody
from human.markers.ik_priors import reference_angles
from human.recording import ReadingReport

RATE_HZ = 100.0


def worn(model: HumanModel, segments: tuple[str, ...], each: int = 4) -> MarkerBody:
    """Markers scattered ten centimetres about some segments, the same on every run."""
    rng = np.random.default_rng(7)
    segment = np.repeat([model.segment_index(name) for name in segments], each)
    return MarkerBody(
        model=model,
        marker_names=tuple(f"{model.segment_names[s]}{k}" for k, s in enumerate(segment)),
        segment=segment,
        offset=rng.uniform(-0.1, 0.1, (len(segment), 3)),
        sd_m=np.full(len(segment), 0.005),
        observed=segments,
    )


def swaying(model: HumanModel, frames: int, seed: int = 3) -> np.ndarray:
    """Every angle swings well inside its limits; stiff ones stay at zero; the trunk shares bends.

    Likely postures by the prior of the fit, so that nothing but the data and numbers decide.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(frames)[:, None] / RATE_HZ
    q = np.tile(model.neutral(), (frames, 1))
    low, high = np.clip(model.lower, -1.0, 1.0), np.clip(model.upper, -1.0, 1.0)
    swing = np.sin(
        2 * np.pi * rng.uniform(0.2, 0.6, model.n_dof) * time + rng.uniform(0, 6, model.n_dof)
    )
    angles = 0.5 * (high + low) + 0.35 * (high - low) * swing
    for k, name in enumerate(model.dof_names):
        if "Shoulder_rot" in name and "C7" not in name:
            angles[:, k] = reference_angles(model)[k] + 0.5 * swing[:, k]
        if name.endswith(("C7Shoulder_roty", "Knee_rotx", "Wrist_roty", "Elbow_rotx")) or (
            "BallFoot" in name and not name.endswith("roty")
        ):
            angles[:, k] = 0.0
    # An elbow bends about z and turns about the forearm: x follows from y and z.
    for side in ("Right", "Left"):
        x, y, z = (model.dof_names.index(f"j{side}Elbow_rot{axis}") for axis in "xyz")
        angles[:, x] = np.arctan2(
            -np.sin(angles[:, y]) * np.sin(angles[:, z]), np.cos(angles[:, z])
        )
    for joints in (("jL5S1", "jL4L3", "jL1T12", "jT9T8"), ("jT1C7", "jC1Head")):
        for axis in ("rotx", "roty", "rotz"):
            at = [model.dof_names.index(f"{joint}_{axis}") for joint in joints]
            share = (model.upper - model.lower)[at]
            angles[:, at] = 0.4 * swing[:, [at[0]]] * share / share.sum()
    q[:, 7:] = angles
    q[:, :3] = np.hstack([0.8 * time, 0.1 * np.sin(time), 1.0 + 0.05 * np.sin(3 * time)])
    q[:, 5], q[:, 6] = np.sin(0.4 * np.sin(time[:, 0])), np.cos(0.4 * np.sin(time[:, 0]))
    return q


def recorded(
    body: MarkerBody,
    q: np.ndarray,
    noise: np.ndarray | float = 0.0,
    valid: np.ndarray | None = None,
) -> MarkerRecording:
    """What cameras see of the body in postures ``(frames, nq)``."""
    poses = forward_kinematics(body.model, q)
    at = poses.position[:, body.segment]
    at = at + (poses.rotation[:, body.segment] @ body.offset[..., None])[..., 0] + noise
    valid = np.ones(at.shape[:2], dtype=bool) if valid is None else valid
    return MarkerRecording(
        source="made",
        format="trc",
        version="",
        time_s=np.arange(len(q)) / RATE_HZ,
        rate_hz=RATE_HZ,
        marker_names=body.marker_names,
        position=np.where(valid[..., None], at, 0.0),
        valid=valid,
        events=(),
        plates=None,
        report=ReadingReport(),
        digest="",
    )
