"""Draws the paper's Fig. 4, 5 and 6 again, from numbers measured here.

``python -m benchmarks.prediction.paper_figures [--full] [--out DIR]``; ``--full``: ten planar
operators and a person of every kind instead of three and two. Exit status 1 if a bar is missed.
"""

import argparse
import sys
from pathlib import Path

from benchmarks.figure import shown
from benchmarks.prediction.paper_figures.every import OUT, figures


def main() -> int:
    """Draws; returns 1 if a figure misses its bar."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--full", action="store_true", help="ten planar operators, every kind of person"
    )
    parser.add_argument("--out", type=Path, default=OUT, help="for the PNGs")
    parser.add_argument("--dpi", type=int, default=110, help="of the PNGs")
    options = parser.parse_args()
    return shown(figures(options.full, options.out, options.dpi))


if __name__ == "__main__":
    sys.exit(main())
