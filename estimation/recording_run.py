"""Estimates a whole recording, stretch by stretch, in memory that does not grow with it."""

from collections.abc import Iterator, Sequence

from estimation.foot_force_record import FootForces
from estimation.run_records import RunChunk, RunSettings, RunSummary
from estimation.sensors import Measurement
from human import HumanModel, Motion


class RecordingRun:
    """A recording's estimate, fed stretch by stretch; for one stretch use `estimate_run`."""

    def __init__(self, model: HumanModel, settings: RunSettings | None = None) -> None:
        """Starts a run."""
        raise NotImplementedError

    def add(
        self, motion: Motion, feet: FootForces | None, imus: Sequence[Measurement] = ()
    ) -> Iterator[RunChunk]:
        """Estimates the next stretch, in chunks; close the iterator to give up.

        Args:
            motion: the stretch, after all that was added before.
            feet: the wrenches under the feet at the same frames, or None.
            imus: what else was measured at the same frames.
        """
        raise NotImplementedError

    def finish(self) -> RunSummary:
        """Closes the last hold and says what the run comes to."""
        raise NotImplementedError


def estimate_run(
    model: HumanModel,
    motion: Motion,
    feet: FootForces | None,
    settings: RunSettings | None = None,
    imus: Sequence[Measurement] = (),
) -> tuple[RunChunk, RunSummary]:
    """Estimates a recording that fits into memory: all its frames as one chunk, and the summary."""
    raise NotImplementedError
