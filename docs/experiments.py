"""Draws the pictures of ``estimation_experiments.md``: ``python -m docs.experiments``."""

from pathlib import Path

from benchmarks.estimation.papers.catalogue import EXPERIMENTS, Scenes

IMAGES = Path(__file__).parent / "images"
PICTURES = {
    "hand": "2021_fig15_mass_by_covariance",
    "carrying": "2021_fig18_walking",
    "moments": "2021_fig19_walking_moments",
}


def main() -> None:
    """Runs three of the experiments and keeps one picture of each."""
    scenes = Scenes(seed=0, length=1.0, urdf=None)
    for name, stem in PICTURES.items():
        EXPERIMENTS[name](scenes).figures[stem].savefig(IMAGES / f"{stem}.png", dpi=75)


if __name__ == "__main__":
    main()
