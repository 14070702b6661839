"""One working copy: where things are in it, and which steps have been taken."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from devtools.commands import digest, say


class Checkout:
    """The paths of a working copy, its environment variables and its stamps."""

    def __init__(self, root: Path, env: Mapping[str, str] | None = None) -> None:
        """Reads nothing yet; a step looks when it is taken.

        Args:
            root: The folder that holds ``pyproject.toml``.
            env: Environment variables; by default those of this process.
        """
        self.root = root
        self.env = dict(os.environ if env is None else env)
        self.venv = root / ".venv"
        self.bin = self.venv / "bin"
        self.python = self.bin / "python"
        self.stamps = self.venv / "stamps"
        self.web = root / "web"
        self.bundle = root / "app" / "static"

    @property
    def search_path(self) -> str:
        """The ``PATH`` for tools: the user's own first, then those that the set-up installed."""
        return f"{self.env.get('PATH', os.defpath)}{os.pathsep}{self.bin}"

    @property
    def torch_choice(self) -> str:
        """``ERGOCAST_TORCH``: ``cpu`` unless set."""
        return self.env.get("ERGOCAST_TORCH") or "cpu"

    def project(self) -> dict[str, Any]:
        """Returns the parts of ``pyproject.toml`` that decide what gets installed."""
        import tomllib  # here, so that an older Python still reads the message about its age

        table = tomllib.loads((self.root / "pyproject.toml").read_text())
        return {"build-system": table["build-system"], "project": table["project"]}

    def step(
        self,
        name: str,
        inputs: object,
        outputs: Sequence[Path],
        action: Callable[[], None],
        stamp: Path | None = None,
    ) -> bool:
        """Takes a step unless it was taken with the same inputs and its outputs are still there.

        Args:
            name: What to call it while it runs.
            inputs: Plain values; other values mean that the step must be taken again.
            outputs: What must exist afterwards.
            action: The step itself; only when it returns is the step stamped as taken.
            stamp: Where to keep the digest of the inputs; by default inside ``.venv``.

        Returns:
            Whether the step was taken now.
        """
        stamp = stamp or self.stamps / name
        wanted = digest(inputs)
        taken = stamp.is_file() and stamp.read_text() == wanted
        if taken and all(path.exists() for path in outputs):
            return False
        stamp.unlink(missing_ok=True)
        say(f"{name} ...")
        start = time.monotonic()
        action()
        stamp.parent.mkdir(parents=True, exist_ok=True)
        stamp.write_text(wanted)
        say(f"{name}: done in {time.monotonic() - start:.0f} s")
        return True
