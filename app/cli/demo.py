"""``ergocast demo``."""

from pathlib import Path
from typing import Annotated

import typer

from app.cli.output import Json, console, facts, print_json, progress_bar
from app.cli.serve import Data, settings_for


def demo(
    data: Data = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the files here and load them nowhere.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Makes a demonstration: a simulated person, their model, a recording, six robot motions."""
    from app.demo import load_demo, write_demo
    from app.service import ErgocastService

    with progress_bar(as_json) as bar:
        task = bar.add_task("demo", total=1.0)

        def tell(what: str, done: float) -> None:
            bar.update(task, description=what, completed=done)

        if out is not None:
            files = write_demo(out, tell)
            result = {"folder": str(files.folder), "made": True}
        else:
            service = ErgocastService(settings_for(data))
            service.prepare()
            result = load_demo(service, tell)
    if as_json:
        print_json(result)
    else:
        console().print(facts("Demo" if result["made"] else "Demo (was there already)", result))


def register(cli: typer.Typer) -> None:
    """Adds the command."""
    cli.command()(demo)
