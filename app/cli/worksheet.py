"""``ergocast worksheet rula|reba [FILE]``."""

from typing import Annotated

import typer

from app.cli.output import Json, print_json, read_json_file
from app.worksheets.schemas import Method
from app.worksheets.service import score_worksheet


def worksheet(
    method: Annotated[Method, typer.Argument(help="Which sheet.")],
    file: Annotated[
        str,
        typer.Argument(
            help="One worksheet, a list of them, or a file of worked cases; JSON, '-' is stdin."
        ),
    ] = "-",
    as_json: Json = False,
) -> None:
    """Scores one worksheet or a list of them, with every intermediate score and its reason."""
    del as_json  # The result is JSON either way; the option is there so that every command has it.
    document = read_json_file(file)
    if isinstance(document, dict) and isinstance(document.get("cases"), list):
        # A file of worked cases holds both methods: take those that are meant.
        print_json(
            [
                score_worksheet(method, one, ("cases", i))
                for i, one in enumerate(document["cases"])
                if not isinstance(one, dict) or one.get("method", method) == method
            ]
        )
    elif isinstance(document, list):
        print_json([score_worksheet(method, one, (i,)) for i, one in enumerate(document)])
    else:
        print_json(score_worksheet(method, document))


def register(cli: typer.Typer) -> None:
    """Adds the command."""
    cli.command()(worksheet)
