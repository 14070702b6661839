"""The picture of a comparison: splits are paired where all of them have an error."""

from app.method_figure import draw, paired_horizon
from prediction import MethodScore, SplitScores, paired_table


def split(name, **at):
    def score(method, ratio):
        errors = {key.removeprefix("s").replace("_", "."): ratio * v for key, v in at.items()}
        return MethodScore(method, 1.0, 1.0, ratio, 0.0, 0.9, ratio, errors, 1e-5, 1e-4, 0.9, 10.0)

    return SplitScores(("part", name), {"cov-ik": score("cov-ik", 1.0), "gp": score("gp", 2.0)})


def test_splits_are_paired_at_the_longest_horizon_all_reach(tmp_path):
    long = split("long", s0_25=1.0, s0_5=2.0, s1=3.0, s2=4.0)
    short = split("short", s0_25=1.0, s0_5=2.0)
    assert paired_horizon([long]) == "1"
    assert paired_horizon([long, short]) == "0.5"
    scores = [long, short, SplitScores(("part", "none"), {}, "too few samples")]
    path = tmp_path / "picture.png"
    draw({"part": paired_table(scores, "part")}, {"part": "parts"}, {"a": scores, "b": []}, path)
    assert path.read_bytes().startswith(b"\x89PNG")
