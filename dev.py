#!/usr/bin/env python3
"""Sets up, runs and checks a checkout of Ergocast; needs Python >= 3.11 and nothing else.

``python3 dev.py run`` serves the dashboard and API with a demo loaded; ``python3 dev.py test`` runs
every check. Both prepare ``.venv`` and the web bundle first. Each step is stamped with a digest of
what it depends on, so that the second time nothing is done twice, and each failure ends with the
one thing to do about it. The steps themselves are in ``devtools/``.
"""

from __future__ import annotations

import argparse
import errno
import os
import socket
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from devtools.checkout import Checkout
from devtools.checks import Check, lint_checks, programs, pytest, run_checks, test_checks
from devtools.commands import Stop, call, say
from devtools.environment import set_up, set_up_tools

ROOT = Path(__file__).resolve().parent
PYTHON_NEEDED = (3, 11)


def check_port(host: str, port: int) -> None:
    """Says that an address is taken before minutes of set-up, not after them.

    Raises:
        Stop: Something else listens there, or the address is not this machine's.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise Stop(
                f"Port {port} on {host} is taken by another program.",
                f"python3 dev.py run --port {port + 1}",
            ) from error
        raise Stop(
            f"Cannot listen on {host}, port {port}: {error.strerror or error}.",
            "choose an address of this machine: python3 dev.py run --host 127.0.0.1 --port 8000",
        ) from error


def run(checkout: Checkout, options: argparse.Namespace) -> None:
    """Serves the dashboard and API with the demo loaded; does not return."""
    check_port(options.host, options.port)
    set_up(checkout)
    data = ["--data", str(Path(options.data).resolve())] if options.data else []
    ergocast = str(checkout.bin / "ergocast")
    os.chdir(checkout.root)
    say("demo ...")
    call(
        [ergocast, "demo", *data],
        "The demo could not be loaded.",
        "correct what is reported above; if old data is in the way, name another folder: "
        "python3 dev.py run --data FOLDER",
        env=checkout.env,
    )
    argv = [ergocast, "serve", "--host", options.host, "--port", str(options.port), *data]
    # The service takes this process's place: Ctrl-C reaches it and nobody in between.
    os.execve(ergocast, argv, checkout.env)


def test(checkout: Checkout, options: argparse.Namespace) -> None:
    """Runs every check, or pytest alone with the arguments given."""
    set_up(checkout, tests=True)
    if options.arguments:
        run_checks(checkout, [Check("tests", pytest(checkout, *options.arguments), checkout.root)])
    else:
        run_checks(checkout, [*lint_checks(checkout), *test_checks(checkout)])
        say("all checks passed")


def lint(checkout: Checkout, options: argparse.Namespace) -> None:
    """Runs the checks that only read the code."""
    set_up_tools(checkout, tests=True)
    run_checks(checkout, lint_checks(checkout))


def bench(checkout: Checkout, options: argparse.Namespace) -> None:
    """Runs the benchmarks and examples named, or all of them once, one after the other."""
    there = {
        check.name: check
        for folder in ("benchmarks", "examples")
        for check in programs(checkout, folder)
    }
    unknown = sorted(set(options.names) - set(there))
    if unknown:
        raise Stop(
            f"There is no benchmark called {', '.join(unknown)}.",
            f"name one of {', '.join(there)}",
        )
    set_up(checkout, tests=True)
    # A program that runs others, as ``prediction`` does, stands for them.
    whole = [name for name in there if not any(name.startswith(f"{one}.") for one in there)]
    run_checks(checkout, [there[name] for name in options.names or whole])


def docs(checkout: Checkout, options: argparse.Namespace) -> None:
    """Makes again what the documents show and scripts produce."""
    set_up(checkout, tests=True)
    run_checks(checkout, programs(checkout, "docs"))


def setup(checkout: Checkout, options: argparse.Namespace) -> None:
    """Prepares what ``run`` needs and stops there."""
    set_up(checkout)


def port_number(text: str) -> int:
    """Returns a port from the command line; the system itself would wrap a larger number."""
    port = int(text)
    if not 0 < port < 65536:
        raise argparse.ArgumentTypeError(f"{port} is not between 1 and 65535")
    return port


def parser() -> argparse.ArgumentParser:
    """Returns the command line's grammar."""
    top = argparse.ArgumentParser(prog="dev.py", description="Sets up, runs and checks Ergocast.")
    commands = top.add_subparsers(required=True, metavar="COMMAND")

    def command(
        name: str, action: Callable[[Checkout, argparse.Namespace], None], meaning: str
    ) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=meaning)
        sub.set_defaults(action=action)
        return sub

    serve = command("run", run, "set up, load the demo, serve dashboard and API")
    serve.add_argument("--host", default="127.0.0.1", help="address to listen on")
    serve.add_argument("--port", default=8000, type=port_number, help="port to listen on")
    serve.add_argument("--data", help="folder for everything the service keeps")
    tests = command("test", test, "set up, run every check; with arguments, pytest alone")
    tests.add_argument("arguments", nargs="*", help="handed to pytest")
    command("setup", setup, "prepare .venv and stop there")
    command("lint", lint, "style, types and import rules")
    command("bench", bench, "benchmarks and examples, with their figures").add_argument(
        "names", nargs="*", help="those to run"
    )
    command("docs", docs, "make the documents' pictures again")
    return top


def check_machine(python: tuple[int, ...], system: str) -> None:
    """Refuses a machine on which nothing further can work.

    Args:
        python: Major and minor version of the running Python.
        system: As in ``sys.platform``.

    Raises:
        Stop: This Python is too old, or this is Windows itself.
    """
    if python < PYTHON_NEEDED:
        raise Stop(
            "Ergocast needs Python >= {}.{}; this is {}.{}.".format(*PYTHON_NEEDED, *python),
            "run dev.py with a newer one, for example python3.11 dev.py",
        )
    if system == "win32":
        raise Stop(
            "Pinocchio has no package for Windows.",
            "open a WSL2 terminal (wsl --install) and run the command there",
        )


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command and returns its exit code."""
    grammar = parser()
    options, rest = grammar.parse_known_args(argv)
    if options.action is test:
        options.arguments += rest
    elif rest:
        grammar.error(f"unknown arguments: {' '.join(rest)}")
    try:
        check_machine(sys.version_info[:2], sys.platform)
        options.action(Checkout(ROOT), options)
    except Stop as stop:
        print(f"\ndev.py: {stop.problem}\n  Do this: {stop.remedy}", file=sys.stderr, flush=True)
        return 1
    except KeyboardInterrupt:
        print("\ndev.py: stopped", file=sys.stderr, flush=True)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
