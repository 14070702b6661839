"""The Python side of the set-up: ``.venv``, torch, and Ergocast with what it needs."""

from __future__ import annotations

import importlib.util
import platform
import re
import sys
from collections.abc import Sequence

from devtools.browser import find_browser
from devtools.checkout import Checkout
from devtools.commands import Stop, ask, call
from devtools.kernel import compile_kernel
from devtools.torch_build import torch_commands
from devtools.web import build_web, prepare_web

AGAIN = "see that the network and 3 GB of disk are there and run the command again"

WHICH_PYTHON = "import sys; print('{}.{}'.format(*sys.version_info[:2]), sys.base_prefix)"


def set_up(checkout: Checkout, *, tests: bool = False) -> None:
    """Prepares all that serving needs; with ``tests``, the tests' tools and browser too."""
    set_up_tools(checkout, tests=tests)
    compile_kernel(checkout)
    build_web(checkout)
    if tests:
        checkout.step("browser", which_python(), [], lambda: find_browser(checkout))


def set_up_tools(checkout: Checkout, *, tests: bool) -> None:
    """Prepares ``.venv``, without the dashboard; with ``tests``, everybody's tools."""
    version, choice = which_python(), checkout.torch_choice
    checkout.step(
        "environment",
        version,
        [checkout.python],
        lambda: make_environment(checkout),
    )
    torch = requirement(checkout, "torch")
    checkout.step("torch", [version, choice, torch], [], lambda: install_torch(checkout, torch))
    # Once tested here, the test tools stay: `run` after `test` must not install again.
    mark = checkout.stamps / "tests"
    tests = tests or mark.exists()
    extras = (["train"] if choice != "none" else []) + (["test"] if tests else [])
    checkout.step(
        "packages",
        [version, extras, checkout.project()],
        [checkout.bin / "ergocast"],
        lambda: install_packages(checkout, extras),
    )
    if tests:
        mark.touch()
        prepare_web(checkout)


def which_python() -> str:
    """Returns version and place of the running Python; a patch release makes no difference."""
    return "{}.{} {}".format(*sys.version_info[:2], sys.base_prefix)


def requirement(checkout: Checkout, name: str) -> str:
    """Returns a package with the bounds that the ``train`` extra sets for it."""
    extra: list[str] = checkout.project()["project"]["optional-dependencies"]["train"]
    return next(line for line in extra if re.match(rf"{name}\b", line))


def make_environment(checkout: Checkout) -> None:
    """Makes ``.venv`` with this Python, anew when another one made what is there."""
    if importlib.util.find_spec("ensurepip") is None:
        raise Stop(
            "This Python comes without ensurepip, so it cannot make an environment with pip.",
            "apt install python3-venv",
        )
    # Half of one Python and half of another is worse than starting over.
    clear = [] if ask([checkout.python, "-c", WHICH_PYTHON]) == which_python() else ["--clear"]
    call(
        [sys.executable, "-m", "venv", *clear, checkout.venv],
        "The environment .venv could not be made.",
        "delete the folder .venv, see that 3 GB of disk are free, and run the command again",
    )


def install_torch(checkout: Checkout, torch: str) -> None:
    """Installs torch as a CPU build, asking pip first which build it would take."""
    pip = [str(checkout.python), "-m", "pip", "install", "--quiet"]
    report = None
    if checkout.torch_choice != "none":
        dry = ["--dry-run", "--no-deps", "--ignore-installed", "--report", "-"]
        report = ask([*pip, *dry, torch], env=checkout.env)
    for argv in torch_commands(
        checkout.python,
        torch,
        choice=checkout.torch_choice,
        system=platform.system(),
        machine=platform.machine(),
        report=report,
    ):
        call(
            argv,
            "torch could not be installed.",
            f"{AGAIN}, or set ERGOCAST_TORCH=none to go without the gpytorch engine",
            env=checkout.env,
        )


def install_packages(checkout: Checkout, extras: Sequence[str]) -> None:
    """Installs Ergocast itself, editable, with what it depends on."""
    target = f"{checkout.root}[{','.join(extras)}]" if extras else str(checkout.root)
    call(
        [checkout.python, "-m", "pip", "install", "--quiet", "--editable", target],
        "The Python packages could not be installed.",
        AGAIN,
        env=checkout.env,
    )
