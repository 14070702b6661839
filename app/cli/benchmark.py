"""``ergocast benchmark prediction FOLDER``: the methods on a person's own recordings."""

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from app.cli.output import Json, console, print_json, progress_bar, show
from app.cli.train import Base, Hand, Height, Mass, Method, Optimizer, Sex
from app.plain import plain
from app.problems import InvalidRequest

if TYPE_CHECKING:
    from app.method_comparison import Comparison
    from prediction import PairedRow

_DESIGNS = {
    "part": "Each quarter of the recordings held out in turn",
    "recording": "Each recording held out in turn",
    "same": "Same primitive (EXP1): a quarter of its takes held out, trained on its others",
    "other": "Other motion (EXP2): a primitive held out, trained on all others",
}


def prediction(
    folder: Annotated[
        Path,
        typer.Argument(
            help="Recordings of one person (MVNX, BVH, C3D, TRC). Where they lie in sub-folders, "
            "each sub-folder is a primitive: takes of the same motion."
        ),
    ],
    height: Height,
    mass: Mass,
    sex: Annotated[Sex, typer.Option(help="For the mass distribution.")] = Sex.UNKNOWN,
    hand: Annotated[Hand, typer.Option(help="The hand that is led, or both.")] = Hand.RIGHT,
    base: Annotated[Base, typer.Option(help="What of the body stays in place.")] = Base.PELVIS,
    method: Annotated[
        list[Method] | None,
        typer.Option(help="Compare this one (may be repeated); all unless given."),
    ] = None,
    optimizer: Annotated[
        Optimizer, typer.Option(help="Search of the weights; the gradient is quicker.")
    ] = Optimizer.GRADIENT,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all randomness.")] = 0,
    accept: Annotated[
        list[str] | None, typer.Option(help="Go on in spite of this finding (may be repeated).")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the table, every split's scores and the picture."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Compares every prediction method on held-out parts of a person's own recordings.

    A recording that cannot be read or used is named and left out. Recordings of different people
    are refused.
    """
    from app.method_comparison import compare_folder
    from human import Subject
    from prediction import TrainingOptions

    if out is not None and not out.parent.is_dir():
        raise InvalidRequest(f"--out {out}: the folder {out.parent} does not exist.")
    if out is not None and out.exists() and not out.is_dir():
        raise InvalidRequest(f"--out {out}: expected a folder, this is a file.")
    with progress_bar(as_json) as bar:
        task = bar.add_task("reading", total=1.0)

        def tell(what: str, done: float, likelihood: float | None) -> None:
            shown = what if likelihood is None else f"{what} ({likelihood:.1f} nats)"
            bar.update(task, description=shown, completed=done)

        found = compare_folder(
            folder,
            Subject(height, mass, sex.value),
            hand.value,
            methods=[one.value for one in method] if method else None,
            seed=seed,
            options=TrainingOptions(optimizer=optimizer.value),
            accept=accept or [],
            base=base.value,
            progress=tell,
        )
    written = [] if out is None else _write(found, out)
    if as_json:
        print_json({**plain(found.to_dict()), "written": [str(path) for path in written]})
        return
    page = console()
    for design, rows in found.tables.items():
        page.print(_errors(design, rows))
        page.print(_against_cov_ik(rows))
    problems: dict[str, list[str]] = {}
    for result in found.results:
        if result.problem:
            problems.setdefault(result.problem, []).append(result.split[1])
    for problem, splits in problems.items():
        page.print(f"Left out, {'; '.join(splits)}: {problem}")
    for one in found.left_out:
        page.print(f"{one.name} was left out: {one.reason}")
    for primitive, files in found.files.items():
        page.print(f"{primitive}: {', '.join(files)}")
    page.print(
        "Joint error: root mean square of roll-outs from measured starts, geometric mean over "
        "splits. The interval is that of more such splits, which share most of their training: "
        "recordings of one person say nothing of other people."
    )
    for note in found.notes:
        page.print(f"Note: {note}")
    for path in written:
        page.print(f"Wrote {path}.")


def _errors(design: str, rows: "list[PairedRow]") -> Table:
    title = f"{_DESIGNS[design]} ({rows[0].splits} splits): joint error [deg]"
    table = Table(title=title, title_justify="left", box=None)
    horizons = list(rows[0].rollout_rmse_deg)
    table.add_column("method", no_wrap=True)
    ends = ("nats", "cover 90 %", "width", "hand mm")
    for title in (*(f"{seconds} s" for seconds in horizons), *ends):
        table.add_column(title, justify="right")
    for row in rows:
        cells = [f"{row.rollout_rmse_deg[seconds]:.2f}" for seconds in horizons]
        cover = "–" if row.coverage90 is None else f"{row.coverage90:.2f}"
        hand = "–" if row.hand_m is None else f"{1e3 * row.hand_m:.3f}"
        table.add_row(row.method, *cells, f"{row.nats:.1f}", cover, show(row.width_deg), hand)
    return table


def _against_cov_ik(rows: "list[PairedRow]") -> Table:
    table = Table(
        title="Over cov-ik's, in how many splits better, and 95 % of the mean",
        title_justify="left",
        box=None,
    )
    horizons = list(rows[0].rollout_rmse_deg)
    table.add_column("method", no_wrap=True)
    for title in (*(f"{seconds} s" for seconds in horizons), "one step", "nats more"):
        table.add_column(title, justify="right")
    for row in rows:
        if row.method == "cov-ik":
            continue
        cells = []
        for seconds in horizons:
            wins, count = row.rollout_wins[seconds]
            interval = row.rollout_interval[seconds]
            cells.append(_ratio(row.rollout_ratio[seconds], interval, wins, count))
        one_step = _ratio(row.rmse_ratio, row.rmse_interval, row.rmse_wins, row.splits)
        more = f"{row.nats_more:+.1f} {row.nats_wins}/{row.splits}"
        table.add_row(row.method, *cells, one_step, more)
    return table


def _ratio(ratio: float, interval: tuple[float, float] | None, wins: int, count: int) -> str:
    between = "" if interval is None else f"\n{interval[0]:.2f}–{interval[1]:.2f}"
    return f"x{ratio:.2f} {wins}/{count}{between}"


def _write(found: "Comparison", out: Path) -> list[Path]:
    from app.files import write_bytes, write_json
    from app.method_figure import draw

    out.mkdir(exist_ok=True)
    scores, table, picture = out / "scores.json", out / "splits.csv", out / "errors.png"
    write_json(scores, plain(found.to_dict()))
    write_bytes(table, _csv(found).encode())
    draw(found.tables, _DESIGNS, {"": found.results}, picture)
    return [scores, table, picture]


def _csv(found: "Comparison") -> str:
    """Returns a row for each split and method, SI units and degrees as the columns say."""
    from prediction import HORIZONS_S

    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    horizons = [f"{seconds:g}" for seconds in HORIZONS_S]
    plainly = ("log_likelihood", "rmse_rad_s", "coverage90_one_step")
    closed = ("coverage90_rollout", "band_width_deg", "rollout_hand_mean_m")
    errors = [f"joint_error_{seconds}s_deg" for seconds in horizons]
    writer.writerow(["design", "held_out", "method", *plainly, *errors, *closed])
    for result in found.results:
        for score in result.scores.values():
            values = score.to_dict()
            at = [score.rollout_rmse_deg_at.get(seconds, "") for seconds in horizons]
            ends = ["" if values[name] is None else values[name] for name in closed]
            row = [*result.split, score.method, *(values[name] for name in plainly), *at, *ends]
            writer.writerow(row)
    return stream.getvalue()


def register(cli: typer.Typer) -> None:
    """Adds the command and those under it."""
    group = typer.Typer(help="Compares methods on recordings of your own.", no_args_is_help=True)
    group.command()(prediction)
    cli.add_typer(group, name="benchmark")
