"""``ergocast inspect FILE``."""

from pathlib import Path
from typing import Annotated

import typer

from app.cli.output import Json, console, facts, print_json


def inspect(
    file: Annotated[
        Path, typer.Argument(help="MVNX (v3, v4), BVH, C3D, TRC, MOT, STO, or a model file.")
    ],
    as_json: Json = False,
) -> None:
    """Shows what a recording or an operator model holds.

    Of a recording: format, subject, rate, duration, channels, gaps, problems. Of a model: person,
    hand, takes, methods, and how each did on motion it had not seen.
    """
    from app.models.operator import is_model_file
    from app.recordings.inspection import inspection_record
    from human.readers import inspect_file

    if is_model_file(file):
        _model(file, as_json)
        return
    record = inspection_record(inspect_file(file))
    if as_json:
        print_json(record)
        return
    for key in ("markers", "columns", "plates"):
        if key in record:
            record[key] = ", ".join(record[key])
    for kind in ("problems", "notes"):
        record[kind] = [f"{one['place']}: {one['message']} ({one['code']})" for one in record[kind]]
    console().print(facts(file.name, record))


def _model(file: Path, as_json: bool) -> None:
    from app.cli.model_page import print_model
    from app.models.description import described
    from app.models.operator import open_operator

    model = described(open_operator(file).content)
    if as_json:
        print_json({"format": "ergocast-operator-model", **model})
        return
    print_model(console(), file.name, model)


def register(cli: typer.Typer) -> None:
    """Adds the command."""
    cli.command()(inspect)
