"""Peak memory of ``ergocast estimate`` on five minutes and on an hour of markers and plates.

A simulated person takes a box and puts it down, forwards and backwards in turn: played backwards a
motion has the same accelerations, so the same forces fit it. Run with
``python -m benchmarks.estimation.memory [--minutes 5 60]``.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from human import Subject, generate_model
from human.marker_recording import ForcePlate, MarkerRecording, PlateForces
from human.readers import write_trc
from human.readers.opensim_writer import plates_header, plates_rows, trc_header, trc_rows
from human.recording import ReadingReport
from human.simulate import (
    Posture,
    operator,
    plate_pair,
    simulate_markers,
    simulate_plates,
    simulate_postures,
    wear_markers,
)

RATE_HZ = 100.0
#: What the issue allows for an hour, and how much more than five minutes it may take, MiB.
MOST_MIB, MOST_GROWTH_MIB = 1024, 400
_HEIGHT, _MASS, _BOX = 1.75, 72.0, 5.0


def base_scene() -> tuple[MarkerRecording, MarkerRecording, PlateForces]:
    """Returns a static trial, and markers and plates of a lift of about ten seconds."""
    model = generate_model(Subject(_HEIGHT, _MASS, "male"))
    rng = np.random.default_rng(2)
    bent = {"jRightElbow_rotz": 1.4, "jLeftElbow_rotz": -1.4}
    simulated = simulate_postures(
        model,
        operator("average", rng),
        rng,
        [Posture(hold_s=2.0), Posture(hold_s=4.0, angles=bent, load=1.0), Posture(hold_s=2.0)],
        load_kg={"RightHandCOM": _BOX / 2, "LeftHandCOM": _BOX / 2},
        rate_hz=RATE_HZ,
    )
    motion, body = simulated.motion, wear_markers(model, "cgm")
    markers = simulate_markers(body, motion.time_s, motion.q, rng)
    pair = plate_pair()
    wrench = np.stack([r.world() for r in simulate_plates(simulated, pair, rng).readings], axis=1)
    moment = wrench[..., 3:] - np.cross([one.center for one in pair], wrench[..., :3])
    places = tuple(ForcePlate(str(k + 1), one.center, 0.0) for k, one in enumerate(pair))
    plates = PlateForces(motion.time_s, places, wrench[..., :3], moment, ReadingReport())
    still = slice(0, int(RATE_HZ))
    static = replace(
        markers,
        time_s=markers.time_s[still],
        position=markers.position[still],
        valid=markers.valid[still],
    )
    return static, markers, plates


def write_long(folder: Path, minutes: float) -> list[str]:
    """Writes the files of so many minutes; returns them as the command takes them."""
    static, markers, plates = base_scene()
    write_trc(folder / "static.trc", static)
    frames = markers.frames
    rounds = max(1, round(60.0 * minutes * RATE_HZ / frames))
    lines: Iterator[str]
    with (folder / "long.trc").open("w") as stream:
        stream.writelines(trc_header(markers, rounds * frames, "long.trc"))
        for k in range(rounds):
            there = markers if k % 2 == 0 else replace(markers, position=markers.position[::-1])
            lines = trc_rows(there, 1 + k * frames, k * frames / RATE_HZ)
            stream.writelines(lines)
    with (folder / "long_grf.mot").open("w") as stream:
        stream.writelines(plates_header(plates, rounds * frames, "long_grf.mot"))
        for k in range(rounds):
            turned = replace(plates, force=plates.force[::-1], moment=plates.moment[::-1])
            stream.writelines(plates_rows(plates if k % 2 == 0 else turned, k * frames / RATE_HZ))
    return ["static:static.trc", "long.trc", "grf:long_grf.mot"]


def resident_mib(pid: int) -> float:
    """Returns the memory of a process and of those it started, MiB; zero where it has ended."""
    total = 0.0
    try:
        for line in Path(f"/proc/{pid}/status").read_text().splitlines():
            if line.startswith("VmRSS:"):
                total += int(line.split()[1]) / 1024.0
        for task in Path(f"/proc/{pid}/task").iterdir():
            for child in (task / "children").read_text().split():
                total += resident_mib(int(child))
    except OSError:
        pass
    return total


def measured(folder: Path, files: list[str], bands: str) -> tuple[float, float, int]:
    """Runs the command; returns peak memory, MiB, seconds and frames estimated."""
    command = [
        sys.executable, "-c", "from app.cli import main; main()", "estimate", *files,
        "--height", str(_HEIGHT), "--mass", str(_MASS), "--bands", bands, "--out", "out",
    ]  # fmt: skip
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "OMP_NUM_THREADS": "1"}
    began, peak = time.monotonic(), 0.0
    with subprocess.Popen(command, cwd=folder, env=env, stdout=subprocess.DEVNULL) as running:
        while running.poll() is None:
            peak = max(peak, resident_mib(running.pid))
            time.sleep(0.05)
    if running.returncode:
        raise SystemExit(f"ergocast estimate ended with {running.returncode}")
    summary = json.loads(next((folder / "out").glob("*/summary.json")).read_text())
    return peak, time.monotonic() - began, int(summary["frames"])


def main() -> int:
    """Prints peak memory for each length, pass or fail."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, nargs="+", default=[5.0, 60.0])
    parser.add_argument("--bands", default="noise-and-model", choices=["noise", "noise-and-model"])
    options = parser.parse_args()
    if not Path("/proc/self/status").exists():
        raise SystemExit("Memory is read from /proc, which this system lacks: run it on Linux.")
    peaks = []
    for minutes in options.minutes:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            files = write_long(folder, minutes)
            peak, seconds, frames = measured(folder, files, options.bands)
        peaks.append(peak)
        verdict = "PASS" if peak <= MOST_MIB else "FAIL"
        print(
            f"{minutes:5.0f} min  {frames:7d} frames  peak {peak:6.0f} MiB (at most {MOST_MIB})  "
            f"{frames / seconds:5.0f} frames/s  {verdict}",
            flush=True,
        )
    grown = peaks[-1] - peaks[0]
    flat = grown <= MOST_GROWTH_MIB
    print(f"grows by {grown:.0f} MiB (at most {MOST_GROWTH_MIB})  {'PASS' if flat else 'FAIL'}")
    return 0 if flat and max(peaks) <= MOST_MIB else 1


if __name__ == "__main__":
    sys.exit(main())
