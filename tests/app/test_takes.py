"""Which file goes with which: by role, by name, by order."""

from pathlib import Path

import pytest

from app.problems import InvalidRequest
from app.takes import takes_of


def roles(*names: str) -> list[dict[str, str]]:
    return [{role: part.name for role, part in take.parts().items()} for take in takes_of(names)]


def test_forces_go_with_the_trial_they_are_named_after() -> None:
    assert roles(
        "grf:d/squat1_grf.mot", "static:d/stand.trc", "d/squat1.trc", "d/squat10.trc",
        "grf:d/squat10_grf.mot", "grf:d/stand_grf.mot",
    ) == [
        {"motion": "squat1.trc", "static": "stand.trc", "grf": "squat1_grf.mot",
         "static_grf": "stand_grf.mot"},
        {"motion": "squat10.trc", "static": "stand.trc", "grf": "squat10_grf.mot",
         "static_grf": "stand_grf.mot"},
    ]  # fmt: skip


def test_forces_of_another_name_go_with_the_motion_before_or_the_only_one() -> None:
    assert roles("a.trc", "grf:x.mot", "b.trc", "grf:y.mot") == [
        {"motion": "a.trc", "grf": "x.mot"},
        {"motion": "b.trc", "grf": "y.mot"},
    ]
    assert roles("grf:x.mot", "motion:a.c3d") == [{"motion": "a.c3d", "grf": "x.mot"}]


def test_a_file_whose_name_looks_like_a_role_is_itself(tmp_path: Path) -> None:
    file = tmp_path / "grf:walk.trc"
    file.touch()
    assert roles(str(file)) == [{"motion": "grf:walk.trc"}]


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["grf:x.mot"], "a motion"),
        (["static:a.trc", "static:b.trc", "c.trc"], "one static"),
        (["a.trc", "grf:x.mot", "grf:y.mot"], "two files of forces"),
        (["grf:x.mot", "a.trc", "b.trc"], "after the motion"),
        (["plates:x.mot", "a.trc"], "no role"),
    ],
)
def test_what_has_no_place_is_named(names: list[str], words: str) -> None:
    with pytest.raises(InvalidRequest, match=words):
        takes_of(names)
