"""The wheel: whoever installs it has the page, and never one older than its sources."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from devtools import web
from devtools.commands import digest

ROOT = Path(__file__).parents[1]


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A small copy of the project: its build files, and packages with nothing in them."""
    root = tmp_path / "project"
    shutil.copytree(
        ROOT / "devtools", root / "devtools", ignore=shutil.ignore_patterns("__pycache__")
    )
    for name in ("pyproject.toml", "hatch_build.py", "README.md", "LICENSE", ".gitignore"):
        shutil.copy(ROOT / name, root / name)
    for name in ("app", "ergonomics", "estimation", "human", "prediction"):
        (root / name).mkdir()
        (root / name / "__init__.py").touch()
    return root


def build(root: Path, target: str, path: str = "") -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", "out"],
        cwd=root,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
    )


def test_the_wheel_carries_the_built_page(package: Path) -> None:
    (package / "app" / "static").mkdir()
    (package / "app" / "static" / "index.html").write_text("page")
    done = build(package, "wheel")
    assert done.returncode == 0, done.stderr
    (wheel,) = (package / "out").glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        assert archive.read("app/static/index.html") == b"page"


@pytest.mark.parametrize("page_there", [False, True])
def test_a_missing_or_old_page_without_node_stops_the_wheel(
    package: Path, page_there: bool
) -> None:
    (package / "web").mkdir()
    (package / "web" / "package.json").write_text("{}")
    if page_there:
        (package / "app" / "static").mkdir()
        (package / "app" / "static" / "index.html").write_text("older")
        (package / "app" / "static" / web.STAMP).write_text(digest("older sources"))
    done = build(package, "wheel")
    assert done.returncode != 0
    assert "python3 dev.py setup" in done.stderr + done.stdout
    assert not list(package.glob("out/*.whl"))
