"""An empty working copy, and the small programs that stand in for real ones."""

import stat
from collections.abc import Callable
from pathlib import Path

import pytest

from devtools.checkout import Checkout

ROOT = Path(__file__).parents[2]


@pytest.fixture
def script() -> Callable[[Path, str], Path]:
    """Writes a shell script that can be run."""

    def write(path: Path, text: str) -> Path:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        return path

    return write


@pytest.fixture
def checkout(tmp_path: Path) -> Checkout:
    """An empty working copy whose path leads to nothing but its own tools."""
    (tmp_path / "pyproject.toml").write_text((ROOT / "pyproject.toml").read_text())
    return Checkout(tmp_path, {"PATH": str(tmp_path / "tools")})
