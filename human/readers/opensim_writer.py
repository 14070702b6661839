"""Writes markers (TRC) and force plates (MOT) as OpenSim reads them: y up, x forward, z right."""

from collections.abc import Iterator
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from human.marker_recording import MarkerRecording, PlateForces

Array = NDArray[np.float64]

#: From z up (x forward, y left) to y up: ``(x, y, z)`` becomes ``(x, z, -y)``.
_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def write_trc(path: str | PathLike[str], recording: MarkerRecording) -> None:
    """Writes markers in millimetres, four decimals; cells of unseen markers stay empty.

    Args:
        path: the file.
        recording: the markers; plates and events have no place in such a file.
    """
    with Path(path).open("w", encoding="utf-8") as stream:
        stream.writelines(trc_header(recording, recording.frames, Path(path).name))
        stream.writelines(trc_rows(recording))


def trc_header(recording: MarkerRecording, frames: int, name: str) -> Iterator[str]:
    """Yields the header's lines for a file of so many frames."""
    rate, markers = f"{recording.rate_hz:g}", len(recording.marker_names)
    yield f"PathFileType\t4\t(X/Y/Z)\t{name}\n"
    yield "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
    yield "OrigNumFrames\n"
    yield f"{rate}\t{rate}\t{frames}\t{markers}\tmm\t{rate}\t1\t{frames}\n"
    yield "Frame#\tTime\t" + "\t\t\t".join(recording.marker_names) + "\t\t\n"
    yield "\t\t" + "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, markers + 1)) + "\n\n"


def trc_rows(
    recording: MarkerRecording, first_frame: int = 1, later_s: float = 0.0
) -> Iterator[str]:
    """Yields a line per frame, counted from ``first_frame``, times later by ``later_s``."""
    for k in range(recording.frames):
        position = 1e3 * recording.position[k] @ _Y_UP.T
        cells = [
            f"{x:.4f}\t{y:.4f}\t{z:.4f}" if seen else "\t\t"
            for (x, y, z), seen in zip(position.tolist(), recording.valid[k], strict=True)
        ]
        time_s = f"{recording.time_s[k] + later_s:.6f}"
        yield f"{first_frame + k}\t{time_s}\t" + "\t".join(cells) + "\n"


def write_plates(path: str | PathLike[str], plates: PlateForces) -> None:
    """Writes force plates: force (N), where it enters (m) and the free torque there (N m).

    Where a plate bears next to nothing there is no such point; its force is written as zero.

    Args:
        path: the file.
        plates: what the plates did.
    """
    with Path(path).open("w", encoding="utf-8") as stream:
        stream.writelines(plates_header(plates, len(plates.time_s), Path(path).name))
        stream.writelines(plates_rows(plates))


def plates_header(plates: PlateForces, rows: int, name: str) -> Iterator[str]:
    """Yields the header's lines for a file of so many rows."""
    numbers = range(1, len(plates.plates) + 1)
    yield f"{name}\nversion=1\nnRows={rows}\nnColumns={1 + 9 * len(plates.plates)}\n"
    yield "inDegrees=yes\nendheader\n"
    yield "time\t" + "\t".join(
        f"{what}{axis}"
        for k in numbers
        for what in (f"ground_force_{k}_v", f"ground_force_{k}_p", f"ground_torque_{k}_")
        for axis in "xyz"
    ) + "\n"  # fmt: skip


def plates_rows(plates: PlateForces, later_s: float = 0.0) -> Iterator[str]:
    """Yields a line per sample, times later by ``later_s``."""
    point, free, valid = plates.centres_of_pressure()
    torque = np.zeros_like(point)
    torque[..., 2] = free
    force = np.where(valid[..., None], plates.force, 0.0)
    values = np.concatenate([force, point, torque], axis=-1).reshape(*free.shape, 3, 3) @ _Y_UP.T
    for k, row in enumerate(values.reshape(len(free), -1).tolist()):
        cells = "\t".join(f"{value:.6f}" for value in row)
        yield f"{plates.time_s[k] + later_s:.6f}\t{cells}\n"
