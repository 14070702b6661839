"""The checks that ``dev.py lint`` and ``dev.py test`` run."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from devtools.checkout import Checkout
from devtools.commands import Stop, say
from devtools.web import has_sources, node_env, npm_command


class Check(NamedTuple):
    """One command whose exit code says whether all is well."""

    name: str
    argv: list[str]
    folder: Path


def lint_checks(checkout: Checkout) -> list[Check]:
    """Returns the checks that only read the code."""
    checks = [
        Check("ruff", tool(checkout, "ruff", "check", "."), checkout.root),
        Check("ruff format", tool(checkout, "ruff", "format", "--check", "."), checkout.root),
        Check("mypy", tool(checkout, "mypy"), checkout.root),
        Check("import rules", tool(checkout, "lint-imports", "--no-logo"), checkout.root),
    ]
    names = ("typecheck", "lint") if has_sources(checkout) else ()
    return checks + [web_check(checkout, name) for name in names]


def test_checks(checkout: Checkout) -> list[Check]:
    """Returns the checks that run the code.

    The browser has a run of its own: drawing in software next to another worker makes it late. The
    largest run comes last, so that its closing line is the last thing to be read.
    """
    checks = [web_check(checkout, "test")] if has_sources(checkout) else []
    if any((checkout.root / "tests" / "browser").glob("test_*.py")):
        checks.append(Check("browser tests", pytest(checkout, "tests/browser"), checkout.root))
    workers = str(max(1, min(os.cpu_count() or 1, 8)))
    rest = pytest(checkout, "--ignore=tests/browser", "-n", workers)
    return [*checks, Check("tests", rest, checkout.root)]


def programs(checkout: Checkout, folder: str) -> list[Check]:
    """Returns the programs in a folder of the checkout, named by their place in it.

    A program says how it is run: ``python -m FOLDER.NAME``. What a Python of another environment
    runs by path says otherwise.
    """
    root = checkout.root / folder
    names = []
    for path in sorted(root.rglob("*.py")):
        place = path.parent if path.name == "__main__.py" else path.with_suffix("")
        name = ".".join(place.relative_to(root).parts)
        if f"python -m {folder}.{name}" in path.read_text("utf-8"):
            names.append(name)
    python = str(checkout.python)
    return [Check(name, [python, "-m", f"{folder}.{name}"], checkout.root) for name in names]


def tool(checkout: Checkout, name: str, *argv: str) -> list[str]:
    """Returns the command of a tool that lives in ``.venv``."""
    return [str(checkout.bin / name), *argv]


def pytest(checkout: Checkout, *argv: str) -> list[str]:
    """Returns a pytest command."""
    return tool(checkout, "pytest", *argv)


def web_check(checkout: Checkout, name: str) -> Check:
    """Returns one of the scripts of ``web/package.json`` as a check."""
    return Check(f"web {name}", npm_command(checkout, "run", "--silent", name), checkout.web)


def check_env(checkout: Checkout) -> dict[str, str]:
    """Returns the environment for checks: ours, and the recordings if they lie beside us."""
    env = node_env(checkout)
    # One thread per process: the processes already share the cores among them.
    env.setdefault("OMP_NUM_THREADS", "1")
    recordings = checkout.root.parent / "shared" / "data"
    if recordings.is_dir():
        env.setdefault("ERGOCAST_RECORDINGS", str(recordings))
    return env


def run_checks(checkout: Checkout, checks: Sequence[Check]) -> None:
    """Runs every check, also after a failure, and then names those that failed.

    Raises:
        Stop: At least one check failed.
    """
    env = check_env(checkout)
    failed = []
    for name, argv, folder in checks:
        say(f"{name} ...")
        if subprocess.run(argv, cwd=folder, env=env).returncode:
            failed.append(name)
    if failed:
        raise Stop(f"Failed: {', '.join(failed)}.", "correct what is reported above")
