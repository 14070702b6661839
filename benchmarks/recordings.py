"""The readers' and the fit's figures on real recordings, each with its bar: pass or fail.

Run with the folder of recordings, which holds ``xsens_mvnx`` and ``xsens_bvh_box``::

    ERGOCAST_RECORDINGS=folder python -m benchmarks.recordings

Exits with 1 when a figure misses its bar.
"""

import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.figure import Figure, shown
from human.kinematics import forward_kinematics
from human.model import Subject
from human.mvn_angles import mvn_joint_angles_deg
from human.names import PARENT_SEGMENT, SEGMENT_OF_JOINT, SEGMENTS
from human.pose import FittedRecording, RecordingRefusedError, fit_recording
from human.readers import inspect_recording, read_recording
from human.recording import Recording
from human.rotations import (
    matrix_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)

Array = NDArray[np.float64]

FILES = (
    "xsens_mvnx/Meri-020.mvnx",
    "xsens_mvnx/test_mocap.mvnx",
    "xsens_mvnx/test_mocap.bvh",
    "xsens_bvh_box/MotionBox_XSens.bvh",
)
ORIENTATION_BAR_DEG = 1e-6
ANGLE_BAR_DEG = 1.0
POSITION_BAR_MM = 30.0
#: Height and mass are not in the files; the fit's geometry does not depend on the mass.
PERSON = Subject(1.65, 62.0)


def figures(folder: Path) -> Iterator[Figure]:
    """Measures everything."""
    recordings = {name: read_recording(folder / name) for name in FILES}
    fits = {name: fit_recording(recording, PERSON) for name, recording in recordings.items()}
    free = {
        name: fit_recording(recording, PERSON, within_limits=False)
        for name, recording in recordings.items()
    }
    for name in FILES:
        yield from _fit_figures(name, fits[name], free[name])
    for name in FILES[:2]:
        yield from _angle_figures(name, recordings[name], fits[name])
    yield from _twin_figures(recordings, fits)
    yield from _side_figures(folder)


def _fit_figures(name: str, fitted: FittedRecording, free: FittedRecording) -> Iterator[Figure]:
    short = Path(name).name
    d = fitted.diagnostics
    inside = d.pair_error_rad[~d.limited & ~d.frozen]
    worst = float(np.rad2deg(np.max(inside)))
    share = float(np.mean(d.limited))
    yield Figure(
        f"{short}: orientation error, no active limit", worst, "deg",
        most=ORIENTATION_BAR_DEG,
        beside=f"{share:.1%} of joints x frames at a limit, up to "
        f"{np.rad2deg(np.max(d.pair_error_rad)):.1f} deg there",
    )  # fmt: skip
    f = free.diagnostics
    worst = float(np.rad2deg(np.max(f.pair_error_rad[~f.frozen])))
    yield Figure(f"{short}: orientation error, limits off", worst, "deg", most=ORIENTATION_BAR_DEG)
    millimetres = 1000.0 * d.position_error_m
    yield Figure(
        f"{short}: joint positions, median", float(np.median(millimetres)), "mm",
        most=POSITION_BAR_MM,
        beside=f"worst segment's median {np.max(np.median(millimetres, axis=0)):.2g}, "
        f"largest {np.max(millimetres):.2g}",
    )  # fmt: skip


def _angle_figures(name: str, recording: Recording, fitted: FittedRecording) -> Iterator[Figure]:
    """The fitted model's joint angles in MVN's convention against those the file states."""
    stated = {
        "jointAngle": recording.joint_angle_deg,
        "jointAngleXZY": recording.joint_angle_xzy_deg,
    }
    rotation = forward_kinematics(fitted.model, fitted.motion.q).rotation
    quat = matrix_to_quaternion(rotation)
    limited = fitted.diagnostics.limited
    for field, sequence in (("jointAngle", "ZXY"), ("jointAngleXZY", "XZY")):
        reference = stated[field]
        if reference is None:
            raise SystemExit(f"{name} has no {field}")
        worst, at_limit = 0.0, 0.0
        for k, joint in enumerate(recording.joint_angle_names):
            child = SEGMENT_OF_JOINT[joint]
            parent = SEGMENTS.index(PARENT_SEGMENT[child])
            angles = mvn_joint_angles_deg(
                joint, quat[:, parent], quat[:, SEGMENTS.index(child)],
                "ZXY" if sequence == "ZXY" else "XZY",
            )  # fmt: skip
            off = np.max(np.abs((angles - reference[:, k] + 180.0) % 360.0 - 180.0), axis=-1)
            held = limited[:, fitted.model.joint_names.index(joint)]
            worst = max(worst, float(np.max(off[~held], initial=0.0)))
            at_limit = max(at_limit, float(np.max(off[held], initial=0.0)))
        note = f"where a limit is active up to {at_limit:.0f}" if at_limit else "no limit active"
        yield Figure(
            f"{Path(name).name}: fitted angles against {field}",
            worst,
            "deg",
            most=ANGLE_BAR_DEG,
            beside=note,
        )


def _twin_figures(
    recordings: dict[str, Recording], fits: dict[str, FittedRecording]
) -> Iterator[Figure]:
    """The MVNX file and its BVH twin, frame by frame; the BVH's first is a reference pose."""
    mvnx, bvh = FILES[1], FILES[2]
    first = recordings[mvnx].frames - recordings[bvh].frames
    turn = quaternion_multiply(
        quaternion_conjugate(recordings[mvnx].orientation_xyzw[first:]),
        recordings[bvh].orientation_xyzw,
    )
    off = float(np.rad2deg(np.max(np.linalg.norm(quaternion_to_rotation_vector(turn), axis=-1))))
    yield Figure("MVNX and its BVH twin: segment orientations", off, "deg", most=ANGLE_BAR_DEG)
    angles = np.abs(fits[mvnx].motion.joint_angles[first:] - fits[bvh].motion.joint_angles)
    yield Figure(
        "MVNX and its BVH twin: fitted joint angles",
        float(np.rad2deg(np.max(angles))), "deg", most=ANGLE_BAR_DEG,
    )  # fmt: skip
    place = np.linalg.norm(recordings[mvnx].position[first:] - recordings[bvh].position, axis=-1)
    yield Figure(
        "MVNX and its BVH twin: joint positions, median", float(1000 * np.median(place)),
        "mm", most=POSITION_BAR_MM,
    )  # fmt: skip


def _side_figures(folder: Path) -> Iterator[Figure]:
    """Every file with its sides exchanged must be noticed and refused, none as it is."""
    suspected = sum(
        any(p.code in ("sides", "inconsistent") for p in inspect_recording(folder / name).problems)
        for name in FILES
    )
    yield Figure("honest files suspected of exchanged sides", float(suspected), most=0.0)
    missed = 0
    with tempfile.TemporaryDirectory() as made:
        for name in FILES:
            text = (folder / name).read_text("utf-8")
            swapped = text.replace("Right", "\0").replace("Left", "Right").replace("\0", "Left")
            path = Path(made) / Path(name).name
            path.write_text(swapped, "utf-8")
            try:
                fit_recording(read_recording(path), PERSON)
                missed += 1
            except RecordingRefusedError:
                pass
    yield Figure("side-swapped copies not refused", float(missed), most=0.0)


def main() -> int:
    """Prints each figure; returns 1 if one missed its bar."""
    folder = os.environ.get("ERGOCAST_RECORDINGS")
    if not folder:
        print("Set ERGOCAST_RECORDINGS to the folder of recordings.", file=sys.stderr)
        return 2
    return shown(figures(Path(folder)))


if __name__ == "__main__":
    sys.exit(main())
