"""``ergocast inspect FILE``."""

from pathlib import Path
from typing import Annotated

import typer

from app.cli.output import Json, console, facts, print_json


def inspect(
    file: Annotated[Path, typer.Argument(help="MVNX (v3, v4), BVH, C3D, TRC, MOT or STO.")],
    as_json: Json = False,
) -> None:
    """Shows what a recording holds: format, subject, rate, duration, channels, gaps, problems."""
    from app.recordings.inspection import inspection_record
    from human.readers import inspect_file

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


def register(cli: typer.Typer) -> None:
    """Adds the command."""
    cli.command()(inspect)
