"""The Python side of the set-up: what is installed, when, and when not again."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from devtools import environment
from devtools.checkout import Checkout
from devtools.commands import Stop

TORCH = "torch>=2.6,<2.14"
CPU_REPORT = {"install": [{"metadata": {"name": "torch", "requires_dist": ["filelock"]}}]}
Script = Callable[[Path, str], Path]


@pytest.fixture
def installs(
    checkout: Checkout, script: Script, monkeypatch: pytest.MonkeyPatch
) -> list[list[str]]:
    """The commands that the Python part of the set-up would run; none of them is."""
    commands: list[list[str]] = []

    def record(argv: list[object], *rest: object, **options: object) -> None:
        commands.append([str(part) for part in argv])
        script(checkout.python, "exit 0")
        script(checkout.bin / "ergocast", "exit 0")

    monkeypatch.setattr(environment, "call", record)
    monkeypatch.setattr(environment, "ask", lambda *argv, **options: json.dumps(CPU_REPORT))
    monkeypatch.setattr(environment, "find_browser", lambda checkout: None)
    return commands


def test_the_set_up_does_nothing_twice(checkout: Checkout, installs: list[list[str]]) -> None:
    environment.set_up(checkout)
    assert [argv[-1].rsplit("/", 1)[-1] for argv in installs] == [
        ".venv",
        TORCH,
        f"{checkout.root.name}[train]",
    ]
    environment.set_up(checkout)
    assert len(installs) == 3
    environment.set_up(checkout, tests=True)
    assert installs[-1][-1].endswith("[train,test]")
    environment.set_up(checkout)
    assert len(installs) == 4


def test_a_new_dependency_is_installed_and_a_new_lint_rule_is_not(
    checkout: Checkout, installs: list[list[str]]
) -> None:
    environment.set_up(checkout)
    project = checkout.root / "pyproject.toml"
    project.write_text(project.read_text().replace("line-length = 100", "line-length = 99"))
    environment.set_up(checkout)
    assert len(installs) == 3
    project.write_text(project.read_text().replace('"lxml>=5.3",', '"lxml>=5.3", "six",'))
    environment.set_up(checkout)
    assert len(installs) == 4


def test_without_torch_the_train_extra_stays_out(
    checkout: Checkout, installs: list[list[str]]
) -> None:
    checkout.env["ERGOCAST_TORCH"] = "none"
    environment.set_up(checkout)
    assert TORCH not in [argv[-1] for argv in installs]
    assert installs[-1][-1] == str(checkout.root)


@pytest.mark.parametrize(("same", "cleared"), [(True, False), (False, True)])
def test_the_environment_of_another_python_is_made_anew(
    checkout: Checkout, script: Script, monkeypatch: pytest.MonkeyPatch, same: bool, cleared: bool
) -> None:
    commands: list[list[object]] = []
    monkeypatch.setattr(environment, "call", lambda argv, *rest: commands.append(argv))
    script(checkout.python, f"echo '{environment.which_python()}{'' if same else '.1'}'")
    environment.make_environment(checkout)
    assert ("--clear" in commands[0]) is cleared


def test_a_python_without_ensurepip_is_told_the_package(
    checkout: Checkout, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(environment.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(Stop) as stop:
        environment.make_environment(checkout)
    assert stop.value.remedy == "apt install python3-venv"
