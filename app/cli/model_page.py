"""An operator model on a page: what it holds, and how it does on motion it has not seen."""

from collections.abc import Iterable, Mapping
from typing import Any

from rich.console import Console
from rich.table import Table

from app.cli.output import facts, show

#: Column titles and the fields of a score they show.
_ONE_STEP = {
    "log-lik. [nats]": "log_likelihood",
    "RMSE [rad/s]": "rmse_rad_s",
    "cover": "coverage90_one_step",
}
#: The same where the joint velocity of the step before is told.
_TOLD = {"told, log-lik.": "log_likelihood", "told, RMSE": "rmse_rad_s"}
_ROLLOUT = {"cover": "coverage90_rollout", "width": "band_width_deg"}
_NAMES_SHOWN = 6


def print_model(page: Console, title: str, model: Mapping[str, Any]) -> None:
    """Prints a model as `described` gives it."""
    page.print(
        facts(
            title,
            {
                "format": "operator model",
                "person": _person(model["subject"]),
                "led": f"{model['hand']} hand{'s' if model['hand'] == 'both' else ''}",
                "stays": model["base"],
                "method": f"{model['method']} ({model['chosen_by']})",
                "methods held": ", ".join(model["methods"]),
                "tasks": ", ".join(model["tasks"]),
                "demonstrations": f"{model['samples']} samples, {model['duration_s']:.1f} s",
                "takes": [
                    f"{take['name']}: {take['samples']} samples, {take['duration_s']:.1f} s"
                    for take in model["takes"]
                ],
                "joints": joints_in_words(model["joints"]),
                "familiarity": f"{model['familiarity']['centres']} postures",
                "findings": model["findings"],
                "seed": model["seed"],
            },
        )
    )
    print_report(page, model)
    _print_weights(page, model["weights"])
    if model["takes"]:
        page.print("The file holds personal data: the motion it was trained on.")


def _person(subject: Mapping[str, Any]) -> str:
    sex = "sex unknown" if subject["sex"] in (None, "unknown") else subject["sex"]
    return f"{subject['height_m']:g} m, {subject['mass_kg']:g} kg, {sex}"


def _print_weights(page: Console, costs: Mapping[str, Any]) -> None:
    """Prints the joint costs of the chosen method, and how well its weights are known."""
    table = Table(
        title=f"\nWeights W of {costs['method']}, and the joint costs they are for IK",
        title_justify="left",
        box=None,
    )
    for title in ("joint", "cost", "weight", "90 % interval"):
        table.add_column(title, justify="left" if title == "joint" else "right")
    for joint, cost in costs["cost"].items():
        weight = costs["weights"][joint]
        ends = [weight.get("low"), weight.get("high")]
        interval = "–" if None in ends else " to ".join(f"{end:.3g}" for end in ends)
        if weight.get("identified") is False:
            interval += ", not identified"
        table.add_row(joint, f"{cost:.3g}", f"{weight['weight']:.3g}", interval)
    page.print(table)
    for note in costs["notes"]:
        page.print(f"Note: {note}.")


def joints_in_words(joints: Mapping[str, Any]) -> str:
    """Returns which joints are learned and what the others do."""
    learned, locked, following = joints["learned"], joints["locked"], joints["following"]
    every = len(learned) + len(locked) + len(following)
    words = f"{len(learned)} with a law of their own, of {every}"
    if locked:
        words += f"; still in all demonstrations, kept as at the start: {_some(locked)}"
    if following:
        words += f"; moving as a mix of learned ones, and following them: {_some(list(following))}"
    return words


def print_report(page: Console, model: Mapping[str, Any]) -> None:
    """Prints the held-out figures of every method, the chosen one first."""
    metrics = model["metrics"]
    scores = sorted(metrics.get("scores", []), key=lambda one: one["method"] != model["method"])
    if not scores:
        page.print("No figures on held-out motion.")
        return
    horizons = list(dict.fromkeys(at for one in scores for at in one["rollout_rmse_deg_at"]))
    page.print(f"\nHeld out: {metrics['split']}. * is used.")
    table = Table(title="One step ahead", title_justify="left", box=None)
    _columns(table, [*_ONE_STEP, *_TOLD])
    for one in scores:
        told = one.get("with_previous") or {}
        table.add_row(
            _label(one, model),
            *(show(one[key]) for key in _ONE_STEP.values()),
            *(show(told.get(key)) for key in _TOLD.values()),
        )
    page.print(table)
    page.print("told: where the joint velocity of the step before was measured, too.")
    table = Table(
        title="Closed loop, joint RMSE [deg] by time since the start",
        title_justify="left",
        box=None,
    )
    _columns(table, [*(f"{at} s" for at in horizons), "all", *_ROLLOUT, "hand [mm]"])
    for one in scores:
        table.add_row(
            _label(one, model),
            *(show(one["rollout_rmse_deg_at"].get(at)) for at in horizons),
            show(one["rollout_rmse_deg"]),
            *(show(one[key]) for key in _ROLLOUT.values()),
            _millimetres(one["rollout_hand_mean_m"]),
        )
    page.print(table)
    noise = metrics["sigma_x"]
    page.print(
        f"Log-likelihood of joint rates, for a hand velocity noise of {noise['linear_m_s']:g} m/s "
        f"and {noise['angular_rad_s']:g} rad/s. Cover: share in the 90 % band; width: of that "
        "band, deg. Roll-outs start from measured postures; hand: mean distance from its path."
    )


def _columns(table: Table, titles: Iterable[str]) -> None:
    table.add_column("method", no_wrap=True)
    for title in titles:
        table.add_column(title, justify="right")


def _millimetres(metres: float | None) -> str:
    return show(None if metres is None else f"{1e3 * metres:.2g}")


def _label(score: Mapping[str, Any], model: Mapping[str, Any]) -> str:
    return f"{score['method']} *" if score["method"] == model["method"] else str(score["method"])


def _some(names: list[str]) -> str:
    more = f" and {len(names) - _NAMES_SHOWN} more" if len(names) > _NAMES_SHOWN else ""
    return ", ".join(names[:_NAMES_SHOWN]) + more
