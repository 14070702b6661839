"""``ergocast train FILE... --height --mass --out MODEL``."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from app.cli.output import (
    ColumnsFile,
    Json,
    MarkerSetFile,
    console,
    print_json,
    progress_bar,
)
from app.problems import Conflict, InvalidRequest


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
    LEAVE_ONE_TRAJECTORY_OUT = "leave-one-trajectory-out"
    IN_SAMPLE = "in-sample"


class Weights(StrEnum):
    """Forms of the weight matrix."""

    AUTO = "auto"
    CORRELATED = "correlated"
    DIAGONAL = "diagonal"


class Hand(StrEnum):
    """The led hand."""

    RIGHT = "right"
    LEFT = "left"
    BOTH = "both"


class Base(StrEnum):
    """What of the body stays where it is."""

    PELVIS = "pelvis"
    FEET = "feet"


class Sex(StrEnum):
    """Which anthropometric table."""

    FEMALE = "female"
    MALE = "male"
    UNKNOWN = "unknown"


Height = Annotated[float, typer.Option("--height", help="Stature, m.")]
Mass = Annotated[float, typer.Option("--mass", help="Body mass, kg.")]


def train(
    out: Annotated[Path, typer.Option(help="The model file to write.")],
    files: Annotated[
        list[str] | None,
        typer.Argument(
            help="Recordings of one person: MVNX, BVH, or markers with static:FILE. Without any, "
            "the model is of how people in general move."
        ),
    ] = None,
    height: Annotated[
        float | None, typer.Option(help="Stature, m; the model's with --add-to.")
    ] = None,
    mass: Annotated[
        float | None, typer.Option(help="Body mass, kg; the model's with --add-to.")
    ] = None,
    sex: Annotated[
        Sex | None, typer.Option(help="For the mass distribution; unknown unless given.")
    ] = None,
    hand: Annotated[
        Hand | None,
        typer.Option(help="The hand that will be led, or both on one object; right unless given."),
    ] = None,
    base: Annotated[
        Base | None,
        typer.Option(help="What stays where it is; pelvis unless given. feet: legs move, too."),
    ] = None,
    method: Annotated[
        Method | None,
        typer.Option(help="auto unless given: it takes what errs less on held-out motion."),
    ] = None,
    optimizer: Annotated[
        Optimizer | None,
        typer.Option(help="Search of the weights; gradient unless given, bipop is the paper's."),
    ] = None,
    engine: Annotated[
        Engine | None, typer.Option(help="fast unless given; gpytorch is the slow reference.")
    ] = None,
    kernel: Annotated[
        Kernel | None,
        typer.Option(help="separate unless given; paper: one length-scale for all."),
    ] = None,
    criterion: Annotated[
        Criterion | None,
        typer.Option(
            help="held-out unless given, for motion whose samples repeat their neighbours; "
            "marginal (likelihood) is the one gpytorch knows; in-sample is the paper's, which "
            "does not identify the weights."
        ),
    ] = None,
    weights: Annotated[
        Weights | None,
        typer.Option(help="diagonal as in the paper; auto, unless given: what scores better."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of all randomness; 0 unless given.")
    ] = None,
    add_to: Annotated[
        Path | None,
        typer.Option(
            help="A model of the same person: train on what it was trained on and FILEs. Options "
            "not given are the model's."
        ),
    ] = None,
    restart: Annotated[
        bool, typer.Option("--restart", help="Throw away a training to OUT that was broken off.")
    ] = False,
    accept: Annotated[
        list[str] | None, typer.Option(help="Go on in spite of this finding (may be repeated).")
    ] = None,
    marker_set: MarkerSetFile = None,
    columns: ColumnsFile = None,
    as_json: Json = False,
) -> None:
    """Trains an operator's posture model; prints how it does on motion it has not seen.

    Options not given with --add-to are the model's; else they are the defaults.
    A training that was broken off (Ctrl-C, a crash) goes on where it was when the same command is
    given again, and gives the same model. The model file holds the motion it was trained on.
    """
    from app.cli.model_page import joints_in_words, print_report
    from app.models.description import described
    from app.models.operator import is_model_file, open_operator
    from app.takes import takes_of
    from app.training_job import training_job
    from app.unfinished import Unfinished
    from prediction import PredictionError, save_model

    if not out.parent.is_dir():
        raise InvalidRequest(f"--out {out}: the folder {out.parent} does not exist.")
    if out.is_dir():
        raise InvalidRequest(f"--out {out}: expected the name of a file, this is a folder.")
    if out.exists() and not is_model_file(out):
        raise InvalidRequest(
            f"--out {out}: this file is there and is no operator model; it is not overwritten."
        )
    asked = {
        "method": method,
        "kernel": kernel,
        "optimizer": optimizer,
        "engine": engine,
        "criterion": criterion,
        "weights": weights,
    }
    job = training_job(
        takes_of(files, marker_set, columns) if files else [],
        height_m=height,
        mass_kg=mass,
        sex=None if sex is None else sex.value,
        hand=None if hand is None else hand.value,
        base=None if base is None else base.value,
        seed=seed,
        accept=accept or [],
        options={name: None if one is None else one.value for name, one in asked.items()},
        add_to=None if add_to is None else open_operator(add_to),
    )
    folder = out.with_name(out.name + ".unfinished")
    if restart:
        Unfinished.discard(folder)
    try:
        unfinished = Unfinished(folder, job.about())
    except Conflict as error:
        raise Conflict(
            f"{error.detail} Give the command it was begun with to go on with it, or add "
            "--restart to throw it away."
        ) from error
    if len(unfinished) and not as_json:
        typer.echo(
            f"Going on with what was broken off: {unfinished.finished} fits are done.", err=True
        )
    try:
        with progress_bar(as_json) as bar:
            task = bar.add_task("", total=1.0)

            def tell(what: str, done: float, nats: float | None) -> None:
                reached = "" if nats is None else f", {nats:.2f} nats a sample"
                bar.update(task, description=what + reached, completed=done)

            trained = job.run(unfinished, tell)
        save_model(out, trained.operator)
    except KeyboardInterrupt:
        if len(unfinished):
            typer.echo(
                f"{unfinished.finished} fits are done and kept in {folder}: the same command goes "
                "on from there, --restart begins anew.",
                err=True,
            )
        raise
    except PredictionError:
        # The same command would fail again at the same place: nothing of the person stays behind.
        unfinished.remove()
        raise
    unfinished.remove()
    model = described(trained.operator)
    if as_json:
        print_json({"model": str(out), "notes": list(trained.notes), **model})
        return
    page = console()
    print_report(page, model)
    page.print(f"Joints: {joints_in_words(model['joints'])}.")
    for note in dict.fromkeys(trained.notes):
        page.print(f"Note: {note}")
    page.print(f"Wrote {out}: uses {trained.operator.method} ({trained.chosen_by}).")
    if model["takes"]:
        page.print("It holds the motion it was trained on: personal data.")


def register(cli: typer.Typer) -> None:
    """Adds the command."""
    cli.command()(train)
