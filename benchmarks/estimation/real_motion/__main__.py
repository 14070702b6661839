"""Real motion: our joint moments against OpenSim's and Vicon's, with pass or fail.

``python -m benchmarks.estimation.real_motion [FOLDER] [--plots DIR] [--opensim PYTHON]``, FOLDER
(or ``ERGOCAST_RECORDINGS``) holding ``opencap_subject4`` and ``ktk_walk``. OpenSim runs once in an
environment of its own (``pip install opensim``) and its answers are kept in the user's cache. Exit
status 1 if a bar is missed or could not be tried.
"""

import argparse
import os
import sys
from pathlib import Path

import numpy as np

from benchmarks.estimation.real_motion.comparison import Row, compare, covered, table
from benchmarks.estimation.real_motion.plots import draw_trial
from benchmarks.estimation.real_motion.trials import Trial, opencap_trials, vicon_trial


def main(arguments: list[str] | None = None) -> int:
    """Compares every trial; returns 1 unless every bar is reached."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.estimation.real_motion",
        description=(__doc__ or "").splitlines()[0],
    )
    parser.add_argument(
        "folder", type=Path, nargs="?", default=os.environ.get("ERGOCAST_RECORDINGS"),
        help="of recordings; ERGOCAST_RECORDINGS if left out",
    )  # fmt: skip
    parser.add_argument("--plots", type=Path, help="folder for a picture of each trial")
    parser.add_argument("--opensim", metavar="PYTHON", help="a Python that has OpenSim")
    options = parser.parse_args(arguments)
    if options.folder is None:
        parser.error("name the folder of recordings, or set ERGOCAST_RECORDINGS to it")
    sys.stdout.write(
        "Flexion moments in N m per kg. zero: RMSE of an estimator that returns zero, to be beaten "
        "by 0.7.\nFrames: those that both know, of all.\n"
    )
    failed = _shown(vicon_trial(options.folder), options.plots)
    try:
        for trial in opencap_trials(options.folder, options.opensim):
            failed += _shown(trial, options.plots)
    except RuntimeError as problem:
        sys.stdout.write(f"\nNOT TRIED, opencap_subject4: {problem}\n")
        return 1
    sys.stdout.write(f"\n{failed} bars failed\n" if failed else "\nall bars passed\n")
    return 1 if failed else 0


def _shown(trial: Trial, plots: Path | None) -> int:
    """Writes one trial out and returns how many bars it fails."""
    theirs = trial.theirs
    out = [f"\n{theirs.trial} ({trial.kind}) against {theirs.program}: {'; '.join(theirs.notes)}"]
    rows_of: dict[str, list[Row]] = {}
    for ours in trial.ours:
        rows_of[ours.driver] = compare(ours, theirs, trial.kind)
        out += [f" {ours.driver}: {ours.notes[0]}", table(rows_of[ours.driver])]
    out += [f"    {note}" for note in trial.user.found.notes[1:]]
    out.append(
        "    their moment lies in our 95 % band (about our own flexion axes): "
        + ", ".join(f"{joint} {share:.0%}" for joint, share in covered(trial.user, theirs).items())
    )
    chunk = trial.user.chunk
    if np.any(chunk.payload_known):
        low, middle, high = np.median(chunk.payload_kg[chunk.payload_known], axis=0)
        out.append(
            f"    payload where nothing is held: {middle:.1f} kg, 90 % band {low:.1f} to {high:.1f}"
        )
    if plots is not None:
        out.append(f"    {draw_trial(plots, theirs, rows_of)}")
    sys.stdout.write("\n".join(out) + "\n")
    sys.stdout.flush()
    return sum(row.passed is False for rows in rows_of.values() for row in rows)


if __name__ == "__main__":
    sys.exit(main())
