"""The ring of real recordings: in when they are at hand, and never out in silence."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LEFT_OUT = "tests/recordings left out"


def collect(folder: str | None, *arguments: str) -> subprocess.CompletedProcess[str]:
    env = {name: value for name, value in os.environ.items() if name != "ERGOCAST_RECORDINGS"}
    env.pop("PYTEST_XDIST_WORKER", None)
    if folder is not None:
        env["ERGOCAST_RECORDINGS"] = folder
    argv = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider"]
    return subprocess.run([*argv, *arguments], cwd=ROOT, env=env, capture_output=True, text=True)


def test_without_recordings_the_ring_is_left_out_in_one_line() -> None:
    said = collect(None, "tests/recordings", "tests/test_rings.py").stdout
    assert said.count(LEFT_OUT) == 1
    assert "test_rings.py::" in said
    assert "recordings/test_" not in said


def test_nothing_is_said_when_the_ring_was_not_asked_for() -> None:
    assert LEFT_OUT not in collect(None, "tests/test_rings.py").stdout


def test_with_recordings_the_ring_is_collected(tmp_path: Path) -> None:
    said = collect(str(tmp_path), "tests/recordings").stdout
    assert LEFT_OUT not in said
    assert "tests/recordings/test_" in said


@pytest.mark.parametrize("folder", ["no-such-folder"])
def test_a_folder_that_is_not_there_stops_the_run(folder: str) -> None:
    done = collect(folder, "tests/recordings")
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    assert folder in done.stderr
