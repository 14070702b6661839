"""What commands print: tables for people, JSON for machines, errors in words."""

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from app.problems import AppError, InvalidRequest, Problem, Unreadable

#: ``--json`` of every command.
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for machines.")]
#: What commands that read markers take besides.
MarkerSetFile = Annotated[
    Path | None, typer.Option("--marker-set", help="JSON that maps other markers to the body.")
]
ColumnsFile = Annotated[
    Path | None, typer.Option("--columns", help="JSON: what columns of CSV and .mat files hold.")
]


def console() -> Console:
    """Returns the console for results; made anew so that a captured stdout is honoured."""
    # No markup: names from files are shown as they are, also with brackets in them.
    return Console(highlight=False, markup=False)


def print_json(value: Any) -> None:
    """Prints a value as JSON."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, indent=2)
    typer.echo(text.encode(errors="backslashreplace").decode())


def problem_of(error: Exception) -> Problem | None:
    """Returns a foreseen error as a problem, None for one that is a fault of ours."""
    from ergonomics import ErgonomicsError
    from estimation import EstimationError
    from human import HumanError
    from prediction import PredictionError

    if isinstance(error, Problem):
        return error
    if isinstance(error, HumanError | EstimationError | PredictionError | ErgonomicsError):
        return InvalidRequest(str(error))
    if isinstance(error, AppError):
        return InvalidRequest(str(error))
    if isinstance(error, OSError) and error.filename:
        return Unreadable(f"{error.filename}: {error.strerror}.")
    return None


def explain(error: Exception, as_json: bool) -> str | None:
    """Returns a foreseen error as text (or problem JSON), None for one that is a fault of ours."""
    problem = problem_of(error)
    if problem is None:
        return None
    if as_json:
        return json.dumps(problem.body(), ensure_ascii=False)
    return f"Error: {problem.text()}"


def read_json_file(name: str) -> Any:
    """Reads JSON from a file, or from standard input for ``-``.

    Raises:
        Unreadable: It is not JSON; the message names the line where it can be told.
    """
    try:
        text = (
            typer.get_text_stream("stdin", encoding="utf-8").read()
            if name == "-"
            else Path(name).read_text("utf-8")
        )
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise Unreadable(
            f"{name}, line {error.lineno}, column {error.colno}: expected JSON, {error.msg}."
        ) from error
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise Unreadable(f"{name}, line {line}: expected JSON in UTF-8, {error.reason}.") from error
    except RecursionError as error:
        raise Unreadable(f"{name}: expected JSON, got brackets nested too deeply.") from error
    except ValueError as error:
        raise Unreadable(f"{name}: expected JSON, got a number of too many digits.") from error


def facts(title: str, values: Mapping[str, Any]) -> Table:
    """Returns a table of names and values."""
    table = Table(title=title, title_justify="left", show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, value in values.items():
        table.add_row(name, show(value))
    return table


def show(value: Any) -> str:
    """Returns a value as people read it: few digits, a dash for nothing."""
    if value is None or value == "" or value == [] or value == {}:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}" if math.isfinite(value) else str(value)
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {show(item)}" for key, item in value.items())
    if isinstance(value, list | tuple):
        return "\n".join(show(item) for item in value)
    return str(value)


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Progress]:
    """Yields a progress bar on standard error; silent for machines and where no one looks."""
    page = Console(stderr=True)
    with Progress(
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        console=page,
        transient=True,
        disable=quiet or not page.is_terminal,
    ) as bar:
        yield bar
