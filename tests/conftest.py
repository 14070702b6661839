"""The rings of the tests: real recordings take part only where they are at hand."""

import os
from pathlib import Path

import pytest

RECORDINGS_RING = Path(__file__).parent / "recordings"
VARIABLE = "ERGOCAST_RECORDINGS"


def pytest_configure(config: pytest.Config) -> None:
    """Refuses a folder of recordings that is not there, rather than leaving the ring out."""
    folder = os.environ.get(VARIABLE)
    if folder and not Path(folder).is_dir():
        raise pytest.UsageError(
            f"{VARIABLE} is {folder!r}, which is not a folder: correct or unset it"
        )


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    """Leaves the ring of real recordings out when nobody said where they are."""
    ring = collection_path == RECORDINGS_RING or RECORDINGS_RING in collection_path.parents
    return True if ring and not os.environ.get(VARIABLE) else None


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Says in one line that the ring was left out, in runs that would have had it."""
    if os.environ.get(VARIABLE):
        return
    for argument in terminalreporter.config.args:
        path = Path(argument.partition("::")[0]).absolute()
        if path in (RECORDINGS_RING, *RECORDINGS_RING.parents) or RECORDINGS_RING in path.parents:
            terminalreporter.write_line(
                f"tests/recordings left out: {VARIABLE} does not name a folder of recordings"
            )
            return
