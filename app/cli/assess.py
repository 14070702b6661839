"""``ergocast assess --model MODEL TRAJECTORY...``."""

from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic import ValidationError
from rich.table import Table

from app.cli.output import Json, console, print_json, progress_bar, read_json_file
from app.files import write_json
from app.problems import Fault, InvalidRequest, faults_of_validation, pointer, shorten


def gather(files: list[str], context: str | None) -> dict[str, Any]:
    """Returns one request from files that hold whole requests, lists of candidates, or one each.

    Args:
        files: JSON files; ``-`` is standard input.
        context: File with the shared part (start, frames, grasp, payload ...), if any.

    Raises:
        InvalidRequest: A file holds none of these, or two files bring a shared part.
    """
    request: dict[str, Any] = {} if context is None else _object(read_json_file(context), context)
    origin = context
    candidates = _candidates(request.pop("candidates", []), str(context))
    for name in files:
        value = read_json_file(name)
        if isinstance(value, list):
            candidates += value
        elif isinstance(value, dict) and "candidates" in value:
            if origin is not None:
                raise InvalidRequest(
                    f"{name} and {origin} both bring the start, frames and payload; "
                    "give candidates alone in one of them."
                )
            origin = name
            request = dict(value)
            candidates += _candidates(request.pop("candidates"), name)
        else:
            candidates.append(_object(value, name))
    if origin is None:
        raise InvalidRequest(
            "The trajectories do not say where the person stands: give a file with the whole "
            "request, or the shared part (start, frames, grasp, payload) with --context FILE."
        )
    return {**request, "candidates": candidates}


def _object(value: Any, name: str) -> dict[str, Any]:
    if isinstance(value, dict):
        return value
    raise InvalidRequest(
        f"{name} holds no trajectory.",
        [Fault(pointer(), "a request, a candidate, or a list of candidates", shorten(value), name)],
    )


def _candidates(value: Any, name: str) -> list[Any]:
    if isinstance(value, list):
        return list(value)
    raise InvalidRequest(
        f"{name} holds no candidates.",
        [Fault(pointer("candidates"), "a list of candidates", shorten(value), name)],
    )


def assess(
    trajectories: Annotated[
        list[str],
        typer.Argument(help="Requests, candidates or lists of them, JSON; '-' reads stdin."),
    ],
    model: Annotated[Path, typer.Option(help="Operator model made by 'ergocast train'.")],
    context: Annotated[
        str | None, typer.Option(help="JSON with what the candidates share: start, frames, ...")
    ] = None,
    samples: Annotated[int | None, typer.Option(help="Roll-outs per candidate.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the roll-outs.")] = None,
    out: Annotated[Path | None, typer.Option(help="Also write the answer here, as JSON.")] = None,
    as_json: Json = False,
) -> None:
    """Ranks candidate robot trajectories by what they do to the person, with probabilities."""
    from app.assessments.assess import assess as assess_request
    from app.assessments.schemas import AssessmentRequest
    from app.models.operator import open_operator

    read = [*trajectories, context or "-", str(model)]
    if out is not None and out.resolve() in [Path(name).resolve() for name in read]:
        raise InvalidRequest(f"--out {out}: this is a file that is read; it is not overwritten.")
    request = gather(trajectories, context)
    for name, value in (("samples", samples), ("seed", seed)):
        if value is not None:
            request[name] = value
    operator = open_operator(model)
    request["model_id"] = operator.id
    try:
        checked = AssessmentRequest.model_validate(request)
    except ValidationError as error:
        faults = faults_of_validation(error.errors())
        raise InvalidRequest("The request is not valid.", faults) from error
    with progress_bar(as_json) as bar:
        task = bar.add_task("predicting", total=len(checked.candidates))
        outcome = assess_request(
            checked, operator, lambda done, total: bar.update(task, completed=done, total=total)
        )
    if out is not None:
        write_json(out, outcome.result)
    if as_json:
        print_json(outcome.result)
    else:
        _print_ranking(outcome.result)


def _print_ranking(result: dict[str, Any]) -> None:
    table = Table(box=None, pad_edge=False)
    for column in ("rank", "candidate", "cost", "best?", "RULA", "RULA≥5", "worst moment"):
        table.add_column(
            column, justify="left" if column in ("candidate", "worst moment") else "right"
        )
    ranked = [c for c in result["candidates"] if c["problem"] is None]
    for one in sorted(ranked, key=lambda c: (c["rank"], c["id"])):
        expected, often = one["rula"]["expected"], one["rula"]["p_ge_5"]
        worst = one["worst"]
        tie = "=" if one["tied_with"] else ""
        table.add_row(
            f"{one['rank']}{tie}",
            one["id"],
            f"{one['cost']['total']:.3f}",
            f"{one['p_best']:.0%}",
            f"{sum(expected) / len(expected):.1f}",
            f"{sum(often) / len(often):.0%}",
            f"{worst['time_s']:.2f} s, {worst['body_part']}: {worst['reason']}",
        )
    out = console()
    out.print(table)
    for one in result["candidates"]:
        if one["problem"] is not None:
            out.print(f"{one['id']} not assessed: {one['problem']['detail']}")
        elif one["out_of_distribution"]["flag"]:
            out.print(f"{one['id']}: the model has seen few such postures; read it with care.")
    for one in ranked:
        for entry in one["assumed"]:
            if entry["what"] == "balance" and entry["effect"] != "none":
                out.print(f"{one['id']}: balance {entry['value']}.")
    assumed = {entry["what"]: entry for c in ranked for entry in c["assumed"]}
    if assumed:
        out.print("Assumed, not measured: " + "; ".join(sorted(assumed)) + ".")


def register(cli: typer.Typer) -> None:
    """Adds the command."""
    cli.command()(assess)
