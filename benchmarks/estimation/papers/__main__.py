"""Runs the papers' experiments: tables as text, one PNG a figure.

``python -m benchmarks.estimation.papers [NAME...] [--out DIR] [--urdf DIR]``. Exit status 1 if a
bar is failed.
"""

import argparse
import sys
import time
from pathlib import Path

from benchmarks.estimation.papers.catalogue import EXPERIMENTS, Scenes


def main(arguments: list[str] | None = None) -> int:
    """Runs what was asked for; returns 1 if a bar is failed."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.estimation.papers", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(EXPERIMENTS))
    parser.add_argument("--out", type=Path, default=Path("build/papers"), help="for the PNGs")
    parser.add_argument("--urdf", type=Path, help="folder with IIT's humanSubject03_66dof.urdf")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--length", type=float, default=1.0, help="of the times postures are held")
    parser.add_argument("--dpi", type=int, default=110, help="of the PNGs")
    options = parser.parse_args(arguments)
    unknown = sorted(set(options.names) - set(EXPERIMENTS))
    if unknown:
        parser.error(f"no experiment {', '.join(unknown)}; there are {', '.join(EXPERIMENTS)}")
    scenes = Scenes(options.seed, options.length, options.urdf)
    failed = 0
    for name in options.names or EXPERIMENTS:
        start = time.perf_counter()
        report = EXPERIMENTS[name](scenes)
        paths = report.save(options.out, options.dpi)
        failed += report.failed
        sys.stdout.write(f"{report.text()}\n\n")
        for path in paths:
            sys.stdout.write(f"    {path}\n")
        sys.stdout.write(f"    ({name}: {time.perf_counter() - start:.0f} s)\n\n")
        sys.stdout.flush()
    sys.stdout.write(f"{failed} bars failed\n" if failed else "all bars passed\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
