"""The set-up: what it decides, what it skips, and what it says when it cannot go on."""

import json
import os
import shutil
import socket
import stat
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

import dev
from devtools import browser, checks, environment, web
from devtools.checkout import Checkout
from devtools.commands import Stop, ask, call, digest
from devtools.torch_build import torch_commands, wants_cuda

ROOT = Path(__file__).parents[1]
TORCH = "torch>=2.6,<2.14"
CPU_NEEDS = ["filelock", "sympy>=1.13.3", 'optree>=0.13.0; extra == "optree"']
CUDA_NEEDS = [*CPU_NEEDS, 'nvidia-cudnn-cu13==9.20; platform_system == "Linux"']


def report(needs: list[str] | None) -> dict[str, object]:
    """What pip reports of a dry run that chose a torch with these requirements."""
    return {"version": "1", "install": [{"metadata": {"name": "torch", "requires_dist": needs}}]}


def script(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


@pytest.fixture
def checkout(tmp_path: Path) -> Checkout:
    """An empty working copy whose path leads to nothing but its own tools."""
    (tmp_path / "pyproject.toml").write_text((ROOT / "pyproject.toml").read_text())
    return Checkout(tmp_path, {"PATH": str(tmp_path / "tools")})


# --- which torch ---


@pytest.mark.parametrize(
    ("needs", "machine", "cuda"),
    [
        (CPU_NEEDS, "x86_64", False),
        (None, "x86_64", False),
        (CUDA_NEEDS, "x86_64", True),
        (['triton==3.7.1; platform_system == "Linux"'], "x86_64", True),
        (['cuda-bindings<14,>=13; platform_system == "Linux"'], "aarch64", True),
        (['nvidia-nccl-cu12==2; platform_machine == "x86_64"'], "aarch64", False),
        (['nvidia-nccl-cu12==2; platform_machine == "x86_64"'], "x86_64", True),
        (['nvidia-ml-py; extra == "profiling"'], "x86_64", False),
    ],
)
def test_cuda_is_seen_in_pips_report(needs: list[str] | None, machine: str, cuda: bool) -> None:
    assert wants_cuda(report(needs), machine) is cuda


@pytest.mark.parametrize(
    ("choice", "system", "needs", "through_uv"),
    [
        ("cpu", "Linux", CPU_NEEDS, False),
        ("cpu", "Linux", CUDA_NEEDS, True),
        ("cpu", "Darwin", CUDA_NEEDS, False),
        ("cuda", "Linux", CUDA_NEEDS, False),
    ],
)
def test_uv_installs_torch_only_when_pip_would_bring_cuda(
    choice: str, system: str, needs: list[str], through_uv: bool
) -> None:
    commands = torch_commands(
        Path("python"),
        TORCH,
        choice=choice,
        system=system,
        machine="x86_64",
        report=json.dumps(report(needs)),
    )
    assert commands[-1][-1] == TORCH
    assert ("--torch-backend=cpu" in commands[-1]) is through_uv
    assert len(commands) == (2 if through_uv else 1)


def test_torch_may_be_left_out() -> None:
    none = torch_commands(
        Path("python"), TORCH, choice="none", system="Linux", machine="x86_64", report=None
    )
    assert none == []


@pytest.mark.parametrize(("choice", "word"), [("gpu", "ERGOCAST_TORCH"), ("cpu", "network")])
def test_no_torch_to_be_had_is_said(choice: str, word: str) -> None:
    with pytest.raises(Stop) as stop:
        torch_commands(
            Path("python"), TORCH, choice=choice, system="Linux", machine="x86_64", report=None
        )
    assert word in f"{stop.value.problem} {stop.value.remedy}"


# --- steps ---


def test_a_step_is_taken_again_only_when_something_changed(checkout: Checkout) -> None:
    output = checkout.root / "made"
    taken: list[int] = []

    def action() -> None:
        output.touch()
        taken.append(1)

    def take(inputs: object) -> bool:
        return checkout.step("make", inputs, [output], action)

    assert [take("a"), take("a"), take("b"), take("b")] == [True, False, True, False]
    output.unlink()
    assert take("b")
    assert len(taken) == 3


def test_a_failed_step_is_not_stamped(checkout: Checkout) -> None:
    def fail() -> None:
        raise Stop("no", "try")

    for _ in range(2):
        with pytest.raises(Stop):
            checkout.step("make", "a", [], fail)
    assert not (checkout.stamps / "make").exists()


@pytest.mark.parametrize("argv", [["false"], ["no-such-program-here"]])
def test_a_failing_program_stops_with_its_remedy(argv: list[str]) -> None:
    with pytest.raises(Stop, match="did not") as stop:
        call(argv, "It did not work.", "do the one thing")
    assert stop.value.remedy == "do the one thing"
    assert ask(argv) is None


@pytest.fixture
def installs(checkout: Checkout, monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The commands that the Python part of the set-up would run; none of them is."""
    commands: list[list[str]] = []

    def record(argv: list[object], *rest: object, **options: object) -> None:
        commands.append([str(part) for part in argv])
        script(checkout.python, "exit 0")
        script(checkout.bin / "ergocast", "exit 0")

    monkeypatch.setattr(environment, "call", record)
    monkeypatch.setattr(environment, "ask", lambda *argv, **options: json.dumps(report(CPU_NEEDS)))
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
    checkout: Checkout, monkeypatch: pytest.MonkeyPatch, same: bool, cleared: bool
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


# --- web and browser ---


@pytest.mark.parametrize(
    ("version", "accepted"),
    [
        ("v20.19.0", True),
        ("v20.18.3", False),
        ("v21.7.0", False),
        ("v22.11.0", False),
        ("v22.12.0", True),
        ("v24.1.0", True),
        ("", False),
        (None, False),
    ],
)
def test_node_is_accepted_as_vite_does(version: str | None, accepted: bool) -> None:
    assert web.node_accepted(version) is accepted


def page(checkout: Checkout) -> None:
    """Gives a working copy web sources and tools that build a page from them."""
    tools = checkout.root / "tools"
    script(tools / "node", "echo v22.12.0")
    script(
        tools / "npm",
        f"PATH=/bin:/usr/bin; echo $1 >> {checkout.root}/npm.log; echo $CA >> {checkout.root}/ca\n"
        "[ $1 = ci ] && mkdir -p node_modules\n"
        '[ "$1" = run ] && mkdir -p ../app/static && cp index.html ../app/static/index.html; true',
    )
    checkout.web.mkdir()
    for name in ("package.json", "package-lock.json", "index.html"):
        (checkout.web / name).write_text(name)


def test_the_page_is_built_when_its_sources_change(checkout: Checkout) -> None:
    page(checkout)
    log = checkout.root / "npm.log"
    web.build_web(checkout)
    assert log.read_text().split() == ["ci", "run"]
    assert web.is_current(checkout)
    (checkout.web / "node_modules" / "made.js").touch()
    web.build_web(checkout)
    assert log.read_text().split() == ["ci", "run"]
    (checkout.web / "index.html").write_text("changed")
    assert not web.is_current(checkout)
    web.build_web(checkout)
    assert log.read_text().split() == ["ci", "run", "run"]
    assert (checkout.bundle / "index.html").read_text() == "changed"


def test_npm_sees_the_callers_environment(checkout: Checkout) -> None:
    checkout.env["CA"] = "my-certificates"
    page(checkout)
    web.build_web(checkout)
    assert set((checkout.root / "ca").read_text().split()) == {"my-certificates"}


def test_an_old_node_gives_way_to_the_one_installed(checkout: Checkout) -> None:
    page(checkout)
    script(checkout.root / "tools" / "node", "echo v18.0.0")
    script(checkout.bin / "node", "echo v24.0.0")
    script(checkout.bin / "npm", "exit 0")
    assert not web.node_is_there(checkout)
    assert web.npm_command(checkout, "ci")[0] == str(checkout.bin / "npm")


def test_a_renamed_source_changes_the_digest(checkout: Checkout) -> None:
    page(checkout)
    before = web.sources_digest(checkout)
    (checkout.web / "index.html").rename(checkout.web / "main.html")
    assert web.sources_digest(checkout) != before


def test_a_browser_on_the_path_is_enough(checkout: Checkout) -> None:
    found = script(checkout.root / "tools" / "chromium", "echo Chromium 156")
    assert browser.browser(checkout) == str(found)


def test_a_browser_that_does_not_start_does_not_count(
    checkout: Checkout, monkeypatch: pytest.MonkeyPatch
) -> None:
    script(checkout.root / "tools" / "chromium", "exit 127")
    script(checkout.python, "exit 1")
    monkeypatch.setattr(browser.os, "geteuid", lambda: 1000)
    with pytest.raises(Stop) as stop:
        browser.find_browser(checkout)
    assert stop.value.remedy == "sudo apt-get install chromium"


def test_root_on_debian_gets_the_browser_by_apt(
    checkout: Checkout, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools = checkout.root / "tools"
    script(checkout.python, "exit 1")
    made = f"echo '#!/bin/sh\necho Chromium' > {tools}/chromium; chmod +x {tools}/chromium"
    script(tools / "apt-get", f"PATH=/bin:/usr/bin; [ $1 = update ] || {{ {made}; }}")
    monkeypatch.setattr(browser.os, "geteuid", lambda: 0)
    browser.find_browser(checkout)
    assert browser.browser(checkout) == str(tools / "chromium")


# --- commands ---


@pytest.mark.parametrize(
    ("python", "system", "remedy"),
    [((3, 10), "linux", "python3.11"), ((3, 12), "win32", "WSL2")],
)
def test_an_unfit_machine_is_told_what_to_do(
    python: tuple[int, int], system: str, remedy: str
) -> None:
    with pytest.raises(Stop) as stop:
        dev.check_machine(python, system)
    assert remedy in stop.value.remedy
    dev.check_machine((3, 11), "darwin")


def test_a_taken_port_is_said_with_a_free_one() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(Stop, match="taken") as stop:
            dev.check_port("127.0.0.1", port)
    assert stop.value.remedy == f"python3 dev.py run --port {port + 1}"
    dev.check_port("127.0.0.1", port)


@pytest.mark.parametrize("port", ["0", "99999", "-1"])
def test_an_impossible_port_is_refused(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        dev.main(["run", f"--port={port}"])
    assert "between 1 and 65535" in capsys.readouterr().err


def test_a_foreign_address_is_said() -> None:
    with pytest.raises(Stop, match="Cannot listen"):
        dev.check_port("192.0.2.1", 8000)


def test_a_stop_is_one_problem_and_one_remedy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(dev, "check_machine", stopping(Stop("It is so.", "do this")))
    assert dev.main(["setup"]) == 1
    assert capsys.readouterr().err == "\ndev.py: It is so.\n  Do this: do this\n"
    monkeypatch.setattr(dev, "check_machine", stopping(KeyboardInterrupt()))
    assert dev.main(["setup"]) == 130
    assert "stopped" in capsys.readouterr().err


def stopping(error: BaseException) -> Callable[..., None]:
    def stop(*argv: object) -> None:
        raise error

    return stop


def test_every_check_runs_and_the_failed_ones_are_named(checkout: Checkout) -> None:
    trace = checkout.root / "trace"
    made = [
        checks.Check(name, ["/bin/sh", "-c", f"echo {name} >> {trace}; exit {code}"], checkout.root)
        for name, code in (("one", 1), ("two", 0), ("three", 2))
    ]
    with pytest.raises(Stop, match=r"Failed: one, three\."):
        checks.run_checks(checkout, made)
    assert trace.read_text().split() == ["one", "two", "three"]
    checks.run_checks(checkout, made[1:2])


def test_recordings_beside_the_checkout_are_used(checkout: Checkout, tmp_path: Path) -> None:
    inner = Checkout(tmp_path / "copy", checkout.env)
    assert "ERGOCAST_RECORDINGS" not in checks.check_env(inner)
    (tmp_path / "shared" / "data").mkdir(parents=True)
    assert checks.check_env(inner)["ERGOCAST_RECORDINGS"] == str(tmp_path / "shared" / "data")
    inner.env["ERGOCAST_RECORDINGS"] = "elsewhere"
    assert checks.check_env(inner)["ERGOCAST_RECORDINGS"] == "elsewhere"


# --- the wheel ---


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
