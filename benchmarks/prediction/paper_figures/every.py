"""All pictures, one PNG each, and what can be said of them in a number."""

from collections.abc import Iterator
from pathlib import Path

from matplotlib.figure import Figure as Picture

from benchmarks.figure import Figure
from benchmarks.prediction import planar
from benchmarks.prediction.paper_figures import box_plots, horizon, score_distributions, spread
from benchmarks.prediction.paper_figures.led_person import led_person
from human.simulate import OPERATOR_KINDS

OUT = Path("build/prediction")
#: Samples of a roll-out; the paper drew ten.
SAMPLES = 100
#: Seed of the people drawn; methods are developed on others.
SEED = 50


def figures(full: bool = False, out: Path = OUT, dpi: int = 110) -> Iterator[Figure]:
    """Draws everything and yields what can be said in a number.

    Args:
        full: Ten planar operators and a person of every kind instead of three and two.
        out: Folder for the PNGs.
        dpi: Of the PNGs.
    """
    out.mkdir(parents=True, exist_ok=True)

    def save(name: str, picture: Picture) -> None:
        path = out / f"prediction_{name}.png"
        picture.savefig(path, dpi=dpi)
        print(f"    {path}")

    people = [(kind, SEED) for kind in OPERATOR_KINDS[: None if full else 2]]
    who = led_person(*people[0], SAMPLES)
    ways = score_distributions.scored_ways(who)
    save("scores", score_distributions.picture(ways))
    yield from score_distributions.figures(ways)
    save("spread", spread.picture(who))
    yield from spread.figures(who)
    found = {design: horizon.errors(design, people) for design in horizon.DESIGNS}
    for design, each in found.items():
        print(horizon.table(design, each))
        yield from horizon.figures(design, each)
    save("horizon", horizon.picture(found))
    seeds = planar.REPORT if full else planar.DEVELOPMENT
    save("box_plots", box_plots.led_picture(people))
    save("planar_box_plots", box_plots.planar_picture(seeds))
