"""The house's doors: which package may import which, and what each one shows."""

import ast
import importlib
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from importlinter import cli

ROOT = Path(__file__).parents[1]
SCIENTIFIC = ("ergonomics", "estimation", "human", "prediction")
PACKAGES = ("app", *SCIENTIFIC)
#: The only scientific modules that read or write files; see docs/conventions.md.
FILE_ROOMS = ("human/readers/", "prediction/model_file.py", "estimation/kernel/machine_code.py")
#: What may import the simulator; estimators never learn from it.
SIMULATOR_ROOMS = ("human/simulate/", "app/demo/", "tests/", "docs/", "benchmarks/", "examples/")
FILE_CALLS = {"open", "read_text", "read_bytes", "write_text", "write_bytes", "unlink", "mkdir"}


def modules(*folders: str) -> Iterator[Path]:
    for folder in folders:
        yield from sorted((ROOT / folder).rglob("*.py"))


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def imports(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def is_own_table(target: ast.expr) -> bool:
    """Whether a file access reads a table that the package itself carries."""
    return re.search(r"\bfiles\(", ast.unparse(target)) is not None


def outside_effects(tree: ast.AST) -> Iterator[str]:
    """Yields what a scientific module must not do: speak, read settings, touch files."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            target = node.func
            called = target.id if isinstance(target, ast.Name) else getattr(target, "attr", "")
            if called in ("print", "input"):
                yield f"line {node.lineno}: {called}()"
            elif called in FILE_CALLS and not is_own_table(target):
                yield f"line {node.lineno}: file access by {called}()"
        elif isinstance(node, ast.Attribute) and node.attr in ("environ", "getenv"):
            yield f"line {node.lineno}: os.{node.attr}"


def test_a_packages_own_tables_are_no_side_effect() -> None:
    assert not list(outside_effects(ast.parse("files('human').joinpath('a.json').read_text()")))


def test_import_contracts_hold() -> None:
    assert cli.lint_imports(config_filename=str(ROOT / "pyproject.toml"), no_cache=True) == 0


@pytest.mark.parametrize("package", SCIENTIFIC)
def test_scientific_packages_have_no_side_effects(package: str) -> None:
    found = {
        name_of(path): effects
        for path in modules(package)
        if not name_of(path).startswith(FILE_ROOMS)
        and (effects := list(outside_effects(ast.parse(path.read_text()))))
    }
    assert found == {}


@pytest.mark.parametrize(
    "line",
    ["print(1)", "open('x')", "Path('x').read_text()", "import os\nos.environ['A']", "input()"],
)
def test_the_search_for_side_effects_finds_them(line: str) -> None:
    assert list(outside_effects(ast.parse(line)))


def test_only_demo_and_tests_import_the_simulator() -> None:
    offenders = [
        name_of(path)
        for path in modules(*PACKAGES)
        if not name_of(path).startswith(SIMULATOR_ROOMS)
        and any(
            re.match(r"human\.simulate\b", name) for name in imports(ast.parse(path.read_text()))
        )
    ]
    assert offenders == []


def surface_key(name: str) -> tuple[int, list[object]]:
    """Orders a surface as ruff's RUF022 does: constants, classes, functions, numbers by value."""
    rank = 0 if name.isupper() else 1 if name[0].isupper() else 2
    parts = [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]
    return rank, parts


@pytest.mark.parametrize("package", PACKAGES)
def test_public_surface(package: str) -> None:
    module = importlib.import_module(package)
    names = list(getattr(module, "__all__", []))
    assert len(set(names)) == len(names)
    assert names == sorted(names, key=surface_key)
    missing = [name for name in names if not hasattr(module, name)]
    assert missing == []


@pytest.mark.parametrize("module", ["human", "ergonomics", "prediction", "app.main", "app.cli"])
def test_serving_needs_no_torch(module: str) -> None:
    code = f"import sys; sys.modules.update(torch=None, gpytorch=None); import {module}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
