"""``ergocast estimate FILE... --height --mass``."""

import os
import tempfile
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic import ValidationError
from rich.table import Table

from app.cli.output import (
    ColumnsFile,
    Json,
    MarkerSetFile,
    console,
    facts,
    print_json,
    problem_of,
    progress_bar,
    show,
)
from app.cli.train import Sex
from app.files import write_json
from app.problems import InvalidRequest, faults_of_validation


class Method(StrEnum):
    """Estimators that can be asked for."""

    ONE_STEP = "one-step"
    TWO_STEP = "two-step"
    DETERMINISTIC = "deterministic"


class Hands(StrEnum):
    """Hands that may bear something."""

    AUTO = "auto"
    BOTH = "both"
    RIGHT = "right"
    LEFT = "left"
    NONE = "none"


class Definition(StrEnum):
    """Which kilograms a payload is."""

    INERTIAL = "inertial"
    VERTICAL = "vertical"
    NORM = "norm"


class Bands(StrEnum):
    """What the bands hold."""

    NOISE = "noise"
    NOISE_AND_MODEL = "noise-and-model"


def estimate(
    files: Annotated[
        list[str],
        typer.Argument(
            help="Motions of one person (MVNX, BVH, C3D, TRC), static:FILE to scale the body to "
            "markers, grf:FILE (MOT, STO, C3D) for the force plates of the motion before it."
        ),
    ],
    height: Annotated[float, typer.Option("--height", help="Stature, m.")],
    mass: Annotated[
        float | None,
        typer.Option("--mass", help="Body mass, kg; left out, what the static trial's plates say."),
    ] = None,
    sex: Annotated[Sex, typer.Option(help="For the mass distribution.")] = Sex.UNKNOWN,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for a Parquet file, a summary and a picture per motion."),
    ] = None,
    hands: Annotated[
        Hands, typer.Option(help="Hands that may bear something; auto: both, if there are forces.")
    ] = Hands.AUTO,
    method: Annotated[
        Method, typer.Option(help="two-step is the 2021 paper's, deterministic the check.")
    ] = Method.ONE_STEP,
    definition: Annotated[
        Definition, typer.Option(help="Which kilograms the payload over time is.")
    ] = Definition.INERTIAL,
    bands: Annotated[
        Bands, typer.Option(help="noise: of the sensors alone; else errors of the body model, too.")
    ] = Bands.NOISE_AND_MODEL,
    tare: Annotated[
        str | None,
        typer.Option(
            metavar="START:END", help="Seconds in which the person stands still and bears nothing."
        ),
    ] = None,
    marker_set: MarkerSetFile = None,
    columns: ColumnsFile = None,
    clock_offset: Annotated[
        float | None, typer.Option(help="Seconds to add to the plates' times; else estimated.")
    ] = None,
    assign: Annotated[
        list[str] | None,
        typer.Option(metavar="PLATE=SIDE", help="Whose foot a plate bears, such as 1=right."),
    ] = None,
    accept: Annotated[
        list[str] | None, typer.Option(help="Go on in spite of this finding (may be repeated).")
    ] = None,
    as_json: Json = False,
) -> None:
    """Estimates joint torques, efforts and payload, each with its band, from motion and forces."""
    from app.estimates.schemas import EstimateOptions
    from app.estimation import estimate_take
    from app.takes import takes_of

    try:
        options = EstimateOptions.model_validate(
            {
                "height_m": height,
                "mass_kg": mass,
                "sex": sex.value,
                "method": method.value.replace("-", "_"),
                "hands": hands.value,
                "definition": definition.value,
                "bands": bands.value.replace("-", "_"),
                "tare_s": None if tare is None else _seconds(tare),
                "clock_offset_s": clock_offset,
                "assign": dict(_plate_and_side(one) for one in assign or []),
                "accept": accept or [],
            }
        )
    except ValidationError as error:
        faults = faults_of_validation(error.errors())
        raise InvalidRequest("What was given cannot be.", faults) from error
    takes = takes_of(files, marker_set, columns)
    if out is not None:
        _refuse_shared_folders(out, [take.motion.name for take in takes])
    answers: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as scratch, progress_bar(as_json) as bar:
        for number, take in enumerate(takes):
            task = bar.add_task(f"reading {take.motion.name}", total=None)

            def tell(what: str, done: int, total: int, task: Any = task) -> None:
                bar.update(task, description=what, completed=done, total=total or None)

            folder = Path(scratch) / str(number) if out is None else _folder(out, take.motion.name)
            try:
                summary = estimate_take(take, options, folder, tell)
            except Exception as error:
                problem = problem_of(error)
                if problem is None or len(takes) == 1:
                    raise
                # One bad recording must not cost the others theirs.
                answers.append({"source": take.motion.name, "problem": problem.body()})
                typer.echo(f"Error: {problem.text()}", err=True)
                continue
            finally:
                bar.remove_task(task)
                if folder.is_dir() and not any(folder.iterdir()):
                    folder.rmdir()
            if out is not None:
                _write(folder, summary)
            answers.append(summary)
            if not as_json:
                print_summary(summary)
    if as_json:
        print_json(answers if len(answers) > 1 else answers[0])
    if any("problem" in answer for answer in answers):
        raise typer.Exit(2)


def _seconds(text: str) -> tuple[float, float]:
    try:
        start, end = (float(part) for part in text.split(":"))
    except ValueError as error:
        raise InvalidRequest(
            f"--tare {text}: expected START:END in seconds, such as 0:2."
        ) from error
    return start, end


def _plate_and_side(text: str) -> tuple[str, str]:
    plate, equals, side = text.rpartition("=")
    if not equals or side not in ("right", "left"):
        raise InvalidRequest(f"--assign {text}: expected a plate and a side, such as 1=right.")
    return plate, side


def _refuse_shared_folders(out: Path, names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InvalidRequest(
                f"--out {out}: expected motions of different names, got {name} "
                f"{names.count(name)} times: each would write over the one before it."
            )


def _folder(out: Path, name: str) -> Path:
    folder = out / f"{name}.estimate"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise InvalidRequest(f"--out {out}: a file stands where a folder is wanted.") from error
    return folder


def _write(folder: Path, summary: dict[str, Any]) -> None:
    """Adds picture and summary to the time series, all as readable as the user's other files."""
    from app.estimates.picture import draw
    from app.estimation import BODY, SERIES

    names = {"series": SERIES, "body": BODY, "picture": "picture.png", "summary": "summary.json"}
    part = folder / f".part-{os.getpid()}.png"
    try:
        draw(folder / SERIES, summary, part)
        part.replace(folder / names["picture"])
    finally:
        part.unlink(missing_ok=True)
    summary["written"] = {key: str(folder / name) for key, name in names.items()}
    write_json(folder / names["summary"], summary)
    umask = os.umask(0)
    os.umask(umask)
    for name in names.values():
        (folder / name).chmod(0o666 & ~umask)


def print_summary(summary: dict[str, Any]) -> None:
    """Prints a summary for people."""
    page = console()
    page.print(facts(summary["source"], _in_short(summary)))
    if summary["holds"]:
        page.print(_holds(summary["holds"]))
    if summary["efforts"]:
        page.print(_efforts(summary["efforts"]))
    else:
        page.print("No joint's effort can be told from what was measured.")
    for kind, title in (("findings", "Found"), ("assumed", "Assumed, not measured")):
        if summary[kind]:
            page.print(f"{title}:")
            listed = Table.grid(padding=(0, 1))
            for text in summary[kind]:
                listed.add_row("  -", text)
            page.print(listed)
    written = summary.get("written")
    if written:
        page.print(f"Wrote {', '.join(written.values())}.")


_BANDS = {
    "noise": "of the sensors' noise alone",
    "noise_and_model": "of the sensors' noise and of errors of the body model",
    "tuning": "of the paper's preset: too narrow to be believed",
    "none": "none",
}


def _in_short(summary: dict[str, Any]) -> dict[str, Any]:
    person, fit, low_back = summary["person"], summary["fit"], summary["low_back"]
    lines: dict[str, Any] = {
        "motion": f"{summary['duration_s']:.1f} s, {summary['frames']} frames at "
        f"{summary['rate_hz']:g} Hz"
        + "".join(f"; {count} left out: {why}" for why, count in summary["left_out"].items()),
        "person": f"{person['height_m']:g} m, {person['mass_kg']:g} kg ({person['mass_from']})"
        + (
            f", {person['model_mass_kg']:g} kg after the tare"
            if abs(person["model_mass_kg"] - person["mass_kg"]) > 0.005
            else ""
        ),
    }
    if "marker_rms_m" in fit:
        worst = ", ".join(f"{k} {1e3 * v:.0f}" for k, v in fit["worst_markers_rms_m"].items())
        lines["markers"] = f"{1e3 * fit['marker_rms_m']:.0f} mm off (rms); worst, mm: {worst}"
    lines["bands"] = f"5 to 95 %, {_BANDS[summary['bands']]}"
    lines |= _feet_in_short(summary)
    lines["hands"] = _hands_in_short(summary)
    minus = summary["payload"]["plates_minus_model_kg"]
    if minus is not None:
        lines["plates less body"] = f"{minus['p50']:+.2f} kg ({_span(minus)} over time)"
    if low_back is not None:
        lines["L5S1, most"] = (
            f"{_with_sd(low_back, 'force', 'n')} N at {low_back['peak_force_at_s']:.2f} s, "
            f"{_with_sd(low_back, 'moment', 'nm')} N m at {low_back['peak_moment_at_s']:.2f} s"
        )
    return lines


def _hands_in_short(summary: dict[str, Any]) -> str:
    """Says what the hands were taken to do, and why there may be no payload."""
    payload = summary["payload"]
    if not payload["free_hands"]:
        why = "" if summary["feet"] else ", as nothing measured the feet"
        return f"taken to be EMPTY{why}: what they bear is missing in every figure"
    if payload["known_share"] == 0.0:
        return f"{_which(payload['free_hands'])} may bear; no payload can be told, see below why"
    told = f"{_which(payload['free_hands'])} may bear; payload told in {payload['known_share']:.0%}"
    return told if summary["holds"] else f"{told} of the frames, nowhere long enough for a hold"


def _feet_in_short(summary: dict[str, Any]) -> dict[str, Any]:
    feet = summary["feet"]
    share = summary["balance"]["share"]
    lines: dict[str, Any] = {
        "balance": ", ".join(
            f"{words} {share[key]:.0%}"
            for key, words in (
                ("known", "known"), ("split_unknown", "of both feet together"),
                ("unknown", "not known"),
            )
            if key in share
        )
    }  # fmt: skip
    if feet is None:
        return lines
    seen: dict[str, list[str]] = {}
    for one in feet["stances"]:
        seen.setdefault(f"plate {one['plate']} {one['foot']}", []).append(
            f"{one['start_s']:.1f}-{one['end_s']:.1f}"
        )
    lines["feet"] = [
        f"{who}: {', '.join(when[:6])}{' …' if len(when) > 6 else ''} s"
        for who, when in seen.items()
    ]
    clock = feet["clock"]
    if clock is not None:
        lines["clocks"] = clock["from"]
        if clock["from"] == "given":
            lines["clocks"] = f"{1e3 * clock['offset_s']:.0f} ms added to the plates' (given)"
    return lines


def _with_sd(low_back: dict[str, Any], what: str, unit: str) -> str:
    sd = low_back[f"peak_{what}_sd_{unit}"]
    return f"{low_back[f'peak_{what}_{unit}']:.0f}" + ("" if sd is None else f" ± {sd:.0f}")


def _span(band: dict[str, Any]) -> str:
    return "–" if band["p05"] is None else f"{band['p05']:.2f} to {band['p95']:.2f}"


def _holds(holds: list[dict[str, Any]]) -> Table:
    table = Table(title="Payload by hold", title_justify="left", box=None)
    for title in ("from [s]", "to [s]", "hands", "kg", "5 to 95 %", "vertical", "norm", "each"):
        table.add_column(title, justify="right", no_wrap=True)
    for hold in holds:
        by = hold["by_definition_kg"]
        split = hold["split_kg"]
        table.add_row(
            f"{hold['start_s']:.2f}", f"{hold['end_s']:.2f}",
            hold["state"] if hold["state"] == "free" else _which(hold["hands"]),
            f"{hold['mass_kg']['p50']:.2f}", _span(hold["mass_kg"]),
            *(f"{by[name]['p50']:.2f}" if name in by else "–" for name in ("vertical", "norm")),
            "sum only" if split is None and len(hold["hands"]) > 1 else show(split),
        )  # fmt: skip
    return table


def _which(hands: list[str]) -> str:
    return "both" if len(hands) == 2 else "".join(hands)


def _efforts(efforts: list[dict[str, Any]], most: int = 8) -> Table:
    table = Table(title="Joint effort [N m]", title_justify="left", box=None)
    table.add_column("joint", no_wrap=True)
    for title in ("most", "5 to 95 %", "at [s]", "median", "known"):
        table.add_column(title, justify="right")
    for one in efforts[:most]:
        peak = one["peak_nm"]
        table.add_row(
            one["joint"], f"{peak['p50']:.1f}", _span(peak), f"{one['at_s']:.2f}",
            f"{one['median_nm']:.1f}", f"{one['known_share']:.0%}",
        )  # fmt: skip
    return table


def register(cli: typer.Typer) -> None:
    """Adds the command."""
    cli.command()(estimate)
