"""``ergocast benchmark prediction FOLDER``: the methods on a person's own recordings."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from app.cli.output import Json, console, print_json, progress_bar, show
from app.cli.train import Hand, Height, Mass, Method, Optimizer, Sex
from app.plain import plain
from app.problems import InvalidRequest

if TYPE_CHECKING:
    from app.method_comparison import Comparison
    from prediction import PairedRow

_DESIGNS = {
    "part": "Each quarter of the recordings held out in turn",
    "recording": "Each recording held out in turn",
}


def prediction(
    folder: Annotated[Path, typer.Argument(help="Recordings of one person, MVNX, BVH, C3D, TRC.")],
    height: Height,
    mass: Mass,
    sex: Annotated[Sex, typer.Option(help="For the mass distribution.")] = Sex.UNKNOWN,
    hand: Annotated[Hand, typer.Option(help="The hand that is led.")] = Hand.RIGHT,
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
        Path | None, typer.Option(help="Folder for scores.json and a picture of the errors.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Compares every prediction method on held-out parts of a person's own recordings."""
    from app.method_comparison import METHODS, compare_folder
    from human import Subject
    from prediction import TrainingOptions

    if out is not None and not out.parent.is_dir():
        raise InvalidRequest(f"--out {out}: the folder {out.parent} does not exist.")
    with progress_bar(as_json) as bar:
        task = bar.add_task("reading", total=1.0)
        found = compare_folder(
            folder,
            Subject(height, mass, sex.value),
            hand.value,
            methods=[one.value for one in method] if method else METHODS,
            seed=seed,
            options=TrainingOptions(optimizer=optimizer.value),
            accept=accept or [],
            progress=lambda what, done: bar.update(task, description=what, completed=done),
        )
    written = [] if out is None else _write(found, out)
    if as_json:
        print_json({**plain(found.to_dict()), "written": [str(path) for path in written]})
        return
    page = console()
    for design, rows in found.tables.items():
        page.print(_errors(design, rows))
        page.print(_against_cov_ik(rows))
    for result in found.results:
        if result.problem:
            page.print(f"{result.split[1]} was left out: {result.problem}")
    page.print(
        f"{len(found.files)} recording(s). Root mean square joint error of roll-outs from measured "
        "starts, geometric mean over splits. One person's recordings say nothing of other people."
    )
    for note in dict.fromkeys(found.notes):
        page.print(f"Note: {note}")
    for path in written:
        page.print(f"Wrote {path}.")


def _errors(design: str, rows: "list[PairedRow]") -> Table:
    table = Table(title=f"{_DESIGNS[design]}: joint error [deg]", title_justify="left", box=None)
    horizons = list(rows[0].rollout_rmse_deg)
    table.add_column("method", no_wrap=True)
    for title in (*(f"{seconds} s" for seconds in horizons), "nats", "cover 90 %", "width"):
        table.add_column(title, justify="right")
    for row in rows:
        cells = [f"{row.rollout_rmse_deg[seconds]:.2f}" for seconds in horizons]
        ends = ("–" if row.coverage90 is None else f"{row.coverage90:.2f}", show(row.width_deg))
        table.add_row(row.method, *cells, f"{row.nats:.1f}", *ends)
    return table


def _against_cov_ik(rows: "list[PairedRow]") -> Table:
    table = Table(
        title="Over cov-ik's, and in how many splits better", title_justify="left", box=None
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
            cells.append(f"x{row.rollout_ratio[seconds]:.2f} ({wins}/{count})")
        more = f"{row.nats_more:+.1f} ({row.nats_wins}/{row.splits})"
        table.add_row(row.method, *cells, f"x{row.rmse_ratio:.2f}", more)
    return table


def _write(found: "Comparison", out: Path) -> list[Path]:
    from app.files import write_json

    out.mkdir(exist_ok=True)
    scores, picture = out / "scores.json", out / "errors.png"
    write_json(scores, plain(found.to_dict()))
    _draw(found, picture)
    return [scores, picture]


def _draw(found: "Comparison", path: Path) -> None:
    """Draws joint error against horizon, and coverage, a column for each design."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.5 * len(found.tables), 8.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, len(found.tables), squeeze=False)
    for column, (design, rows) in enumerate(found.tables.items()):
        upper, lower = axes[0, column], axes[1, column]
        for row in rows:
            seconds = [float(key) for key in row.rollout_rmse_deg]
            upper.plot(seconds, list(row.rollout_rmse_deg.values()), marker="o", label=row.method)
        upper.set_title(_DESIGNS[design], fontsize=10)
        upper.set_xlabel("horizon [s]")
        upper.set_ylabel("joint error, RMS [deg]")
        upper.grid(alpha=0.3)
        upper.legend(fontsize=8)
        names = [row.method for row in rows if row.coverage90 is not None]
        lower.barh(names, [row.coverage90 for row in rows if row.coverage90 is not None])
        lower.axvline(0.9, color="k", lw=1, ls="--")
        lower.set_xlim(0.0, 1.0)
        lower.invert_yaxis()
        lower.set_xlabel("share of postures in the 90 % band")
    figure.savefig(path, dpi=110)


def register(cli: typer.Typer) -> None:
    """Adds the command and those under it."""
    group = typer.Typer(help="Compares methods on recordings of your own.", no_args_is_help=True)
    group.command()(prediction)
    cli.add_typer(group, name="benchmark")
