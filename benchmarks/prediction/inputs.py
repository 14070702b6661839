"""What becomes of input that is not what it seems: refused or flagged, never confidently wrong.

Run ``python -m benchmarks.prediction.inputs [RECORDINGS] [--full]``.

Prints one line a case, with what was said; then the bands of an operator without demonstrations,
on simulated people and, with --full and the folder of real recordings, on real ones left out of
the prior.
"""

import argparse
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmarks.figure import Figure, shown
from benchmarks.prediction import generic_prior
from benchmarks.prediction.demonstration_cases import DEMONSTRATIONS
from benchmarks.prediction.input_world import Case, World
from benchmarks.prediction.path_cases import PATHS
from human import HumanError
from prediction import PredictionError

SECTIONS: Mapping[str, Mapping[str, Case]] = {"demonstrations": DEMONSTRATIONS, "paths": PATHS}


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of a case: how it was answered, in which words, and whether that is right."""

    outcome: str
    words: str
    passed: bool


def verdict(case: Case, world: World) -> Verdict:
    """Feeds a case in."""
    try:
        words = case.run(world)
        outcome = "right" if case.outcome == "right" else "flagged" if words else "answered"
    except (PredictionError, HumanError) as error:
        outcome, words = "refused", str(error)
    except Exception as error:  # a crash is an answer too, the worst
        outcome, words = type(error).__name__, str(error)
    passed = outcome == case.outcome and re.search(case.words, words) is not None
    return Verdict(outcome, words, passed)


def figures(full: bool = False, folder: Path | None = None) -> Iterator[Figure]:
    """Runs every case, and judges the operator without demonstrations.

    Args:
        full: More simulated people and, with recordings, the prior made anew.
        folder: The folder of real recordings.
    """
    world = World()
    for section, cases in SECTIONS.items():
        right = 0
        for name, case in cases.items():
            found = verdict(case, world)
            right += found.passed
            mark = "    " if found.passed else "FAIL"
            print(f"{mark}  {section:15}{name:36}{found.outcome:10}{found.words[:110]}", flush=True)
        yield Figure(
            f"bad {section}: refused or flagged with the reason",
            right,
            "cases",
            least=len(cases),
            beside=f"of {len(cases)}",
        )
    yield from generic_prior.figures(full, folder)


def main() -> int:
    """Prints the figures; returns 1 if one fails."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", nargs="?", type=Path)
    parser.add_argument("--full", action="store_true")
    options = parser.parse_args()
    return shown(figures(options.full, options.recordings))


if __name__ == "__main__":
    sys.exit(main())
