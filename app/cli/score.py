"""``ergocast score FILE...``."""

from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic import ValidationError

from app.cli.output import (
    ColumnsFile,
    Json,
    MarkerSetFile,
    console,
    facts,
    print_json,
    progress_bar,
)
from app.cli.train import Sex
from app.files import write_json
from app.problems import InvalidRequest, faults_of_validation


def score(
    files: Annotated[
        list[str],
        typer.Argument(
            help="Recordings: MVNX, BVH, or markers (C3D, TRC) with static:FILE to scale the body."
        ),
    ],
    height: Annotated[float | None, typer.Option("--height", help="Stature, m.")] = None,
    mass: Annotated[float | None, typer.Option("--mass", help="Body mass, kg.")] = None,
    sex: Annotated[Sex, typer.Option(help="For the mass distribution.")] = Sex.UNKNOWN,
    load: Annotated[
        float | None, typer.Option("--load", help="Load borne by both hands together, kg.")
    ] = None,
    accept: Annotated[
        list[str] | None, typer.Option(help="Go on in spite of this finding (may be repeated).")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for one JSON file per recording.")
    ] = None,
    marker_set: MarkerSetFile = None,
    columns: ColumnsFile = None,
    as_json: Json = False,
) -> None:
    """Scores recordings with RULA and REBA, both sides, over time, with reasons."""
    from app.scores.schemas import ScoreRequest
    from app.scores.service import score_take
    from app.takes import takes_of

    try:
        request = ScoreRequest(
            recording_id="file",
            height_m=height,
            mass_kg=mass,
            sex=sex.value,
            hand_load_kg=load,
            accept=accept or [],
        )
    except ValidationError as error:
        faults = faults_of_validation(error.errors())
        raise InvalidRequest("The person or the load cannot be.", faults) from error
    results: dict[Path, dict[str, Any]] = {}
    takes = takes_of(files, marker_set, columns)
    with progress_bar(as_json) as bar:
        task = bar.add_task("scoring", total=len(takes))
        for take in takes:
            bar.update(task, description=f"scoring {take.motion.name}")
            results[take.motion.path], _ = score_take(take, request)
            bar.advance(task)
    if out is not None:
        for path, result in results.items():
            write_json(out / f"{path.name}.score.json", result)
    if as_json:
        answers = [{"file": str(path), **result} for path, result in results.items()]
        print_json(answers if len(answers) > 1 else answers[0])
        return
    page = console()
    for path, result in results.items():
        page.print(facts(path.name, _in_short(result)))
        page.print("Assumed, not measured: " + "; ".join(a["what"] for a in result["assumed"]))


def _in_short(result: dict[str, Any]) -> dict[str, Any]:
    lines: dict[str, Any] = {}
    for method in ("rula", "reba"):
        summary = result["summary"][method]
        lines[method.upper()] = (
            f"median {summary['median']:g}, 90th percentile {summary['p90']:g}, "
            f"most {summary['max']} at {summary['time_of_max_s']:.2f} s"
        )
    at = result["summary"]["rula"]["time_at_or_above"]
    lines["RULA of 5 or more"] = f"{at['5']:.1f} s; of 7: {at['7']:.1f} s"
    lines["worst moments"] = [
        f"{one['time_s']:.2f} s: {one['reasons'][0]}" for one in result["worst"]
    ]
    return lines


def register(cli: typer.Typer) -> None:
    """Adds the command."""
    cli.command()(score)
