"""What a frame costs at the papers' settings: 66 degrees of freedom, 17 sensors, shoes, 50 Hz."""

import statistics
import time
from collections.abc import Callable

from benchmarks.estimation.papers.loads import BOTH, ours, with_ncwe, without_ncwe
from benchmarks.estimation.papers.reports import Report, Table
from benchmarks.estimation.papers.scenes import RATE_HZ, Scenes
from estimation import APPLICATION

ROUNDS = 3


def experiment(scenes: Scenes) -> Report:
    """Times the walk with 9.55 kg."""
    task = scenes.carrying
    frames, period_ms = len(task.time_s), 1e3 / RATE_HZ
    ways: dict[str, Callable[[], object]] = {
        "2019: one step, 67 links": lambda: without_ncwe(task, APPLICATION, BOTH),
        "2021: two steps, 67 links": lambda: with_ncwe(task, APPLICATION, BOTH),
        "ours: one step, real links": lambda: ours(task, BOTH),
    }
    rows = []
    for name, run in ways.items():
        each = 1e3 * _seconds(run) / frames
        rows.append((name, each, period_ms / each, each < period_ms))
    table = Table(
        f"{frames} frames at once, means and all standard deviations, one thread",
        ("way", "ms a frame", "times faster than 50 Hz", ""),
        rows,
    )
    return Report(
        "Compute times at the papers' settings",
        (table,),
        {},
        (
            "the papers give no times; the published software runs at some 60 Hz. "
            "`python -m benchmarks.estimation.core` holds ours beside iDynTree in one process",
        ),
    )


def _seconds(run: Callable[[], object]) -> float:
    taken = []
    for _ in range(ROUNDS):
        start = time.process_time()
        run()
        taken.append(time.process_time() - start)
    return statistics.median(taken)
