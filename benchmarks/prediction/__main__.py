"""Everything measured of posture prediction, and one table of every bar at the end.

``python -m benchmarks.prediction [--full] [--recordings FOLDER] [--only NAME ...] [--out DIR]``.
Short by default; ``--full`` takes the seeds, people and splits that are reported. With a folder of
recordings what is measured on real motion runs, too. Exit status 1 if a bar is missed.
"""

import argparse
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Sequence
from importlib import import_module
from pathlib import Path

from benchmarks.figure import Figure
from benchmarks.prediction.paper_figures.every import OUT

#: Parts in the order they run; each is a module here with ``figures``.
PARTS = (
    "planar",
    "training",
    "weights",
    "simulated",
    "rollout_speed",
    "chains",
    "inputs",
    "paper_figures",
)
#: Parts that are all about recordings.
REAL = ("real_motion", "led_paths")


def part(name: str, options: argparse.Namespace) -> Iterable[Figure]:
    """Starts one part."""
    place = f"{name}.every" if name == "paper_figures" else name
    figures: Callable[..., Iterable[Figure]] = import_module(
        f"benchmarks.prediction.{place}"
    ).figures
    if name == "real_motion":
        picture = options.out / "prediction_real_motion.png"
        return figures(options.recordings, options.full, picture)
    if name in REAL:
        return figures(options.recordings, options.full)
    if name == "inputs":
        return figures(options.full, options.recordings)
    return figures(options.full, options.out) if name == "paper_figures" else figures(options.full)


def table(figures: Sequence[Figure]) -> str:
    """Returns every figure that has a bar, one line each."""
    judged = [figure for figure in figures if figure.passed is not None]
    width = max((len(figure.name) for figure in judged), default=0)
    lines = [f"{'':6}{'what':{width}}  {'measured':>18}  {'bar':18}peer"]
    for figure in judged:
        measured = f"{figure.value:.4g} {figure.unit}".strip()
        verdict = "pass" if figure.passed else "FAIL"
        lines.append(
            f"{verdict:6}{figure.name:{width}}  {measured:>18}  {figure.bars:18}{figure.beside}"
        )
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    """Runs what was asked for; returns 1 if a bar is missed or a part breaks off."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.prediction", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--full", action="store_true", help="what is reported, not a first look")
    parser.add_argument("--recordings", type=Path, help="folder of real recordings")
    every = (*PARTS, *REAL)
    parser.add_argument(
        "--only", nargs="+", choices=every, metavar="NAME", default=(), help=", ".join(every)
    )
    parser.add_argument("--out", type=Path, default=OUT, help="for the pictures")
    options = parser.parse_args(arguments)
    names = options.only or (*PARTS, *(REAL if options.recordings else ()))
    if set(REAL) & set(names) and options.recordings is None:
        parser.error(f"{', '.join(REAL)} need --recordings FOLDER")
    options.out.mkdir(parents=True, exist_ok=True)
    found: list[Figure] = []
    broken: list[str] = []
    for name in names:
        print(f"\n=== {name}", flush=True)
        start = time.perf_counter()
        try:
            for figure in part(name, options):
                found.append(figure)
                print(figure.line(), flush=True)
        except Exception:  # hours of other parts must not be lost with this one
            traceback.print_exc()
            broken.append(name)
        print(f"    ({name}: {time.perf_counter() - start:.0f} s)", flush=True)
    print(f"\n{table(found)}\n")
    missed = sum(figure.passed is False for figure in found)
    print(f"{missed} bars missed" if missed else "all bars kept")
    if broken:
        print(f"broke off: {', '.join(broken)}")
    return 1 if missed or broken else 0


if __name__ == "__main__":
    sys.exit(main())
