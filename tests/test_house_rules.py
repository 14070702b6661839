"""What every file of the tree must keep to, whoever wrote it."""

import ast
import functools
import os
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: Folders that tools make.
MADE = {"node_modules", "__pycache__", "dist", "build", "static", "data", "coverage"}
TEXT = {".py", ".md", ".toml", ".json", ".ts", ".css", ".html", ".js", ".cff", ".yml", ""}
#: Spelled in two halves, so that this file passes its own test.
MACHINE_PATHS = ("/wo" + "rk/", "/tm" + "p/", "/ro" + "ot/", "/ho" + "me/", "/op" + "t/")
HOSTS = ("py" + "pi.org", "python" + "hosted.org", "npm" + "js.org", "download.py" + "torch")
LONGEST = 450


def files() -> Iterator[Path]:
    for folder, folders, names in os.walk(ROOT):
        inside = Path(folder).relative_to(ROOT)
        folders[:] = [
            name
            for name in folders
            if not name.startswith(".") or name == ".ci"
            if name not in MADE or inside == Path("human")
        ]
        yield from (Path(folder) / name for name in names)


@functools.cache
def texts() -> dict[str, str]:
    return {
        path.relative_to(ROOT).as_posix(): path.read_text("utf-8")
        for path in files()
        if path.suffix in TEXT and not path.is_symlink()
    }


@functools.cache
def attributes() -> list[tuple[str, ast.Attribute]]:
    """Every ``something.name`` in the Python files, with the file's name."""
    return [
        (name, node)
        for name, text in texts().items()
        if name.endswith(".py")
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Attribute)
    ]


def test_no_file_names_a_machine_or_a_registry() -> None:
    found = [
        f"{name}:{number}: {word}"
        for name, text in texts().items()
        if name != "LICENSE"
        for number, line in enumerate(text.splitlines(), 1)
        for word in (*MACHINE_PATHS, *HOSTS)
        if re.search(
            rf"(?<![\w./*$}}-]){re.escape(word)}" if word[0] == "/" else re.escape(word), line
        )
    ]
    assert found == []


def test_every_link_of_the_documents_leads_somewhere() -> None:
    broken = []
    for name, text in texts().items():
        if not name.endswith(".md"):
            continue
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            path = target.partition("#")[0]
            if path and "://" not in path and not (ROOT / name).parent.joinpath(path).exists():
                broken.append(f"{name}: {target}")
    assert broken == []


def test_helpers_are_named_after_their_subject_and_files_stay_readable() -> None:
    python = [(name, text) for name, text in texts().items() if name.endswith(".py")]
    assert [name for name, _ in python if re.search(r"(^|/)(utils?|helpers|misc)\.py$", name)] == []
    long = {name: len(text.splitlines()) for name, text in python}
    assert {name: lines for name, lines in long.items() if lines > LONGEST} == {}


def test_randomness_comes_in_as_a_generator() -> None:
    # A test may look whether the global state was left alone.
    allowed = ("Generator", "default_rng", "SeedSequence", "PCG64", "get_state")
    found = [
        f"{name}:{node.lineno}: np.random.{node.attr}"
        for name, node in attributes()
        if node.attr not in allowed and ast.unparse(node.value) in ("np.random", "numpy.random")
    ]
    assert found == []


def test_no_test_is_skipped() -> None:
    found = [
        f"{name}:{node.lineno}: {node.attr}"
        for name, node in attributes()
        if name.startswith("tests/")
        and node.attr in ("xfail", "skip", "skipif", "importorskip")
        and ast.unparse(node.value) in ("pytest", "pytest.mark")
    ]
    assert found == []


def test_readme_and_ci_say_the_same_two_commands() -> None:
    readme = (ROOT / "README.md").read_text()
    assert "python3 dev.py run" in readme
    assert "python3 dev.py test" in readme
    ci = ROOT / ".ci" / "run"
    assert os.access(ci, os.X_OK)
    assert ci.read_text().rstrip().endswith("python3 dev.py test")


def test_the_licence_is_the_one_declared() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    licence = (ROOT / "LICENSE").read_text()
    assert project["license"] == "Apache-2.0"
    assert "Apache License\n                           Version 2.0, January 2004" in licence
    assert licence.rstrip().endswith("limitations under the License.")


def test_torch_is_bounded_and_no_part_of_the_base_install() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert not any(re.match(r"(torch|gpytorch)\b", line) for line in project["dependencies"])
    (torch,) = [
        line for line in project["optional-dependencies"]["train"] if line.startswith("torch")
    ]
    assert "<" in torch


def test_the_citation_names_the_three_papers() -> None:
    citation = (ROOT / "CITATION.cff").read_text()
    for doi in ("10.3390/s19122794", "10.1109/ACCESS.2021.3109238", "10.1109/LRA.2021.3086666"):
        assert doi in citation
