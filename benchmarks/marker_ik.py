"""Whole-body marker fitting against the per-frame solvers people use.

Run ``python -m benchmarks.marker_ik``; with real recordings, and with OpenSim from an environment
of its own (``python -m venv DIR && DIR/bin/pip install opensim``)::

    ERGOCAST_RECORDINGS=folder ERGOCAST_OPENSIM=DIR/bin/python python -m benchmarks.marker_ik

Each figure stands with its bar and pass or fail; exits with 1 if one fails. Times are processor
time of one thread: the ratios count, since the machine may be shared.
"""

import json
import os
import subprocess
import tempfile
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.optimize import least_squares

from benchmarks.figure import Figure, shown
from human import Motion, Subject, generate_model
from human.marker_recording import MarkerRecording
from human.markers import MarkerBody, body_from_static, fit_markers
from human.readers import read_markers
from human.simulate import (
    MarkerNoise,
    SensorNoise,
    operator,
    simulate_markers,
    simulate_walking,
    wear_markers,
)

Array = NDArray[np.float64]

PERSON = Subject(1.76, 74.3, "male")
#: Frames that the peer is timed on; it is too slow for more.
PEER_FRAMES = 60
#: Static trial, motion, height, mass: the person's, or near enough where the file does not say.
TRIALS = {
    "OpenCap squats": ("opencap_subject4/static1.trc", "opencap_subject4/squats1.trc", 1.73, 60),
    "OpenCap sit-to-stand": ("opencap_subject4/static1.trc", "opencap_subject4/STS1.trc", 1.73, 60),
    "OpenCap walk": ("opencap_subject4/static1.trc", "opencap_subject4/walking1.trc", 1.73, 60),
    "Vicon CGM walk": ("ktk_walk/walk.c3d.zip", "ktk_walk/walk.c3d.zip", 1.64, 73.4),
    "ISB walk": (
        "rehazenter_gait/2014001_ST.c3d", "rehazenter_gait/2014001_C1_01.c3d", 1.7, 65,
    ),
    "CMU stepping": ("cmu_c3d/cmu_02_05.c3d", "cmu_c3d/cmu_02_05.c3d", 1.75, 75),
    "arm and box": (
        "pyomeca_arm_box/markers_analogs.c3d", "pyomeca_arm_box/markers_analogs.c3d", 1.75, 75,
    ),
}  # fmt: skip


def main() -> int:
    """Prints one line a figure; returns 1 if one fails."""
    return shown(figures())


def figures() -> Iterator[Figure]:
    """Simulated walking against SciPy; real recordings; OpenSim on one of them."""
    yield from simulated()
    folder = os.environ.get("ERGOCAST_RECORDINGS")
    if folder is None:
        print("Real recordings: set ERGOCAST_RECORDINGS to their folder.")
        return
    yield from recorded(Path(folder))
    python = os.environ.get("ERGOCAST_OPENSIM")
    if python is None:
        print("OpenSim: set ERGOCAST_OPENSIM to a Python that has it (see the top of this file).")
        return
    yield from against_opensim(Path(folder) / "opencap_subject4", python)


def simulated() -> Iterator[Figure]:
    """A walk with three millimetres of noise on 49 markers: time and error, ours and SciPy's."""
    rng = np.random.default_rng(0)
    model = generate_model(PERSON)
    walk = simulate_walking(model, operator("average", rng), rng).motion
    body = wear_markers(model, "opencap")
    noise = MarkerNoise(SensorNoise(sd=0.003))
    recording = simulate_markers(body, walk.time_s, walk.q, rng, noise=noise)
    start = time.process_time()
    fitted = fit_markers(body, recording)
    ours = (time.process_time() - start) / recording.frames
    shown = np.array([name not in fitted.unobserved_dofs for name in model.dof_names])
    legs = shown & np.array(["Hip" in n or "Knee" in n or "Ankle" in n for n in model.dof_names])
    frames = np.arange(100, 100 + PEER_FRAMES)
    start = time.process_time()
    q = scipy_fit(body, recording, frames, walk.q[frames[0]], shown)
    peer = (time.process_time() - start) / len(frames)
    here = np.isin(fitted.frame, frames)
    note = f"{len(fitted.marker_names)} markers, {recording.frames} frames"
    yield Figure("walk: frames a second and core", 1.0 / ours, "1/s", 500.0, beside=note)
    yield Figure(
        "walk: times SciPy's least_squares", peer / ours, "x", 5.0,
        beside=f"frame by frame, warm, Pinocchio's Jacobian: {1e3 * peer:.1f} ms a frame",
    )  # fmt: skip
    yield Figure(
        "walk: error of the legs' angles, RMS", _rms_deg(fitted.motion.q[here], walk, frames, legs),
        "deg", most=1.1 * _rms_deg(q, walk, frames, legs), beside="at most 1.1 times SciPy's",
    )  # fmt: skip


def _rms_deg(q: Array, walk: Motion, frames: NDArray[np.intp], dofs: NDArray[np.bool_]) -> float:
    error = (q - walk.q[frames])[:, 7:][:, dofs]
    return float(np.rad2deg(np.sqrt(np.mean(error**2))))


def scipy_fit(
    body: MarkerBody,
    recording: MarkerRecording,
    frames: NDArray[np.intp],
    first: Array,
    shown: NDArray[np.bool_],
) -> Array:
    """The same weighted squares, frame after frame, each from the posture before it.

    Angles that no marker shows stay where they are; the others are drawn to the last posture so
    weakly (a radian) that the problem has one solution.
    """
    model = body.model.pinocchio()
    data = model.createData()
    ids = [
        model.addFrame(
            pin.Frame(
                name,
                model.frames[model.getFrameId(body.model.segment_names[segment])].parentJoint,
                pin.SE3(
                    np.eye(3),
                    model.frames[
                        model.getFrameId(body.model.segment_names[segment])
                    ].placement.translation
                    + offset,
                ),
                pin.FrameType.OP_FRAME,
            )
        )
        for name, segment, offset in zip(body.marker_names, body.segment, body.offset, strict=True)
    ]
    data = model.createData()
    columns = np.concatenate([np.arange(6), 6 + np.flatnonzero(shown)])
    out, q0 = [], first
    for frame in frames:
        target = recording.position[frame]

        def residual(step: Array, q0: Array = q0, target: Array = target) -> Array:
            pin.framesForwardKinematics(model, data, pin.integrate(model, q0, spread(step)))
            at = np.array([data.oMf[k].translation for k in ids])
            return np.concatenate([((at - target) / body.sd_m[:, None]).ravel(), step[6:]])

        def jacobian(step: Array, q0: Array = q0, target: Array = target) -> Array:
            q = pin.integrate(model, q0, spread(step))
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacements(model, data)
            rows = [
                pin.getFrameJacobian(model, data, k, pin.LOCAL_WORLD_ALIGNED)[:3] / sd
                for k, sd in zip(ids, body.sd_m, strict=True)
            ]
            moved = np.concatenate(rows)
            moved[:, :6] = moved[:, :6] @ pin.dIntegrate(model, q0, spread(step))[1][:6, :6]
            return np.concatenate([moved[:, columns], np.eye(len(columns))[6:]])

        def spread(step: Array) -> Array:
            full = np.zeros(model.nv)
            full[columns] = step
            return full

        found = least_squares(residual, np.zeros(len(columns)), jac=jacobian, method="lm")
        q0 = pin.integrate(model, q0, spread(found.x))
        out.append(q0)
    return np.array(out)


def recorded(folder: Path) -> Iterator[Figure]:
    """Residuals on real people; OpenSim's advice is 2 cm at most, RMS."""
    for name, (static, motion, height, mass) in TRIALS.items():
        with tempfile.TemporaryDirectory() as scratch:
            trials = [
                read_markers(_unpacked(folder / file, Path(scratch))) for file in (static, motion)
            ]
        body = body_from_static(trials[0], Subject(height, mass), accept=("height",))
        start = time.process_time()
        fitted = fit_markers(body, trials[1])
        spent = time.process_time() - start
        worst = max(fitted.marker_rms_m().items(), key=lambda pair: pair[1])
        yield Figure(
            f"{name}: residual, RMS", 1e3 * fitted.rms_m, "mm", most=20.0,
            beside=f"{len(fitted.motion)} of {trials[1].frames} frames, worst marker {worst[0]} "
            f"{1e3 * worst[1]:.0f} mm, {trials[1].frames / spent:.0f} frames/s",
        )  # fmt: skip


def _unpacked(path: Path, scratch: Path) -> Path:
    if path.suffix != ".zip":
        return path
    with zipfile.ZipFile(path) as archive:
        archive.extractall(scratch)
        return scratch / archive.namelist()[0]


def against_opensim(folder: Path, python: str) -> Iterator[Figure]:
    """OpenSim's inverse kinematics of the squats, with its own scaled model."""
    script = Path(__file__).with_name("marker_ik_opensim.py")
    ended = subprocess.run(
        [python, str(script), str(folder.resolve()), "squats1"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if ended.returncode != 0:
        raise RuntimeError(f"OpenSim failed:\n{ended.stderr[-2000:]}")
    peer = json.loads(ended.stdout.strip().splitlines()[-1])
    body = body_from_static(read_markers(folder / "static1.trc"), Subject(1.73, 60.0))
    squats = read_markers(folder / "squats1.trc")
    start = time.process_time()
    fitted = fit_markers(body, squats)
    spent = (time.process_time() - start) / squats.frames
    theirs = peer["seconds"] / peer["frames"]
    yield Figure(
        "OpenCap squats: times OpenSim's IK", theirs / spent, "x", 1.0,
        beside=f"OpenSim {1.0 / theirs:.0f}, ours {1.0 / spent:.0f} frames/s",
    )  # fmt: skip
    yield Figure(
        "OpenCap squats: residual, RMS", 1e3 * fitted.rms_m, "mm", most=1e3 * peer["rms_m"],
        beside="at most OpenSim's: 35 coordinates, model and markers fitted to these motions",
    )  # fmt: skip


if __name__ == "__main__":
    raise SystemExit(main())
