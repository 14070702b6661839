"""How the steps talk: lines of progress, other programs, and failures that say what to do."""

from __future__ import annotations

import hashlib
import json
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path


class Stop(Exception):
    """Ends the command: what went wrong, and the one thing to do about it."""

    def __init__(self, problem: str, remedy: str) -> None:
        """Keeps both sentences for the closing message."""
        super().__init__(problem)
        self.problem = problem
        self.remedy = remedy


def say(text: str) -> None:
    """Prints one line of progress at once, also into a pipe."""
    print(f"dev.py: {text}", flush=True)


def digest(*parts: object) -> str:
    """Returns a digest of plain values; equal values give equal digests on every machine."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


def call(
    argv: Sequence[str | Path],
    problem: str,
    remedy: str,
    *,
    cwd: Path | None = None,
    env: Mapping[str, str] | None = None,
) -> None:
    """Runs a command whose output goes to the terminal.

    Raises:
        Stop: The command could not be started or did not end well.
    """
    try:
        code = subprocess.run([str(part) for part in argv], cwd=cwd, env=env).returncode
    except OSError as error:
        raise Stop(f"{problem} ({error})", remedy) from error
    if code:
        raise Stop(f"{problem} (exit code {code}; its own words are above)", remedy)


def ask(argv: Sequence[str | Path], *, env: Mapping[str, str] | None = None) -> str | None:
    """Returns what a command prints, or nothing when it fails."""
    try:
        done = subprocess.run([str(part) for part in argv], env=env, capture_output=True, text=True)
    except OSError:
        return None
    return done.stdout.strip() if done.returncode == 0 else None
