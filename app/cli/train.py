"""``ergocast train FILE... --height --mass --out MODEL``."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from app.cli.output import (
    ColumnsFile,
    Json,
    MarkerSetFile,
    console,
    print_json,
    progress_bar,
    show,
)
from app.plain import plain
from app.problems import InvalidRequest

if TYPE_CHECKING:
    from app.training import Trained


class Method(StrEnum):
    """Methods that can be asked for."""

    AUTO = "auto"
    MI_NSGP = "mi-nsgp"
    NSGP = "nsgp"
    W_IK = "w-ik"
    COV_IK = "cov-ik"
    LOCOV_IK = "locov-ik"
    CC_GP = "cc-gp"
    GP = "gp"
    SB_M = "sb-m"
    PROMP = "promp"


class Optimizer(StrEnum):
    """Searches of the weights."""

    BIPOP = "bipop"
    GRADIENT = "gradient"


class Engine(StrEnum):
    """Implementations of the marginal likelihood."""

    FAST = "fast"
    GPYTORCH = "gpytorch"


class Kernel(StrEnum):
    """Kernels of the null-space process."""

    SEPARATE = "separate"
    PAPER = "paper"


class Criterion(StrEnum):
    """What the weights and the kernel are searched by."""

    HELD_OUT = "held-out"
    MARGINAL = "marginal"


class Weights(StrEnum):
    """Forms of the weight matrix."""

    AUTO = "auto"
    CORRELATED = "correlated"
    DIAGONAL = "diagonal"


class Hand(StrEnum):
    """The led hand."""

    RIGHT = "right"
    LEFT = "left"


class Sex(StrEnum):
    """Which anthropometric table."""

    FEMALE = "female"
    MALE = "male"
    UNKNOWN = "unknown"


Height = Annotated[float, typer.Option("--height", help="Stature, m.")]
Mass = Annotated[float, typer.Option("--mass", help="Body mass, kg.")]


def train(
    files: Annotated[
        list[str],
        typer.Argument(help="Recordings of one person: MVNX, BVH, or markers with static:FILE."),
    ],
    height: Height,
    mass: Mass,
    out: Annotated[Path, typer.Option(help="The model file to write.")],
    sex: Annotated[Sex, typer.Option(help="For the mass distribution.")] = Sex.UNKNOWN,
    hand: Annotated[Hand, typer.Option(help="The hand that will be led.")] = Hand.RIGHT,
    method: Annotated[
        Method, typer.Option(help="auto takes what errs less on held-out motion.")
    ] = Method.AUTO,
    optimizer: Annotated[Optimizer, typer.Option(help="Search of the weights.")] = Optimizer.BIPOP,
    engine: Annotated[Engine, typer.Option(help="gpytorch is the slow reference.")] = Engine.FAST,
    kernel: Annotated[Kernel, typer.Option(help="paper: one length-scale for all.")] = (
        Kernel.SEPARATE
    ),
    criterion: Annotated[
        Criterion | None,
        typer.Option(
            help="held-out unless given, for motion whose samples repeat their neighbours; the "
            "paper's is marginal (likelihood), the one gpytorch knows."
        ),
    ] = None,
    weights: Annotated[
        Weights, typer.Option(help="diagonal as in the paper; auto takes what scores better.")
    ] = Weights.AUTO,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all randomness.")] = 0,
    accept: Annotated[
        list[str] | None, typer.Option(help="Go on in spite of this finding (may be repeated).")
    ] = None,
    marker_set: MarkerSetFile = None,
    columns: ColumnsFile = None,
    as_json: Json = False,
) -> None:
    """Trains an operator's posture model; prints how it does on motion it has not seen."""
    from app.takes import takes_of
    from app.training import motions_of
    from app.training import train as train_model
    from human import Subject
    from prediction import TrainingOptions, save_model

    if not out.parent.is_dir():
        raise InvalidRequest(f"--out {out}: the folder {out.parent} does not exist.")
    takes = takes_of(files, marker_set, columns)
    for take in takes:
        if take.grf is not None:
            raise InvalidRequest(f"grf:{take.grf.name}: training takes motion alone; leave it out.")
    subject = Subject(height, mass, sex.value)
    options = TrainingOptions(
        method=method.value,
        kernel=kernel.value,
        optimizer=optimizer.value,
        engine=engine.value,
        criterion=None if criterion is None else criterion.value,
        weights=weights.value,
    )
    with progress_bar(as_json) as bar:
        task = bar.add_task("reading", total=1.0)
        model, motions, notes = motions_of(takes, subject, accept or [])
        trained = train_model(
            model,
            motions,
            hand.value,
            seed=seed,
            options=options,
            progress=lambda what, done: bar.update(task, description=what, completed=done),
            notes=notes,
        )
    save_model(out, trained.operator)
    if as_json:
        print_json(
            {
                "model": str(out),
                "method": trained.operator.method,
                "chosen_by": trained.chosen_by,
                "notes": list(trained.notes),
                "metrics": plain(trained.operator.metrics),
            }
        )
    else:
        _print(trained, out)


def _print(trained: "Trained", out: Path) -> None:
    table = Table(
        title="On the last 30 %, trained on the first 70 %", title_justify="left", box=None
    )
    columns = {
        "log-lik. [nats]": "log_likelihood",
        "RMSE [rad/s]": "rmse_rad_s",
        "cover 90 %": "coverage90_one_step",
        "roll-out RMSE [deg]": "rollout_rmse_deg",
        "hand error [m]": "rollout_hand_mean_m",
        "roll-out cover 90 %": "coverage90_rollout",
    }
    table.add_column("method", no_wrap=True)
    for title in columns:
        table.add_column(title, justify="right")
    for score in trained.scores:
        values = score.to_dict()
        table.add_row(score.method, *(show(values[key]) for key in columns.values()))
    page = console()
    page.print(table)
    noise = trained.operator.metrics["sigma_x"]
    page.print(
        f"Log-likelihood of joint rates, for a hand velocity noise of {noise['linear_m_s']:g} m/s "
        f"and {noise['angular_rad_s']:g} rad/s; RMSE one step ahead; roll-outs of 2 s at most."
    )
    for note in trained.notes:
        page.print(f"Note: {note}")
    page.print(f"Wrote {out}: uses {trained.operator.method} ({trained.chosen_by}).")


def register(cli: typer.Typer) -> None:
    """Adds the command."""
    cli.command()(train)
