"""Gathers the commands, and turns every foreseen error into text and an exit code.

0: done. 2: what was given cannot be used (the message says where and why). 130: Ctrl-C. 1: anything
else.
"""

import sys

import typer

from app.cli import assess as _assess
from app.cli import benchmark as _benchmark
from app.cli import demo as _demo
from app.cli import estimate as _estimate
from app.cli import inspect as _inspect
from app.cli import score as _score
from app.cli import serve as _serve
from app.cli import train as _train
from app.cli import worksheet as _worksheet
from app.cli.output import explain
from app.version import VERSION

#: Exit code of a program that Ctrl-C ended.
_STOPPED = 130

cli = typer.Typer(
    name="ergocast",
    help="What will this robot motion do to the body of the person holding its other end?",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)
for command in (
    _inspect,
    _estimate,
    _train,
    _benchmark,
    _assess,
    _score,
    _worksheet,
    _demo,
    _serve,
):
    command.register(cli)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"ergocast {VERSION}")
        raise typer.Exit


@cli.callback()
def root(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Show the version and leave."
    ),
) -> None:
    """What will this robot motion do to the body of the person holding its other end?"""


def main(arguments: list[str] | None = None) -> None:
    """Runs the command line and leaves with its exit code."""
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        cli(args=arguments, prog_name="ergocast")
    except (KeyboardInterrupt, SystemExit) as ended:
        # Typer turns Ctrl-C into the shells' code for it, without a word.
        if isinstance(ended, SystemExit) and ended.code != _STOPPED:
            raise
        typer.echo("Stopped; nothing half-written was left.", err=True)
        sys.exit(_STOPPED)
    except Exception as error:
        text = explain(error, as_json="--json" in arguments)
        if text is None:
            raise
        typer.echo(text, err=True)
        sys.exit(2)
